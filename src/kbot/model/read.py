"""From an expanded document to a Robot, with every error at the place it was written.

Codes: U001 not a robot, U002 robot without a name, U003 no link, U004 link and U005 joint defined
twice, U006 parent and U007 child that is no link, U008 several roots, U009 ring, U010 two parents,
U011 unknown joint type, U012 bad number, U013 missing attribute, U014 missing element, U015 link or
joint without a name, U016 unknown shape.
"""

from __future__ import annotations

from dataclasses import dataclass

from kbot.model._joints import read_joint
from kbot.model._links import read_link, read_material, with_materials
from kbot.model._tree import check_tree
from kbot.model._values import MeshFinder, Values
from kbot.model.joint import Joint
from kbot.model.link import Link, Material
from kbot.model.robot import Robot
from kbot.text import DescriptionError, Diagnostic, Element, Related

_READ = ("link", "joint", "material")


@dataclass(frozen=True)
class Reading:
    """What came of a document; `robot` is None where links and joints make no tree."""

    robot: Robot | None
    diagnostics: tuple[Diagnostic, ...]

    def require(self) -> Robot:
        """The robot.

        Raises:
            DescriptionError: with every diagnostic, if one of them is an error.
        """
        if self.robot is None or any(d.is_error for d in self.diagnostics):
            raise DescriptionError(self.diagnostics)
        return self.robot


def read_robot(document: Element, packages: MeshFinder | None = None) -> Reading:
    """Read the root element of an expanded description. Never raises for what is written there.

    Reading goes on after an error. In a robot that came with errors, a number that could not be
    read stands as NaN in an inertial and as 0 in a pose or axis, and a shape that could not be read
    is left out. `packages` finds the meshes' files; one that is not found is no error here.
    """
    values = Values(packages)
    if document.tag != "robot":
        hint = "a robot starts with <robot name='…'>"
        values.error("U001", f"<{document.tag}> is not a robot", document.origin, hint)
        return Reading(None, tuple(values.diagnostics))
    name = document.attributes.get("name")
    if name is None or not name.strip():
        values.error("U002", "the robot has no name", document.origin, "add name='…' to <robot>")
    materials = _read_materials(document, values)
    links = _read_links(document, values)
    joints, is_tree = _read_joints(document, links, values)
    if not links:
        values.error("U003", "the robot has no link", document.origin)
    robot = None
    if links and is_tree:
        extensions = tuple(e for e in document.elements() if e.tag not in _READ)
        links = with_materials(links, materials)
        by_name = {joint.name: joint for joint in joints}
        robot = Robot(name or "", links, by_name, materials, extensions, document.origin)
    return Reading(robot, tuple(values.diagnostics))


def _read_materials(document: Element, values: Values) -> dict[str, Material]:
    """The materials that the root defines, the first of each name."""
    materials: dict[str, Material] = {}
    for element in document.elements("material"):
        if values.name(element) is None:
            continue
        material = read_material(element, values)
        if material.rgba is not None or material.texture is not None:
            materials.setdefault(material.name, material)
    return materials


def _read_links(document: Element, values: Values) -> dict[str, Link]:
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


def _read_joints(document: Element, links: dict[str, Link], values: Values) -> tuple[list[Joint], bool]:
    """The joints, and whether they make one tree of the links."""
    joints: list[Joint] = []
    by_name: dict[str, Element] = {}
    unread: set[str] = set()
    whole = True
    for element in document.elements("joint"):
        name = values.name(element)
        joint = read_joint(element, name or "", values)
        if name is not None:
            first = by_name.setdefault(name, element)
            if first is not element:
                whole = False
                values.error(
                    "U005",
                    f"joint '{name}' is defined twice",
                    element.attribute_origin("name"),
                    related=(Related("the first is here", first.origin),),
                )
        if joint is None or name is None:
            whole = False
            unread.update(_children(element))
        if joint is not None:
            joints.append(joint)
    return joints, check_tree(links, joints, unread, values) and whole


def _children(joint: Element) -> list[str]:
    return [e.attributes["link"] for e in joint.elements("child") if "link" in e.attributes]
