"""The measures of a run: one number each, computed from its trace.

A package adds measures with the entry point group `kbot.measures`: each entry is a `Measure`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache
from importlib.metadata import entry_points

import numpy as np

from kbot.text import KbotError
from kbot.text.suggest import suggest_or_list
from kbot.trials.trace import RATE, Array, Trace

MILLIMETRE, TENTH_DEGREE = 0.001, math.radians(0.1)
PERCENT = 0.01
REST_SPEED = 0.005
"""Speed in m/s, and in rad/s times 10, below which a robot rests: half a centimetre a second."""
REST_TIME = 0.5
"""Seconds at the end of a run over which the forces of support are averaged."""


@dataclass(frozen=True, slots=True)
class Measure:
    """A number that describes a run.

    name         letters, digits and `_`; after a `/`, the link or joint
    unit         SI, empty for a count or a share
    description  one line
    compute      the value for a trace, NaN if the run does not show it
    floor        the smallest change, in the unit, that counts in a comparison of two robots
    relative     the smallest change as a share of the value; the larger of the two counts
    """

    name: str
    unit: str
    description: str
    compute: Callable[[Trace], float]
    floor: float
    relative: float = PERCENT


@dataclass(frozen=True, slots=True)
class Family:
    """Measures for each link or joint, such as `support/left_wheel`. `parts` lists those of a trace."""

    name: str
    unit: str
    description: str
    compute: Callable[[Trace, str], float]
    parts: Callable[[Trace], Iterable[str]]
    floor: float
    relative: float = PERCENT

    def of(self, part: str) -> Measure:
        return Measure(
            f"{self.name}/{part}",
            self.unit,
            self.description,
            lambda trace: self.compute(trace, part),
            self.floor,
            self.relative,
        )


def _final(quantity: str) -> Callable[[Trace], float]:
    return lambda trace: float(trace[quantity][-1])


def _largest(quantity: str) -> Callable[[Trace], float]:
    return lambda trace: float(np.abs(trace[quantity]).max())


def _smallest(quantity: str) -> Callable[[Trace], float]:
    return lambda trace: float(trace[quantity].min())


def _odometry_turn(trace: Trace) -> float:
    return float(trace["odometry_yaw"][-1] - trace["yaw"][-1])


def _odometry_distance(trace: Trace) -> float:
    return float(np.hypot(np.diff(trace["odometry_x"]), np.diff(trace["odometry_y"])).sum())


def _slip(trace: Trace) -> float:
    """The share of the way by odometry that the robot did not move.

    At least -1, which means that it moved twice as far or more: it was pushed.
    """
    way = _odometry_distance(trace)
    return max(-1.0, 1.0 - float(trace["distance"][-1]) / way) if way > 0.01 else math.nan


def _largest_acceleration(trace: Trace) -> float:
    """Over 0.1 s: the differences of single samples are mostly noise of the contacts."""
    speed, span = trace["speed"], round(0.1 * RATE)
    if len(speed) <= span:
        return 0.0
    return float(np.abs(speed[span:] - speed[:-span]).max() * RATE / span)


def _is_moving(trace: Trace) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    moving: np.ndarray[tuple[int], np.dtype[np.bool_]] = (trace["speed"] > REST_SPEED) | (
        np.abs(trace["turn_rate"]) > 10.0 * REST_SPEED
    )
    return moving


def _settling_time(trace: Trace) -> float:
    """Seconds from the last step of the scenario until the robot rests for good. NaN if it never does."""
    moving = np.flatnonzero(_is_moving(trace))
    if not len(moving):
        return 0.0
    if moving[-1] == len(trace) - 1:
        return math.nan
    return max(0.0, float(trace["time"][moving[-1] + 1]) - trace.last_step)


def _stopping_distance(trace: Trace) -> float:
    """Way in m after the last step of the scenario."""
    at = int(np.searchsorted(trace["time"], trace.last_step - 0.5 / RATE))
    return float(trace["distance"][-1] - trace["distance"][min(at, len(trace) - 1)])


def _forward_agreement(trace: Trace) -> float:
    return _agreement(trace["command_linear"], _moved(trace)[0])


def _lateral_agreement(trace: Trace) -> float:
    return _agreement(trace["command_lateral"], _moved(trace)[1])


def _turn_agreement(trace: Trace) -> float:
    return _agreement(trace["command_angular"], trace["turn_rate"][1:])


def _moved(trace: Trace) -> tuple[Array, Array]:
    """The motion forwards and to the left between samples, in m, (n - 1,) each."""
    x, y, yaw = np.diff(trace["x"]), np.diff(trace["y"]), trace["yaw"][1:]
    return np.cos(yaw) * x + np.sin(yaw) * y, np.cos(yaw) * y - np.sin(yaw) * x


def _agreement(command: Array, motion: Array) -> float:
    """The share of a motion in the commanded direction, minus the share against it: from 1 to -1.

    `command` is (n,): a sample has the command of the time before it. `motion` is (n - 1,). Motion without a
    command does not count. NaN if nothing is commanded, or nothing moves.
    """
    senses = np.sign(command[1:])
    is_commanded = np.abs(senses) > 0.0  # a recording does not show commands: they are NaN there
    way = float(np.abs(motion[is_commanded]).sum())
    return float((senses * motion)[is_commanded].sum()) / way if way > 0.0 else math.nan


def _goal_time(trace: Trace) -> float:
    reached = trace["goals_reached"]
    if not reached[-1] > 0.0:
        return math.nan
    return float(trace["time"][np.flatnonzero(reached == reached[-1])[0]])


def _joint_overshoot(trace: Trace) -> float:
    """The largest distance of a joint beyond its limits, 0 within them."""
    beyond = [0.0]
    for joint, (low, high) in trace.joint_limits.items():
        positions = trace.joints[joint]
        beyond.append(max(low - float(positions.min()), float(positions.max()) - high))
    return max(beyond)


def _support(trace: Trace, link: str) -> float:
    forces = trace.support.get(link)
    return math.nan if forces is None else float(forces[-round(REST_TIME * RATE) :].mean())


def _joint_travel(trace: Trace, joint: str) -> float:
    positions = trace.joints.get(joint)
    return math.nan if positions is None else float(np.abs(np.diff(positions)).sum())


_BUILT_IN: tuple[Measure, ...] = (
    Measure("final_x", "m", "true x at the end", _final("x"), MILLIMETRE),
    Measure("final_y", "m", "true y at the end", _final("y"), MILLIMETRE),
    Measure("final_z", "m", "true height of the base's origin at the end", _final("z"), MILLIMETRE),
    Measure("final_yaw", "rad", "true heading at the end, counting full turns", _final("yaw"), TENTH_DEGREE),
    Measure("final_roll", "rad", "roll at the end", _final("roll"), TENTH_DEGREE),
    Measure(
        "final_pitch", "rad", "pitch at the end, positive if the front is low", _final("pitch"), TENTH_DEGREE
    ),
    Measure(
        "final_forward", "m", "displacement along the heading at the start", _final("forward"), MILLIMETRE
    ),
    Measure(
        "final_left", "m", "displacement to the left of the heading at the start", _final("left"), MILLIMETRE
    ),
    Measure("final_turn", "rad", "change of the heading, counting full turns", _final("turn"), TENTH_DEGREE),
    Measure(
        "max_left",
        "m",
        "largest distance from the line along the heading at the start",
        _largest("left"),
        MILLIMETRE,
    ),
    Measure("final_up", "m", "rise of the base's origin since the start", _final("up"), MILLIMETRE),
    Measure("path_length", "m", "length of the true path", _final("distance"), MILLIMETRE),
    Measure(
        "forward_agreement",
        "",
        "share of the motion forwards and backwards in the commanded direction, minus the share against it",
        _forward_agreement,
        0.05,
    ),
    Measure(
        "lateral_agreement",
        "",
        "share of the sideways motion in the commanded direction, minus the share against it",
        _lateral_agreement,
        0.05,
    ),
    Measure(
        "turn_agreement",
        "",
        "share of the turns in the commanded direction, minus the share against it",
        _turn_agreement,
        0.05,
    ),
    Measure("max_speed", "m/s", "highest speed over the ground", _largest("speed"), 0.005),
    Measure("max_turn_rate", "rad/s", "highest turning speed", _largest("turn_rate"), 0.01),
    Measure(
        "max_acceleration", "m/s^2", "largest change of speed over 0.1 s", _largest_acceleration, 0.05, 0.05
    ),
    Measure(
        "odometry_error",
        "m",
        "distance between the true position and that of odometry at the end",
        _final("odometry_error"),
        MILLIMETRE,
    ),
    Measure(
        "max_odometry_error",
        "m",
        "largest distance between the true position and that of odometry",
        _largest("odometry_error"),
        MILLIMETRE,
    ),
    Measure(
        "odometry_turn_error",
        "rad",
        "heading of odometry minus the true one at the end",
        _odometry_turn,
        TENTH_DEGREE,
    ),
    Measure("odometry_path_length", "m", "length of the path by odometry", _odometry_distance, MILLIMETRE),
    Measure("slip", "", "share of the way by odometry that the robot did not move, at least -1", _slip, 0.01),
    Measure("max_tilt", "rad", "largest angle to the vertical", _largest("tilt"), math.radians(0.5), 0.05),
    Measure("max_effort", "N m", "largest effort of a driving joint", _largest("effort"), 0.01, 0.05),
    Measure(
        "energy",
        "J",
        "mechanical work of the driving joints, without what braking returns",
        _final("energy"),
        0.01,
        0.02,
    ),
    Measure("contacts", "", "number of objects and other robots touched", _final("touched"), 0.5),
    Measure(
        "clearance",
        "m",
        "smallest distance to an object other than the ground, at most 10 m",
        _smallest("clearance"),
        0.005,
    ),
    Measure(
        "settling_time",
        "s",
        "time from the last step of the scenario until the robot rests",
        _settling_time,
        0.05,
        0.05,
    ),
    Measure(
        "stopping_distance",
        "m",
        "way after the last step of the scenario",
        _stopping_distance,
        MILLIMETRE,
        0.02,
    ),
    Measure("goals_reached", "", "number of goals reached", _final("goals_reached"), 0.5),
    Measure("goal_time", "s", "time at which the last goal was reached", _goal_time, 0.1, 0.02),
    Measure(
        "joint_overshoot",
        "rad",
        "largest distance of a joint beyond its limits (m for prismatic joints)",
        _joint_overshoot,
        0.001,
    ),
)
_FAMILIES: tuple[Family, ...] = (
    Family(
        "support",
        "N",
        "vertical force that carries a link, averaged over the last 0.5 s",
        _support,
        lambda trace: trace.support,
        0.05,
    ),
    Family(
        "joint_travel",
        "rad",
        "way that a joint turned, both directions added (m for prismatic joints)",
        _joint_travel,
        lambda trace: trace.joints,
        0.01,
    ),
)
FAMILIES = {family.name: family for family in _FAMILIES}


@cache
def measures() -> dict[str, Measure]:
    """The measures by name: built in, then those of installed packages. Families are in `FAMILIES`."""
    found = {measure.name: measure for measure in _BUILT_IN}
    for entry in entry_points(group="kbot.measures"):
        measure = entry.load()
        if not isinstance(measure, Measure):
            raise KbotError(f"the entry point '{entry.name}' of kbot.measures is not a Measure")
        found.setdefault(measure.name, measure)
    return found


def measure_names() -> list[str]:
    """The names of all measures, with `NAME` in place of a link or joint."""
    return [*measures(), *(f"{family}/NAME" for family in FAMILIES)]


def is_measure(name: str) -> bool:
    """Whether a measure has this name."""
    family, _, part = name.partition("/")
    return name in measures() or bool(part and family in FAMILIES)


def find_measure(name: str) -> Measure:
    """The measure of a name. Raises KbotError for an unknown name, with the nearest ones."""
    family, _, part = name.partition("/")
    if part and family in FAMILIES:
        return FAMILIES[family].of(part)
    if name not in measures():
        raise KbotError(f"unknown measure '{name}': {suggest_or_list(name, measure_names())}")
    return measures()[name]


def all_measures(trace: Trace) -> list[Measure]:
    """Every measure that a trace has, those of links and joints included."""
    of_parts = [family.of(part) for family in _FAMILIES for part in family.parts(trace)]
    return [*measures().values(), *of_parts]
