"""Reads the colours of SDF materials, and of Gazebo Classic's named materials in SDF and URDF."""

from __future__ import annotations

from kbot.model import RobotModel
from kbot.text import Element
from kbot.world.sdf.values import SdfValues
from kbot.world.world import GREY, Rgba

NAMED: dict[str, Rgba] = {
    "Black": (0.05, 0.05, 0.05, 1.0),
    "Blue": (0.0, 0.0, 1.0, 1.0),
    "Bricks": (0.60, 0.35, 0.27, 1.0),
    "CeilingTiled": (0.85, 0.85, 0.82, 1.0),
    "DarkGrey": (0.30, 0.30, 0.30, 1.0),
    "DarkYellow": (0.7, 0.7, 0.0, 1.0),
    "FlatBlack": (0.1, 0.1, 0.1, 1.0),
    "Gold": (0.8, 0.65, 0.2, 1.0),
    "Grass": (0.30, 0.50, 0.22, 1.0),
    "Gray": (0.5, 0.5, 0.5, 1.0),
    "Green": (0.0, 1.0, 0.0, 1.0),
    "Grey": (0.5, 0.5, 0.5, 1.0),
    "Indigo": (0.33, 0.0, 0.5, 1.0),
    "Orange": (1.0, 0.51, 0.0, 1.0),
    "Purple": (0.6, 0.0, 0.8, 1.0),
    "Red": (1.0, 0.0, 0.0, 1.0),
    "Residential": (0.75, 0.70, 0.62, 1.0),
    "Road": (0.25, 0.25, 0.26, 1.0),
    "SkyBlue": (0.13, 0.44, 0.70, 1.0),
    "Turquoise": (0.0, 1.0, 1.0, 1.0),
    "White": (1.0, 1.0, 1.0, 1.0),
    "Wood": (0.65, 0.48, 0.30, 1.0),
    "WoodFloor": (0.62, 0.46, 0.30, 1.0),
    "WoodPallet": (0.70, 0.55, 0.36, 1.0),
    "Yellow": (1.0, 1.0, 0.0, 1.0),
    "ZincYellow": (0.97, 0.83, 0.16, 1.0),
}


def colour(visual: Element, values: SdfValues) -> Rgba:
    """A visual's colour: `<diffuse>`, else `<ambient>`, else by the script's name, else grey."""
    material = visual.find("material")
    opacity = 1.0 - min(max(values.number(visual, "transparency", 0.0), 0.0), 1.0)
    if material is None:
        return (*GREY[:3], opacity)
    for tag in ("diffuse", "ambient"):
        element = material.find(tag)
        if element is not None:
            count = 3 if len(element.text.split()) == 3 else 4
            found = values.numbers(element, count)
            if found is not None:
                r, g, b, a = (min(max(v, 0.0), 1.0) for v in (*found, 1.0)[:4])
                return r, g, b, a * opacity
    script = material.find("script")
    name = script.find("name") if script is not None else None
    if name is not None:
        r, g, b, a = NAMED.get(name.text.strip().removeprefix("Gazebo/"), GREY)
        return r, g, b, a * opacity
    return (*GREY[:3], opacity)


def link_colours(robot: RobotModel) -> dict[str, Rgba]:
    """Colours of links whose `<gazebo>` tag has a `<material>` of Gazebo Classic.

    As in Gazebo Classic, they override the colours of the URDF. Unknown names are ignored.
    """
    colours = {}
    for extension in robot.extensions:
        link, material = extension.attributes.get("reference", ""), extension.find("material")
        if extension.tag == "gazebo" and link in robot.links and material is not None:
            named = NAMED.get(material.text.strip().removeprefix("Gazebo/"))
            if named is not None:
                colours[link] = named
    return colours
