"""What a description says of the surfaces of its links: friction, stiffness, self-collision, gravity."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import isfinite

from kbot.model import RobotModel
from kbot.sim.recipe import FRICTION
from kbot.text import DiagnosticCollector, Element
from kbot.text.numbers import to_float
from kbot.text.suggest import did_you_mean


@dataclass(frozen=True, slots=True)
class ContactSurface:
    """`friction`: sliding coefficient (mu1). `self_collide`: touches other such links of its own robot.
    `gravity`: whether the link falls. `stiffness` (kp, N/m) and `damping` (kd, N s/m) of its contacts, None
    where nothing is said."""

    friction: float = FRICTION
    self_collide: bool = False
    gravity: bool = True
    stiffness: float | None = None
    damping: float = 0.0


DEFAULT_SURFACE = ContactSurface()


def link_surfaces(robot: RobotModel, findings: DiagnosticCollector) -> Mapping[str, ContactSurface]:
    """The surfaces of the links that something is said of."""
    surfaces: dict[str, ContactSurface] = {}
    everywhere = DEFAULT_SURFACE
    for extension in robot.extensions:
        if extension.tag != "gazebo":
            continue
        link = extension.attributes.get("reference")
        if link is None:
            everywhere = _read(extension, everywhere, findings, whole=True)
        elif link in robot.links:
            surfaces[link] = _read(extension, surfaces.get(link, DEFAULT_SURFACE), findings)
        elif link not in robot.joints:
            findings.warning(
                "W133",
                f"<gazebo> speaks of '{link}', which is no link",
                extension.attribute_origin("reference"),
                did_you_mean(link, robot.links),
            )
    if everywhere.self_collide:
        return {link: replace(surfaces.get(link, DEFAULT_SURFACE), self_collide=True) for link in robot.links}
    return surfaces


def _read(
    element: Element, surface: ContactSurface, findings: DiagnosticCollector, whole: bool = False
) -> ContactSurface:
    collides = _truth(element, ("selfCollide", "self_collide"), surface.self_collide)
    if whole:
        return replace(surface, self_collide=collides)
    friction = _number(element, ("mu1", "mu"), "coefficient of friction", findings)
    across = _number(element, ("mu2",), "coefficient of friction", findings)
    if friction is not None and across is not None and across != friction:
        findings.info(
            "W136", f"friction differs by direction: mu1, {friction:g}, counts in all of them", element.origin
        )
    stiffness = _number(element, ("kp",), "stiffness", findings)
    damping = _number(element, ("kd",), "damping", findings)
    gravity = _truth(element, ("gravity",), surface.gravity) and not _truth(
        element, ("turnGravityOff",), default=False
    )
    return ContactSurface(
        surface.friction if friction is None else friction,
        collides,
        gravity,
        stiffness or surface.stiffness,
        surface.damping if damping is None else damping,
    )


def _number(
    element: Element, tags: tuple[str, ...], what: str, findings: DiagnosticCollector
) -> float | None:
    """A number from 0 on; None where it is not there or, with a finding, is none."""
    said = next((found for tag in tags if (found := element.find(tag)) is not None), None)
    if said is None:
        return None
    # as a text or as an attribute: the reader of Gazebo takes both
    written = said.attributes.get("value", said.text).strip()
    try:
        value = to_float(written)
    except ValueError:
        value = -1.0
    if isfinite(value) and value >= 0.0:
        return value
    findings.warning("W130", f"<{said.tag}> is no {what}: '{written}'", said.origin, "it is left out")
    return None


def _truth(element: Element, names: tuple[str, ...], default: bool) -> bool:
    for name in names:
        said = element.find(name)
        if said is not None:
            return said.attributes.get("value", said.text).strip().lower() in ("1", "true")
    return default
