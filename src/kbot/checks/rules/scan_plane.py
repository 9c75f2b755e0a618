"""What a flat lidar sees of the robot that carries it."""

from __future__ import annotations

import math
from collections.abc import Iterator

from kbot.checks.context import Context
from kbot.checks.facts.bodies import LinkShape
from kbot.checks.facts.rays import distance_along
from kbot.kinematics.drive.wheels import rigid_links
from kbot.kinematics.spatial import SpatialFrame, Vector, add, dot, norm, scale, subtract
from kbot.text import Element, Origin

_BEAMS = 360


def own_body(
    context: Context, link: str, sensor: Element, angles: tuple[float, float], ranges: tuple[float, float]
) -> tuple[str, float, float, Origin] | None:
    """What most beams hit of the robot: link, nearest distance (m), share of beams, place."""
    frame = context.frames[link]
    pose = sensor.find("pose")
    if pose is not None:
        try:
            x, y, z, *rpy = (float(v) for v in pose.text.split())
        except ValueError:
            return None
        if any(rpy):
            return None
        frame = SpatialFrame(frame.rotation, frame.point((x, y, z)))
    cut = _in_plane(context, frame, set(rigid_links(context.robot, link)))
    # each beam's nearest hit: distance, link, place
    nearest_hits: dict[int, tuple[float, str, Origin]] = {}
    for name, part, shape in cut:
        start = shape.local(frame.translation)
        ahead = shape.local_direction(frame.direction((1.0, 0.0, 0.0)))
        left = shape.local_direction(frame.direction((0.0, 1.0, 0.0)))
        reach = norm(part.half)
        if norm(start) - reach > ranges[1]:
            continue
        for i in _beams_towards(frame.local(shape.translation), reach, angles):
            angle = angles[0] + (angles[1] - angles[0]) * i / _BEAMS
            direction = add(scale(ahead, math.cos(angle)), scale(left, math.sin(angle)))
            t = distance_along(start, direction, part.geometry, part.half)
            if t is not None and ranges[0] < t < ranges[1]:
                known = nearest_hits.get(i)
                if known is None or t < known[0]:
                    nearest_hits[i] = (t, name, part.origin)
    hits: dict[str, tuple[int, float, Origin]] = {}
    for i in sorted(nearest_hits):
        distance, name, place = nearest_hits[i]
        count, nearest, origin = hits.get(name, (0, math.inf, place))
        hits[name] = (count + 1, min(nearest, distance), origin)
    if not hits:
        return None
    name, (count, nearest, origin) = max(hits.items(), key=lambda item: item[1][0])
    return (name, nearest, count / _BEAMS, origin) if count else None


def _beams_towards(center: Vector, reach: float, angles: tuple[float, float]) -> Iterator[int]:
    """The beams that may meet what lies within `reach` of a point of the lidar's frame."""
    away, step = math.hypot(center[0], center[1]), (angles[1] - angles[0]) / _BEAMS
    if away <= reach or not 0.0 < step <= 2.0 * math.pi / _BEAMS * 1.01:
        yield from range(_BEAMS)
        return
    half, bearing = math.asin(reach / away), math.atan2(center[1], center[0])
    for turn in (-2.0 * math.pi, 0.0, 2.0 * math.pi):
        first = math.ceil((bearing + turn - half - angles[0]) / step)
        last = math.floor((bearing + turn + half - angles[0]) / step)
        yield from range(max(first, 0), min(last, _BEAMS - 1) + 1)


def _in_plane(
    context: Context, frame: SpatialFrame, own: set[str]
) -> list[tuple[str, LinkShape, SpatialFrame]]:
    """The shapes of other links that the lidar's plane cuts, and where they stand in the root's frame."""
    up = frame.direction((0.0, 0.0, 1.0))
    cut = []
    for name, body in context.bodies.items():
        if name in own or name in context.unsure:
            continue
        link = context.frames[name]
        for part in body.collisions:
            height = dot(subtract(link.point(part.frame.translation), frame.translation), up)
            if abs(height) < part.support(link.local_direction(up)):
                cut.append((name, part, link.then(part.frame)))
    return cut
