"""Reads the surfaces of links from `<gazebo>` tags: friction, stiffness, self-collision, gravity."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from math import hypot, inf, isfinite

from kbot.model import RobotModel
from kbot.sim.recipe import FRICTION
from kbot.text import Diagnostic, DiagnosticCollector, Element, Related
from kbot.text.numbers import to_float
from kbot.text.suggest import did_you_mean


@dataclass(frozen=True, slots=True)
class ContactSurface:
    """The contact properties of a link.

    `friction` is the sliding coefficient (mu1). Links with `self_collide` collide with each other. `gravity`:
    whether gravity acts on the link. `stiffness` (kp, N/m; None if not given) and `damping` (kd, N s/m) are
    those of its contacts. If `direction` (fdir1, in the frame of the collision shape) is given, `friction`
    acts along it and `second_friction` (mu2) across it.
    """

    friction: float = FRICTION
    second_friction: float = FRICTION
    direction: tuple[float, float, float] | None = None
    self_collide: bool = False
    gravity: bool = True
    stiffness: float | None = None
    damping: float = 0.0


DEFAULT_SURFACE = ContactSurface()


def link_surfaces(
    robot: RobotModel, findings: DiagnosticCollector, directed: Collection[str] = ()
) -> Mapping[str, ContactSurface]:
    """The surfaces of the links that have `<gazebo>` tags.

    `directed` are the links on which friction by direction is simulated. On others it is reported (W136).
    """
    surfaces: dict[str, ContactSurface] = {}
    everywhere = DEFAULT_SURFACE
    for extension in robot.extensions:
        if extension.tag != "gazebo":
            continue
        link = extension.attributes.get("reference")
        if link is None:
            everywhere = _read(extension, everywhere, findings, whole=True)
        elif link in robot.links:
            before = surfaces.get(link, DEFAULT_SURFACE)
            own = DiagnosticCollector()
            surfaces[link] = _read(extension, before, own, is_directed=link in directed)
            for finding in own.diagnostics:
                _add(finding, findings.diagnostics)
        elif link not in robot.joints:
            findings.warning(
                "W133",
                f"<gazebo> refers to '{link}', which is neither a link nor a joint",
                extension.attribute_origin("reference"),
                did_you_mean(link, robot.links),
            )
    if everywhere.self_collide:
        return {link: replace(surfaces.get(link, DEFAULT_SURFACE), self_collide=True) for link in robot.links}
    return surfaces


def _add(finding: Diagnostic, findings: list[Diagnostic]) -> None:
    """Add a finding. W136 of another link with the same friction becomes a place of the first one."""
    for index, first in enumerate(findings if finding.code == "W136" else ()):
        if first.code != finding.code or first.message != finding.message:
            continue
        places = [origin.span for origin in (first.origin, *(r.origin for r in first.related)) if origin]
        if finding.origin is None or finding.origin.span == places[0]:
            break  # another call of the same macro, which is merged where findings are printed
        if finding.origin.span not in places:
            related = (*first.related, Related("also here", finding.origin))
            findings[index] = replace(first, related=related)
        return
    findings.append(finding)


def _read(
    element: Element,
    surface: ContactSurface,
    findings: DiagnosticCollector,
    *,
    whole: bool = False,
    is_directed: bool = False,
) -> ContactSurface:
    collides = _truth(element, ("selfCollide", "self_collide"), surface.self_collide)
    if whole:
        return replace(surface, self_collide=collides)
    friction = _number(element, ("mu1", "mu"), "coefficient of friction", findings)
    across = _number(element, ("mu2",), "coefficient of friction", findings)
    direction = _direction(element)
    is_simulated = is_directed and direction is not None
    if friction is not None and across is not None and across != friction and not is_simulated:
        findings.info(
            "W136",
            f"friction by direction is not simulated: mu1 = {friction:g} applies in all directions",
            element.origin,
        )
    stiffness = _number(element, ("kp",), "stiffness", findings)
    damping = _number(element, ("kd",), "damping", findings)
    gravity = _truth(element, ("gravity",), surface.gravity) and not _truth(
        element, ("turnGravityOff",), default=False
    )
    friction = surface.friction if friction is None else friction
    return ContactSurface(
        friction,
        friction if across is None else across,
        direction or surface.direction,
        collides,
        gravity,
        stiffness or surface.stiffness,
        surface.damping if damping is None else damping,
    )


def _number(
    element: Element, tags: tuple[str, ...], what: str, findings: DiagnosticCollector
) -> float | None:
    """A number of at least 0. None if it is not given, or is not such a number (reported as W130)."""
    child = next((found for tag in tags if (found := element.find(tag)) is not None), None)
    if child is None:
        return None
    # Gazebo accepts the value as text and as an attribute
    written = child.attributes.get("value", child.text).strip()
    try:
        value = to_float(written)
    except ValueError:
        value = -1.0
    if isfinite(value) and value >= 0.0:
        return value
    message = f"<{child.tag}> must be a {what}, not '{written}'"
    findings.warning("W130", message, child.origin, "KBot ignores the value")
    return None


def _direction(element: Element) -> tuple[float, float, float] | None:
    """The vector in `<fdir1>`. None if it is not given, is 0, or is not three numbers."""
    child = element.find("fdir1")
    words = child.attributes.get("value", child.text).split() if child is not None else []
    try:
        x, y, z = (to_float(word) for word in words)
    except ValueError:
        return None
    return (x, y, z) if 0.0 < hypot(x, y, z) < inf else None


def _truth(element: Element, names: tuple[str, ...], default: bool) -> bool:
    for name in names:
        child = element.find(name)
        if child is not None:
            return child.attributes.get("value", child.text).strip().lower() in ("1", "true")
    return default
