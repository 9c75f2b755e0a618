"""Reads a robot from an expanded document. Each error has its position in the source.

Codes: U001 not a robot, U002 robot without a name, U003 no link, U004 link and U005 joint defined twice, U006
unknown parent link, U007 unknown child link, U008 several roots, U009 cycle, U010 two parents, U011 unknown
joint type, U012 bad number, U013 missing attribute, U014 missing element, U015 link or joint without a name,
U016 unknown shape.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from kbot.brief import Brief
from kbot.model._attributes import AttributeReader, MeshFinder, NamesAt, no_names, parts
from kbot.model.geometry import Box, Capsule, Cylinder, Geometry, Mesh, Sphere
from kbot.model.robot import (
    Collision,
    Dynamics,
    Inertial,
    Joint,
    JointType,
    Limit,
    Link,
    Material,
    Mimic,
    Pose,
    RobotModel,
    SafetyController,
    Visual,
)
from kbot.text import DescriptionError, Diagnostic, Element, Origin, Related
from kbot.text.file_kind import not_a_robot
from kbot.text.suggest import Candidates, did_you_mean, nearest


def check_tree(
    links: Mapping[str, Link], joints: Sequence[Joint], unread: set[str], values: AttributeReader
) -> bool:
    """Report why `joints` and `links` do not form a single tree. Returns True if they do.

    `unread` are links whose joint could not be read. No error is reported for their missing parent.
    """
    faults = len(values.diagnostics)
    excused = set(unread)
    complete: list[Joint] = []
    names = Candidates(links)
    for joint in joints:
        ends = ("U006", joint.parent, joint.parent_origin), ("U007", joint.child, joint.child_origin)
        missing = [(code, link, origin) for code, link, origin in ends if link not in links]
        for code, link, origin in missing:
            excused.update(nearest(link, names), {joint.child})
            _undefined(code, joint, link, origin, names, values)
        if not missing:
            complete.append(joint)
    parents = _single_parents(complete, values)
    in_cycle = _report_cycles(parents, values)
    _report_roots(links, parents, excused | in_cycle, values)
    return len(values.diagnostics) == faults


def _undefined(
    code: str, joint: Joint, link: str, origin: Origin, links: Candidates, values: AttributeReader
) -> None:
    end = "parent" if code == "U006" else "child"
    hint = did_you_mean(link, links)
    values.error(code, f"joint '{joint.name}' has the {end} '{link}', which is not a link", origin, hint)


def _single_parents(joints: Sequence[Joint], values: AttributeReader) -> dict[str, Joint]:
    """The parent joint of each link. A second one is an error."""
    parents: dict[str, Joint] = {}
    for joint in joints:
        first = parents.setdefault(joint.child, joint)
        if first is not joint:
            values.error(
                "U010",
                f"link '{joint.child}' has two parents: '{first.parent}' by joint '{first.name}' "
                f"and '{joint.parent}' by joint '{joint.name}'",
                joint.child_origin,
                "a link can be the child of only one joint",
                (Related("the first is here", first.child_origin),),
            )
    return parents


def _report_cycles(parents: Mapping[str, Joint], values: AttributeReader) -> set[str]:
    """Report each cycle of links once. Returns the links in cycles."""
    done: set[str] = set()
    in_cycles: set[str] = set()
    for start in parents:
        path: list[str] = []
        link = start
        while link in parents and link not in done:
            done.add(link)
            path.append(link)
            link = parents[link].parent
        if link in path:
            cycle = path[path.index(link) :]
            in_cycles.update(cycle)
            chain = " -> ".join(f"'{name}'" for name in [link, *reversed(cycle)])
            related = tuple(Related(f"joint '{parents[n].name}'", parents[n].origin) for n in cycle[1:])
            values.error("U009", f"links form a cycle: {chain}", parents[link].child_origin, related=related)
    return in_cycles


def _report_roots(
    links: Mapping[str, Link], parents: Mapping[str, Joint], excused: set[str], values: AttributeReader
) -> None:
    roots = [name for name in links if name not in parents]
    if len(roots) < 2:
        return
    children: dict[str, list[str]] = {name: [] for name in links}
    for child, joint in parents.items():
        children[joint.parent].append(child)
    sizes = dict.fromkeys(roots, 0)
    for root in roots:
        waiting = [root]
        while waiting:
            sizes[root] += 1
            waiting += children[waiting.pop()]
    main = max(roots, key=lambda name: (name not in excused, sizes[name]))
    for root in roots:
        if root != main and root not in excused:
            values.error(
                "U008",
                f"link '{root}' has no parent joint, and the robot already has the root '{main}'",
                links[root].origin,
                f"add a joint whose child is '{root}'",
                (Related("the root", links[main].origin),),
            )


_SHAPES = ("box", "cylinder", "sphere", "capsule", "mesh")


def read_link(element: Element, name: str, values: AttributeReader) -> Link:
    """A link. The names of its materials are not yet resolved."""
    inertial = element.find("inertial")
    visuals = (_read_visual(e, values) for e in element.elements("visual"))
    collisions = (_read_collision(e, values) for e in element.elements("collision"))
    return Link(
        name,
        _read_inertial(inertial, values) if inertial else None,
        tuple(v for v in visuals if v),
        tuple(c for c in collisions if c),
        element.origin,
    )


_ZERO = (0.0, 0.0, 0.0)
_IDENTITY = Pose()


def read_pose(origin: Element | None, values: AttributeReader) -> Pose:
    """The pose of an `<origin>`, or the identity if there is none."""
    if origin is None:
        return _IDENTITY
    xyz = values.vector(origin, "xyz", _ZERO)
    values.metres(origin, "xyz", *xyz)
    return Pose(xyz, values.vector(origin, "rpy", _ZERO), origin.origin)


def read_material(element: Element, values: AttributeReader) -> Material:
    """A material as written. Without a colour, `rgba` is None."""
    color = element.find("color")
    rgba = None
    if color is not None:
        r, g, b, a = values.numbers(color, "rgba", 4, None, 1.0)
        rgba = (r, g, b, a)
    texture = element.find("texture")
    file = values.required(texture, "filename") if texture is not None else None
    return Material(element.attributes.get("name", ""), rgba, file, element.origin)


def with_materials(links: dict[str, Link], defined: dict[str, Material]) -> dict[str, Link]:
    """The links, with the colours of named materials in their visuals.

    As in urdfdom, the first definition of a name wins, and those of the root come before those in visuals.
    Definitions in visuals are added to `defined`.
    """
    return {name: _link_with_materials(link, defined) for name, link in links.items()}


def _link_with_materials(link: Link, defined: dict[str, Material]) -> Link:
    if not any(v.material and v.material.name for v in link.visuals):
        return link
    visuals = tuple(_with_material(v, defined) for v in link.visuals)
    return Link(link.name, link.inertial, visuals, link.collisions, link.origin)


def _with_material(visual: Visual, defined: dict[str, Material]) -> Visual:
    material = visual.material
    if material is None or not material.name:
        return visual
    known = defined.get(material.name)
    if known is not None:
        looks = Material(material.name, known.rgba, known.texture, material.origin)
        return Visual(visual.name, visual.pose, visual.geometry, looks, visual.origin)
    if material.rgba is not None or material.texture is not None:
        defined[material.name] = material
    return visual


def _read_inertial(element: Element, values: AttributeReader) -> Inertial | None:
    """The inertial, or None if the mass or tensor is missing. A number that cannot be read is NaN."""
    inner = parts(element)
    mass, inertia = inner.get("mass"), inner.get("inertia")
    for part, tag in ((mass, "mass"), (inertia, "inertia")):
        if part is None:
            values.error("U014", f"<inertial> lacks <{tag}>", element.origin)
    if mass is None or inertia is None:
        return None
    ixx, ixy, ixz, iyy, iyz, izz = (
        values.number(inertia, name, None) for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    )
    return Inertial(
        mass=values.number(mass, "value", None),
        ixx=ixx,
        ixy=ixy,
        ixz=ixz,
        iyy=iyy,
        iyz=iyz,
        izz=izz,
        pose=read_pose(inner.get("origin"), values),
        origin=element.origin,
        mass_origin=mass.attribute_origin("value"),
        inertia_origin=inertia.origin,
    )


def _read_visual(element: Element, values: AttributeReader) -> Visual | None:
    inner = parts(element)
    geometry = _read_geometry(element, inner.get("geometry"), values)
    if geometry is None:
        return None
    material = inner.get("material")
    return Visual(
        element.attributes.get("name", ""),
        read_pose(inner.get("origin"), values),
        geometry,
        read_material(material, values) if material is not None else None,
        element.origin,
    )


def _read_collision(element: Element, values: AttributeReader) -> Collision | None:
    inner = parts(element)
    geometry = _read_geometry(element, inner.get("geometry"), values)
    if geometry is None:
        return None
    name = element.attributes.get("name", "")
    return Collision(name, read_pose(inner.get("origin"), values), geometry, element.origin)


def _read_geometry(parent: Element, element: Element | None, values: AttributeReader) -> Geometry | None:
    """The shape, or None and errors if it is missing or one of its sizes cannot be read."""
    if element is None:
        values.error("U014", f"<{parent.tag}> lacks <geometry>", parent.origin)
        return None
    shape = next((e for e in element.elements() if e.tag in _SHAPES), None)
    if shape is None:
        unknown = next(element.elements(), None)
        if unknown is None:
            values.error("U014", "<geometry> is empty", element.origin, "one of " + ", ".join(_SHAPES))
        else:
            hint = did_you_mean(unknown.tag, _SHAPES) or "one of " + ", ".join(_SHAPES)
            values.error("U016", f"<{unknown.tag}> is not a shape", unknown.origin, hint)
        return None
    faults = len(values.diagnostics)
    geometry = _read_shape(shape, values)
    return geometry if len(values.diagnostics) == faults else None


def _read_shape(shape: Element, values: AttributeReader) -> Geometry:
    origin = shape.origin
    match shape.tag:
        case "box":
            size = values.vector(shape, "size", None)
            values.metres(shape, "size", *size)
            return Box(size, origin)
        case "sphere":
            radius = values.number(shape, "radius", None)
            values.metres(shape, "radius", radius)
            return Sphere(radius, origin)
        case "mesh":
            uri = values.required(shape, "filename") or ""
            scale = values.vector(shape, "scale", (1.0, 1.0, 1.0), 1.0)
            return Mesh(uri, values.file(uri), scale, origin)
        case tag:
            radius = values.number(shape, "radius", None)
            length = values.number(shape, "length", None)
            values.metres(shape, "radius", radius)
            values.metres(shape, "length", length)
            return (Capsule if tag == "capsule" else Cylinder)(radius, length, origin)


_TYPES = [str(t) for t in JointType]


def read_joint(element: Element, name: str, values: AttributeReader) -> Joint | None:
    """A joint, or None and errors if its type or one of its links is missing or unknown."""
    kind = _read_type(element, name, values)
    values.joint_type = kind or ""
    inner = parts(element)
    parent, child = (_read_end(element, inner.get(tag), name, tag, values) for tag in ("parent", "child"))
    axis = inner.get("axis")
    limit, dynamics = inner.get("limit"), inner.get("dynamics")
    mimic, safety = inner.get("mimic"), inner.get("safety_controller")
    pose = read_pose(inner.get("origin"), values)
    x_axis = (1.0, 0.0, 0.0)
    direction = x_axis if axis is None else values.vector(axis, "xyz", x_axis)
    read_limit = _read_limit(limit, values) if limit is not None else None
    read_dynamics = _read_dynamics(dynamics, values) if dynamics is not None else None
    read_mimic = _read_mimic(mimic, values) if mimic is not None else None
    read_safety = _read_safety(safety, values) if safety is not None else None
    if kind is None or parent is None or child is None:
        return None
    return Joint(
        name=name,
        type=kind,
        parent=parent[0],
        child=child[0],
        pose=pose,
        axis=direction,
        axis_origin=None if axis is None else axis.attribute_origin("xyz"),
        limit=read_limit,
        dynamics=read_dynamics,
        mimic=read_mimic,
        safety=read_safety,
        origin=element.origin,
        parent_origin=parent[1],
        child_origin=child[1],
    )


def _read_type(element: Element, name: str, values: AttributeReader) -> JointType | None:
    text = values.required(element, "type")
    if text is None:
        return None
    try:
        return JointType(text)
    except ValueError:
        hint = did_you_mean(text, _TYPES) or "one of " + ", ".join(_TYPES)
        message = f"joint '{name}' has the unknown type '{text}'"
        values.error("U011", message, element.attribute_origin("type"), hint)
        return None


def _read_end(
    element: Element, end: Element | None, name: str, tag: str, values: AttributeReader
) -> tuple[str, Origin] | None:
    if end is None:
        values.error("U014", f"joint '{name}' lacks <{tag}>", element.origin)
        return None
    link = values.required(end, "link")
    return None if link is None else (link, end.attribute_origin("link"))


def _read_limit(element: Element, values: AttributeReader) -> Limit:
    lower, upper, effort, velocity = (
        values.optional_number(element, name) for name in ("lower", "upper", "effort", "velocity")
    )
    return Limit(lower, upper, effort, velocity, element.origin)


def _read_dynamics(element: Element, values: AttributeReader) -> Dynamics:
    damping, friction = (values.number(element, name, 0.0, 0.0) for name in ("damping", "friction"))
    return Dynamics(damping, friction, element.origin)


def _read_mimic(element: Element, values: AttributeReader) -> Mimic | None:
    joint = values.required(element, "joint")
    multiplier = values.number(element, "multiplier", 1.0, 1.0)
    offset = values.number(element, "offset", 0.0, 0.0)
    return None if joint is None else Mimic(joint, multiplier, offset, element.origin)


def _read_safety(element: Element, values: AttributeReader) -> SafetyController:
    names = ("soft_lower_limit", "soft_upper_limit", "k_position")
    lower, upper, k_position = (values.number(element, name, 0.0, 0.0) for name in names)
    k_velocity = values.number(element, "k_velocity", None, 0.0)
    return SafetyController(lower, upper, k_position, k_velocity, element.origin)


_READ = ("link", "joint", "material")


@dataclass(frozen=True, repr=False)
class RobotReading(Brief):
    """The result of reading a document. `robot` is None if its links and joints do not form a tree."""

    robot: RobotModel | None
    diagnostics: tuple[Diagnostic, ...]

    def require(self) -> RobotModel:
        """Return the robot.

        Raises:
            DescriptionError: a diagnostic is an error. The exception has all diagnostics.
        """
        if self.robot is None or any(d.is_error for d in self.diagnostics):
            raise DescriptionError(self.diagnostics)
        return self.robot


def read_robot(
    document: Element, packages: MeshFinder | None = None, names: NamesAt = no_names
) -> RobotReading:
    """Read the root element of an expanded description. Errors are diagnostics, not exceptions.

    Reading continues after an error. In a robot with errors, an unreadable number is NaN in an inertial and 0
    in a pose or axis, and an unreadable shape is omitted. `packages` finds the files of meshes. A missing
    file is not an error here. `names` are those that a correction may suggest.
    """
    values = AttributeReader(packages, names)
    if document.tag != "robot":
        message, hint = not_a_robot(document.tag, f"<{document.tag}>")
        values.error("U001", message, document.origin, hint)
        return RobotReading(None, tuple(values.diagnostics))
    name = document.attributes.get("name")
    if name is None or not name.strip():
        values.error("U002", "the robot has no name", document.origin, "add name='…' to <robot>")
    materials = _read_materials(document, values)
    links = _read_links(document, values)
    joints, is_tree = _read_joints(document, links, values)
    if not links:
        hint = 'add the first one: <link name="base_link"> … </link>'
        values.error("U003", "the robot has no link", document.origin, hint)
    robot = None
    if links and is_tree:
        extensions = tuple(e for e in document.elements() if e.tag not in _READ)
        links = with_materials(links, materials)
        by_name = {joint.name: joint for joint in joints}
        robot = RobotModel(name or "", links, by_name, materials, extensions, document.origin)
    return RobotReading(robot, tuple(values.diagnostics))


def _read_materials(document: Element, values: AttributeReader) -> dict[str, Material]:
    """The materials that the root defines. The first one with a name counts."""
    materials: dict[str, Material] = {}
    for element in document.elements("material"):
        if values.name(element) is None:
            continue
        material = read_material(element, values)
        if material.rgba is not None or material.texture is not None:
            materials.setdefault(material.name, material)
    return materials


def _read_links(document: Element, values: AttributeReader) -> dict[str, Link]:
    links: dict[str, Link] = {}
    for element in document.elements("link"):
        name = values.name(element)
        link = read_link(element, name or "", values)
        if name is None:
            continue
        first = links.setdefault(name, link)
        if first is not link:
            values.error(
                "U004",
                f"link '{name}' is defined twice",
                element.attribute_origin("name"),
                related=(Related("the first is here", first.origin),),
            )
    return links


def _read_joints(
    document: Element, links: dict[str, Link], values: AttributeReader
) -> tuple[list[Joint], bool]:
    """The joints, and whether they and the links form a single tree."""
    joints: list[Joint] = []
    by_name: dict[str, Element] = {}
    unread: set[str] = set()
    is_complete = True
    for element in document.elements("joint"):
        name = values.name(element)
        joint = read_joint(element, name or "", values)
        if name is not None:
            first = by_name.setdefault(name, element)
            if first is not element:
                is_complete = False
                values.error(
                    "U005",
                    f"joint '{name}' is defined twice",
                    element.attribute_origin("name"),
                    related=(Related("the first is here", first.origin),),
                )
        if joint is None or name is None:
            is_complete = False
            unread.update(_children(element))
        if joint is not None:
            joints.append(joint)
    return joints, check_tree(links, joints, unread, values) and is_complete


def _children(joint: Element) -> list[str]:
    return [e.attributes["link"] for e in joint.elements("child") if "link" in e.attributes]
