"""Findings about where a robot starts: inside an object, in the ground, or without ground below it."""

from __future__ import annotations

from math import hypot

import mujoco

from kbot.sim.divergence import ELSEWHERE
from kbot.sim.engine.assembly import Assembly
from kbot.sim.engine.geometry import own_geometries
from kbot.sim.engine.placing import bottom
from kbot.sim.preparation import Prepared
from kbot.text import Diagnostic, Related, Severity
from kbot.world import World
from kbot.world.footprints import footprint
from kbot.world.ground import STEP, Surfaces, middle_of_ground
from kbot.world.world import FURTHEST, Body, Box, HeightField, Part, Plane

START_CODES = frozenset({"W111", "W115"})
"""The codes of these findings."""
_CARRIES = 0.01
"""Metres above the robot's lowest point up to which a shape can carry it, as in D115."""
_DROP = 0.2
"""Metres above the ground from which a start is reported. A robot is placed above the highest terrain within
0.3 m of it, which on a slope of 30 degrees, the steepest that is drivable, is 0.17 m higher."""
_AT_ZERO = (
    "KBot starts robots at z = 0, or on terrain: put the surface of the ground there, or choose another start"
)
_GROUND = (
    "include a ground: <include><uri>model://ground_plane</uri></include>, or a <collision> with a <plane>"
)


def starts_inside(
    world: World, robot: str, inside: str, moved: tuple[float, float] | None
) -> tuple[Diagnostic, ...]:
    """W111 of a robot that overlaps the body `inside`, which may be empty. `moved` is where it starts
    instead, in m."""
    if not inside:
        return ()
    where = "at the start" if moved is None else f"at 0, 0. It starts at {moved[0]:.2f}, {moved[1]:.2f} m"
    text = f"robot '{robot}' overlaps '{inside}' of the world {where}"
    origin = next((body.origin for body in world.bodies if body.name == inside), None)
    return (Diagnostic("W111", Severity.WARNING, text, origin, ELSEWHERE),)


def without_ground(world: World, robot: str, prepared: Prepared, assembly: Assembly) -> Diagnostic | None:
    """W115 of a robot whose wheels and casters start in the ground, or have none below them.

    As in Gazebo, the plane of a <collision> is infinite, and a <visual> carries nothing (sdformat,
    plane_shape.sdf and link.sdf).
    """
    model, data = assembly.model, mujoco.MjData(assembly.model)
    root = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, prepared.plan.prefix)
    if root < 0 or world.gravity[2] >= 0.0:
        return None  # it is fixed to the world, or does not fall
    mujoco.mj_kinematics(model, data)
    bottoms = {
        geom: bottom(model, data, geom)
        for geom in own_geometries(model, robot).tolist()
        if model.geom_contype[geom] or model.geom_conaffinity[geom]
    }
    if not bottoms:
        return None  # W304: no link has a <collision>
    lowest = min(bottoms.values())
    points = [data.geom_xpos[geom, :2].tolist() for geom, z in bottoms.items() if z < lowest + _CARRIES]
    surfaces = Surfaces(world)
    sunk = [found for x, y in points for found in _around(surfaces, x, y, lowest)]
    if sunk:
        return _in_ground(robot, max(sunk, key=_height), lowest)
    below = [_below(surfaces, x, y, lowest) for x, y in points]
    if all(below):
        return _too_high(robot, [_nearest(found, lowest) for found in below], lowest)
    x, y, _ = prepared.plan.pose.translation.tolist()
    where = f"robot '{robot}' starts at {x:.4g}, {y:.4g}"
    middles = sorted(middle_of_ground(world, lowest + STEP), key=lambda at: hypot(at[1] - x, at[2] - y))
    if any(below):
        text = f"{where}, on the edge of the ground: only a part of its wheels and casters is above it"
        return Diagnostic("W115", Severity.WARNING, text, None, ELSEWHERE)
    if middles:
        body, at_x, at_y = middles[0]
        text = f"{where}, beside the ground: the nearest is '{body.name}' around {at_x:.4g}, {at_y:.4g}"
        return Diagnostic("W115", Severity.WARNING, text, None, ELSEWHERE)
    drawn = (each for px, py in points for each in surfaces.at(px, py, solid=False))
    seen = next((each for each in drawn if abs(each[2] - lowest) < _DROP), None)
    if seen is not None:
        body, part, _ = seen
        text = f"the ground '{body.name}' has a <visual> and no <collision>: robots fall through it"
        hint = "add a <collision> with the same <geometry>"
        return Diagnostic("W115", Severity.WARNING, text, part.origin or body.origin, hint)
    missing = [d for d in world.diagnostics if d.code == "W202" and d.origin is not None]
    related = tuple(Related(d.message, d.origin) for d in missing[:3] if d.origin is not None)
    hint = "the ground may be in a model that was not found (W202): add it" if related else _GROUND
    text = f"the world '{world.name}' has no ground: robots fall"
    return Diagnostic("W115", Severity.WARNING, text, world.origin, hint, related)


_Surface = tuple[Body, Part, float]


def _below(surfaces: Surfaces, x: float, y: float, height: float) -> list[_Surface]:
    """The surfaces that may carry a wheel at a point: the first one just below its lowest point, or else all
    of parts that reach below it."""
    found = []
    for surface in surfaces.at(x, y):
        if -_DROP <= surface[2] - height <= STEP:
            return [surface]
        if _reaches(surface, height + STEP):
            found.append(surface)
    return found


def _reaches(surface: _Surface, height: float) -> bool:
    """Whether a part reaches below a height in m: a roof does not."""
    body, part, _ = surface
    return isinstance(part.shape, Plane | HeightField) or (
        footprint(part.shape, body.pose @ part.pose, -FURTHEST, height) is not None
    )


def _nearest(surfaces: list[_Surface], height: float) -> _Surface:
    """The surface that carries a wheel whose lowest point is at a height: the highest that is not above it,
    or else the lowest of all."""
    below = [each for each in surfaces if each[2] <= height + STEP]
    return max(below, key=_height) if below else min(surfaces, key=_height)


def _height(surface: _Surface) -> float:
    return surface[2]


def _around(surfaces: Surfaces, x: float, y: float, height: float) -> list[_Surface]:
    """The surfaces of ground that has the point inside it, deeper than a wheel can drive onto."""
    return [
        each
        for each in surfaces.at(x, y, within=0.0)
        if each[1].ground
        and isinstance(each[1].shape, Plane | Box)
        and each[2] - height > STEP
        and _reaches(each, height + STEP)
    ]


def _in_ground(robot: str, surface: _Surface, lowest: float) -> Diagnostic:
    """W115 of a start in the ground. 15 mm throw the KBot robot 0.8 m high."""
    body, part, height = surface
    text = f"robot '{robot}' starts {height - lowest:.3g} m below the surface of the ground '{body.name}'"
    return Diagnostic("W115", Severity.WARNING, text, part.origin or body.origin, _AT_ZERO)


def _too_high(robot: str, surfaces: list[_Surface], lowest: float) -> Diagnostic | None:
    """W115 of a start far above the ground. Only the surfaces of these shapes are known exactly."""
    if not all(isinstance(part.shape, Plane | Box | HeightField) for _, part, _ in surfaces):
        return None
    body, part, height = max(surfaces, key=_height)
    if lowest - height <= _DROP:
        return None
    text = f"robot '{robot}' starts {lowest - height:.3g} m above the ground '{body.name}': it falls onto it"
    return Diagnostic("W115", Severity.WARNING, text, part.origin or body.origin, _AT_ZERO)
