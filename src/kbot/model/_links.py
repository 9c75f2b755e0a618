"""`<link>` and what is in it, as urdfdom reads it."""

from __future__ import annotations

from kbot.model._values import Values, parts
from kbot.model.geometry import Box, Capsule, Cylinder, Geometry, Mesh, Sphere
from kbot.model.link import Collision, Inertial, Link, Material, Pose, Visual
from kbot.text import Element
from kbot.text.suggest import did_you_mean

_SHAPES = ("box", "cylinder", "sphere", "capsule", "mesh")


def read_link(element: Element, name: str, values: Values) -> Link:
    """A link; its materials are as written, not yet looked up."""
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


def read_pose(origin: Element | None, values: Values) -> Pose:
    """An `<origin>`; the identity where there is none."""
    if origin is None:
        return _IDENTITY
    xyz = values.vector(origin, "xyz", _ZERO)
    values.metres(origin, "xyz", *xyz)
    return Pose(xyz, values.vector(origin, "rpy", _ZERO), origin.origin)


def read_material(element: Element, values: Values) -> Material:
    """A material as written: without a colour, `rgba` is None."""
    color = element.find("color")
    rgba = None
    if color is not None:
        r, g, b, a = values.numbers(color, "rgba", 4, None, 1.0)
        rgba = (r, g, b, a)
    texture = element.find("texture")
    file = values.required(texture, "filename") if texture is not None else None
    return Material(element.attributes.get("name", ""), rgba, file, element.origin)


def with_materials(links: dict[str, Link], defined: dict[str, Material]) -> dict[str, Link]:
    """Links whose visuals have the colour that their material's name stands for.

    The first definition of a name wins, the root's before those in visuals, as in urdfdom;
    definitions found in visuals are added to `defined`.
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


def _read_inertial(element: Element, values: Values) -> Inertial | None:
    """None when the mass or the tensor is missing; a number that cannot be read is NaN."""
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


def _read_visual(element: Element, values: Values) -> Visual | None:
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


def _read_collision(element: Element, values: Values) -> Collision | None:
    inner = parts(element)
    geometry = _read_geometry(element, inner.get("geometry"), values)
    if geometry is None:
        return None
    name = element.attributes.get("name", "")
    return Collision(name, read_pose(inner.get("origin"), values), geometry, element.origin)


def _read_geometry(parent: Element, element: Element | None, values: Values) -> Geometry | None:
    """The shape, or None and errors when there is none or one of its sizes cannot be read."""
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


def _read_shape(shape: Element, values: Values) -> Geometry:
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
