"""Reports a simulation that diverged: the time, the link that flew off and the likely cause."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from kbot.model import Link, RobotModel
from kbot.sim.engine.engine import Engine
from kbot.text import DescriptionError, Diagnostic, Severity

ELSEWHERE = "start the robot somewhere else: kbot sim --pose X,Y,YAW, or start= in Python"
_PUSHED_OUT = 1.0
"""Seconds after the start within which contacts push a robot out of an object that it overlaps."""
_MASS_RATIO = 1000.0
"""Ratio of two masses of one robot above which the lighter one is the likely cause."""
_SMALL_RADIUS = 1e-3
"""Radius of gyration in m below which a moment of inertia is suspect."""


class SimulationDiverged(DescriptionError):
    """The simulation diverged. It can continue only after a reset."""


def diverged(
    engine: Engine, robots: Mapping[str, RobotModel], last: float, inside: str
) -> SimulationDiverged:
    """The error for a run that diverged after the time `last` (s), at the line of the link that flew off.

    `robots` are the descriptions by robot name. `inside` names the body that the first robot overlapped at
    the start, or is empty.
    """
    model, data = engine.model, engine.data
    speeds = np.where(np.isfinite(data.qvel), np.abs(data.qvel), np.inf)
    body = int(model.dof_bodyid[int(np.argmax(speeds))])
    name = model.body(body).name
    owner, _, link_name = name.partition("/")
    robot = robots.get(owner)
    when = f"between {last:.3f} s and {engine.time:.3f} s the simulation diverged"
    if robot is None or link_name not in robot.links:
        return SimulationDiverged([Diagnostic("W120", Severity.ERROR, f"{when}: '{name}' flew off")])
    link = robot.links[link_name]
    cause, hint = _cause(robot, link, model.opt.timestep)
    if inside and last < _PUSHED_OUT:
        cause, hint = f"the robot started inside '{inside}'", ELSEWHERE
    message = f"{when}: link '{link.name}' flew off; {cause}"
    return SimulationDiverged([Diagnostic("W120", Severity.ERROR, message, link.origin, hint)])


def engine_failed(error: Exception, time: float) -> SimulationDiverged:
    """The error for a step that the engine could not take, for example too many contacts for its memory."""
    reason = str(error).splitlines()[0]
    message = f"after {time:.3f} s the physics engine stopped: {reason}"
    hint = "reduce the number of objects that touch each other"
    return SimulationDiverged([Diagnostic("W120", Severity.ERROR, message, None, hint)])


def _cause(robot: RobotModel, link: Link, timestep: float) -> tuple[str, str]:
    masses = {n: x.inertial.mass for n, x in robot.links.items() if x.inertial and x.inertial.mass > 0}
    own = masses.get(link.name)
    heaviest = max(masses, key=masses.__getitem__, default=None)
    if own and heaviest and masses[heaviest] > _MASS_RATIO * own:
        ratio = masses[heaviest] / own
        return (
            f"its mass is {own:g} kg, and that of link '{heaviest}' is {ratio:.0f} times larger",
            "keep the masses within a factor of 1000 of each other",
        )
    if link.inertial is not None:
        moments = np.linalg.eigvalsh(link.inertial.tensor)
        if link.inertial.mass > 0 and math.sqrt(max(moments[0], 0) / link.inertial.mass) < _SMALL_RADIUS:
            return (
                f"its smallest moment of inertia is {moments[0]:.3g} kg m^2 for {link.inertial.mass:g} kg",
                "give it the inertia of its shape",
            )
    joint = robot.parent_joint.get(link.name)
    if joint is not None and joint.dynamics is not None and joint.dynamics.damping > 0:
        return (
            f"the damping of joint '{joint.name}' or the step of {timestep:g} s may be too large",
            "try a smaller step or less damping",
        )
    return f"the step of {timestep:g} s may be too large for it", "try a smaller step"
