"""Rules about the structure of URDF: tags, attributes, names."""

from __future__ import annotations

import re

from kbot.checks.context import Context
from kbot.checks.edits import remove_attributes, rename_attribute, rename_tag
from kbot.checks.facts.vocabulary import ATTRIBUTES, CHILDREN, FOREIGN_ATTRIBUTES, TOLERATED
from kbot.checks.registry import Finding, Found, rule
from kbot.text import Severity
from kbot.text.suggest import did_you_mean
from kbot.xacro.location import name_span

_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.\-/:]*")


@rule("U201", "unknown-tag", Severity.WARNING, "document")
def unknown_tag(context: Context) -> Found:
    """An element is misspelt or in the wrong place, so URDF parsers ignore it.

    Why: URDF parsers ignore unknown elements without an error message. A link with `<inertal>` has no mass,
    and Gazebo removes it. A link with `<colision>` falls through the floor.

    Example: `<link name="arm"> <viusal>…</viusal> </link>`

    Fix: Correct the tag, or move the element to its parent. Elements with a namespace and the content of
    `<gazebo>`, `<transmission>` and `<ros2_control>` are not checked.

    Autofix: safe: KBot renames the tag if it is a typo of exactly one known tag that is not yet present.
    """
    # a set: a search among the siblings for each unknown element would take quadratic time
    present = {(id(parent), element.tag) for parent, element in context.urdf}
    for parent, element in context.urdf:
        tag, known = element.tag, CHILDREN[parent.tag]
        if tag in known or tag in TOLERATED.get(parent.tag, ()):
            continue
        meant = did_you_mean(tag, known)
        near = meant.nearest
        if parent.tag == "robot" and not near and tag not in ATTRIBUTES:
            continue  # an extension
        if parent.tag == "geometry" and not near:
            continue  # the URDF reader reports it (U016)
        if tag in ATTRIBUTES and not near:
            where = ", ".join(f"<{p}>" for p, children in CHILDREN.items() if tag in children)
            yield Finding(
                element.origin,
                f"<{tag}> is ignored in <{parent.tag}>: it belongs in {where}",
                "move it",
            )
            continue
        fits = meant.sure if (id(parent), meant.sure) not in present or meant.sure in _MANY else ""
        either = " or ".join(f"<{n}>" for n in near)
        yield Finding(
            element.origin,
            f"<{parent.tag}> cannot contain <{tag}>: URDF parsers ignore it",
            f"did you mean {either}?" if near else "one of " + ", ".join(f"<{c}>" for c in known),
            fix=rename_tag(context.element_at(element.origin), fits, safe=True) if fits else None,
        )


_MANY = frozenset({"link", "joint", "visual", "collision", "material"})
"""Elements that may occur more than once in their parent."""


@rule("U202", "unknown-attribute", Severity.INFO, "document")
def unknown_attribute(context: Context) -> Found:
    """An attribute is misspelt, or belongs to another element.

    Why: URDF parsers ignore it and use the default. `<origin xzy="0 0 0.5"/>` puts the part at 0 0 0, half a
    metre too low. `rpy` in `<axis>` has no effect. A misspelt attribute is a warning.

    Example: `<axis xyz="0 1 0" rpy="0 0 0"/>`

    Fix: Correct the name of the attribute, or remove it.

    Autofix: safe: KBot renames the attribute if it is a typo of exactly one known attribute that is not yet
    present. It removes `rpy` from `<axis>`.
    """
    for element in (context.root, *(child for _, child in context.urdf)):
        known = ATTRIBUTES.get(element.tag)
        if known is None:
            continue
        for name in element.attributes:
            if name in known or ":" in name or name == "xmlns":
                continue
            if name in FOREIGN_ATTRIBUTES.get(element.tag, ()):
                continue
            near = did_you_mean(name, [n for n in known if n not in element.attributes])
            hint = str(near) or _has(
                element.tag, known
            )  # plain text: `with_fix` would use a Suggestion for a value
            own = context.element_at(element.origin)
            if near:
                fix = rename_attribute(own, name, near.sure, safe=True) if near.sure else None
            else:
                fix = remove_attributes(own, (name,), safe=element.tag == "axis" and name == "rpy")
            is_moved = name in (element.moved or ())  # by xacro:attribute, so it is not in the tag
            yield Finding(
                element.attribute_origin(name) if is_moved else name_span(element, name, element.call),
                f"'{name}' is not an attribute of <{element.tag}>: URDF parsers ignore it",
                hint,
                fix=fix,
                severity=Severity.WARNING if near else None,
            )


def _has(tag: str, known: tuple[str, ...]) -> str:
    return f"<{tag}> has the attributes " + ", ".join(known) if known else f"<{tag}> has no attributes"


@rule("U203", "bad-name", Severity.WARNING, "document")
def bad_name(context: Context) -> Found:
    """The name of a link or joint has characters that ROS does not accept.

    Why: The name becomes the name of a frame, topic or parameter. With a space or a bracket in it, remapping,
    parameter files and the conversion to SDF fail, often far from the cause.

    Example: `<link name="left wheel"/>`

    Fix: Use letters, digits, `_`, `-` and `.`, with `/` only between them.

    Autofix: none: the name is used in other files too.
    """
    for element in context.root.elements():
        if element.tag not in ("link", "joint"):
            continue
        name = element.attributes.get("name", "")
        if name.strip() and not name.startswith("/") and not _NAME.fullmatch(name) and "$" not in name:
            odd = next((c for c in name if not re.fullmatch(r"[A-Za-z0-9_.\-/:]", c)), name[0])
            what = "a space" if odd.isspace() else f"'{odd}'"
            yield Finding(
                element.attribute_origin("name"),
                f"the name '{name}' contains {what}, which names of frames and topics cannot contain",
                "use letters, digits and _",
            )


@rule("U204", "leading-slash", Severity.ERROR, "document", is_ros_only=True)
def leading_slash(context: Context) -> Found:
    """The name of a link begins with `/`.

    Why: tf2 rejects such frames: "Invalid argument … tf2 frame_ids cannot start with a '/'".

    Example: `<link name="/base_link"/>`

    Fix: Remove the slash here and wherever the link is named.

    Autofix: none: the name is used in other places too.
    """
    for element in context.root.elements("link"):
        name = element.attributes.get("name", "")
        if name.startswith("/"):
            yield Finding(
                element.attribute_origin("name"),
                f"the name '{name}' begins with '/', which tf2 rejects",
                f"write '{name.lstrip('/')}'",
            )


@rule("U205", "frame-reserved", Severity.WARNING, "document")
def frame_reserved(context: Context) -> Found:
    """A link of the robot is called `map` or `odom`.

    Why: REP 105 reserves these frames for localisation and odometry, which publish them as parents of the
    robot's root. A link with such a name gets two parents, and the tf tree jumps between them.

    Example: `<link name="odom"/>`

    Fix: Begin the tree with `base_footprint` or `base_link`. Simulators do not need a link for `map` or
    `odom`.

    Autofix: none.
    """
    for element in context.root.elements("link"):
        if element.attributes.get("name") in ("odom", "map") and context.has("robot"):
            robot = context.robot
            name = element.attributes["name"]
            if not any(j.is_movable for j in robot.child_joints.get(name, ())):
                yield Finding(
                    element.attribute_origin("name"),
                    f"the link '{name}' has the name of a frame that localisation or odometry publishes "
                    "(REP 105), so the frame has two publishers",
                    "begin the tree with base_footprint or base_link",
                )
