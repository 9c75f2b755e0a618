"""What `<gazebo reference="link">` says of how a link touches and falls."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import isfinite

from kbot.model import Robot
from kbot.sim.recipe import FRICTION
from kbot.text import Element
from kbot.text.numbers import to_float
from kbot.text.suggest import did_you_mean
from kbot.world.findings import Findings


@dataclass(frozen=True, slots=True)
class Surface:
    """`friction`: sliding coefficient (mu1). `self_collide`: touches other such links of its own robot.
    `gravity`: whether the link falls."""

    friction: float = FRICTION
    self_collide: bool = False
    gravity: bool = True


PLAIN = Surface()


def link_surfaces(robot: Robot, findings: Findings) -> Mapping[str, Surface]:
    """The surfaces of the links that something is said of."""
    surfaces: dict[str, Surface] = {}
    everywhere = PLAIN
    for extension in robot.extensions:
        if extension.tag != "gazebo":
            continue
        link = extension.attributes.get("reference")
        if link is None:
            everywhere = _read(extension, everywhere, findings, whole=True)
        elif link in robot.links:
            surfaces[link] = _read(extension, surfaces.get(link, PLAIN), findings)
        elif link not in robot.joints:
            findings.warning(
                "W133",
                f"<gazebo> speaks of '{link}', which is no link",
                extension.attribute_origin("reference"),
                did_you_mean(link, robot.links),
            )
    if everywhere.self_collide:
        return {link: replace(surfaces.get(link, PLAIN), self_collide=True) for link in robot.links}
    return surfaces


def _read(element: Element, surface: Surface, findings: Findings, whole: bool = False) -> Surface:
    collides = _truth(element, ("selfCollide", "self_collide"), surface.self_collide)
    if whole:
        return replace(surface, self_collide=collides)
    friction = _friction(element, surface.friction, findings)
    gravity = _truth(element, ("gravity",), surface.gravity) and not _truth(
        element, ("turnGravityOff",), default=False
    )
    return Surface(friction, collides, gravity)


def _friction(element: Element, default: float, findings: Findings) -> float:
    said = element.find("mu1") or element.find("mu")
    if said is None:
        return default
    # as a text or as an attribute: the reader of Gazebo takes both
    written = said.attributes.get("value", said.text).strip()
    try:
        value = to_float(written)
    except ValueError:
        value = -1.0
    if isfinite(value) and value >= 0.0:
        return value
    findings.warning(
        "W130", f"<{said.tag}> is no coefficient of friction: '{written}'", said.origin,
        f"{default:g} is taken instead",
    )  # fmt: skip
    return default


def _truth(element: Element, names: tuple[str, ...], default: bool) -> bool:
    for name in names:
        said = element.find(name)
        if said is not None:
            return said.text.strip().lower() in ("1", "true")
    return default
