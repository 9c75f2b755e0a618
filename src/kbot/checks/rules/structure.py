"""Rules about the structure of URDF: tags, attributes, names."""

from __future__ import annotations

import re

from kbot.checks.context import Context
from kbot.checks.edits import remove_attributes, rename_attribute, rename_tag
from kbot.checks.facts.vocabulary import ATTRIBUTES, CHILDREN, FOREIGN_ATTRIBUTES, TOLERATED
from kbot.checks.registry import Finding, Found, rule
from kbot.text import Severity
from kbot.text.suggest import did_you_mean

_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.\-/:]*")


@rule("U201", "unknown-tag", Severity.WARNING, "document")
def unknown_tag(context: Context) -> Found:
    """An element that URDF does not have where it stands: misspelt, or in the wrong place.

    Why: URDF readers ignore what they do not know. A link with `<inertal>` has no mass, and
    Gazebo drops it; one with `<colision>` falls through the floor. Nothing says so.

    Example: `<link name="arm"> <viusal>…</viusal> </link>`

    Fix: write the tag as URDF has it. Elements with a namespace and the contents of `<gazebo>`,
    `<transmission>` and `<ros2_control>` are not checked.

    Autofix: safe: renamed where the tag is a slip of one known tag that is not there already.
    """
    # a set: a search among the children for each unknown element takes the square of their number
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
            continue  # the reader says so
        if tag in ATTRIBUTES and not near:
            where = ", ".join(f"<{p}>" for p, children in CHILDREN.items() if tag in children)
            yield Finding(
                element.origin,
                f"<{tag}> is ignored in <{parent.tag}>: it belongs in {where}",
                "move it there",
            )
            continue
        fits = meant.sure if (id(parent), meant.sure) not in present or meant.sure in _MANY else ""
        either = " or ".join(f"<{n}>" for n in near)
        yield Finding(
            element.origin,
            f"<{tag}> is no element of <{parent.tag}>, and is ignored by every reader",
            f"did you mean {either}?" if near else "one of " + ", ".join(f"<{c}>" for c in known),
            fix=rename_tag(context.element_at(element.origin), fits, safe=True) if fits else None,
        )


_MANY = frozenset({"link", "joint", "visual", "collision", "material"})


@rule("U202", "unknown-attribute", Severity.WARNING, "document")
def unknown_attribute(context: Context) -> Found:
    """An attribute that its element does not have: misspelt, or of another element.

    Why: readers ignore it and take the default: `<origin xzy="0 0 0.5"/>` puts the part at 0 0 0, half a
    metre lower; `rpy` on `<axis>` turns nothing.

    Example: `<axis xyz="0 1 0" rpy="0 0 0"/>`

    Fix: write the attribute as URDF has it, or remove it.

    Autofix: safe: renamed where the name is a slip of one known attribute that is not given; `rpy` on
    `<axis>` is removed.
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
            hint = str(near) or _has(element.tag, known)  # a Suggestion would be written as a value
            own = context.element_at(element.origin)
            if near:
                fix = rename_attribute(own, name, near.sure, safe=True) if near.sure else None
            else:
                fix = remove_attributes(own, (name,), safe=element.tag == "axis" and name == "rpy")
            yield Finding(
                element.attribute_origin(name),
                f"'{name}' is not an attribute of <{element.tag}>, and is ignored by every reader",
                hint,
                fix=fix,
            )


def _has(tag: str, known: tuple[str, ...]) -> str:
    return f"<{tag}> has " + (", ".join(known) if known else "no attributes")


@rule("U203", "bad-name", Severity.WARNING, "document")
def bad_name(context: Context) -> Found:
    """A link's or joint's name with characters that ROS does not take.

    Why: the name becomes a frame, a topic, a parameter. With a blank or a bracket in it, remapping,
    parameter files and SDF conversion fail, often far from here.

    Example: `<link name="left wheel"/>`

    Fix: letters, digits, `_`, `-`, `.` and `/` between them.

    Autofix: none; the name is used in other files too.
    """
    for element in context.root.elements():
        if element.tag not in ("link", "joint"):
            continue
        name = element.attributes.get("name", "")
        if name.strip() and not name.startswith("/") and not _NAME.fullmatch(name) and "$" not in name:
            odd = next((c for c in name if not re.fullmatch(r"[A-Za-z0-9_.\-/:]", c)), name[0])
            what = "a blank" if odd.isspace() else f"'{odd}'"
            yield Finding(
                element.attribute_origin("name"),
                f"the name '{name}' has {what} in it, which names of frames and topics cannot have",
                "use letters, digits and _",
            )


@rule("U204", "leading-slash", Severity.ERROR, "document")
def leading_slash(context: Context) -> Found:
    """A link's name that begins with `/`.

    Why: tf2 refuses such frames: "Invalid argument … tf2 frame_ids cannot start with a '/'".

    Example: `<link name="/base_link"/>`

    Fix: leave the slash out, here and where the link is named.

    Autofix: none; the name is used in other places too.
    """
    for element in context.root.elements("link"):
        name = element.attributes.get("name", "")
        if name.startswith("/"):
            yield Finding(
                element.attribute_origin("name"),
                f"the name '{name}' begins with '/', which tf2 refuses",
                f"write '{name.lstrip('/')}'",
            )


@rule("U205", "frame-reserved", Severity.WARNING, "document")
def frame_reserved(context: Context) -> Found:
    """A link called `map` or `odom`, inside the robot.

    Why: REP 105 gives these frames to localisation and odometry, which publish them above the robot. A
    link of that name gets two parents: the tree jumps between both.

    Example: `<link name="odom"/>`

    Fix: begin the tree at `base_footprint` or `base_link`; simulators need no such link.

    Autofix: none.
    """
    for element in context.root.elements("link"):
        if element.attributes.get("name") in ("odom", "map") and context.has("robot"):
            robot = context.robot
            name = element.attributes["name"]
            if not any(j.is_movable for j in robot.child_joints.get(name, ())):
                yield Finding(
                    element.attribute_origin("name"),
                    f"the link '{name}' takes a frame that REP 105 gives to localisation: it will have "
                    "two publishers",
                    "begin the tree at base_footprint or base_link",
                )
