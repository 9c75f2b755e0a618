"""What a scenario expects of a run. Each expectation gives measures with bounds.

In YAML, an expectation is written under its name: `reaches: {x: 2, y: 0, within: 0.05}`. A bound on a
measure is written under the measure's name: `max_tilt: {max: 0.2}`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from kbot.kinematics.angles import wrap_all
from kbot.text import KbotError
from kbot.text.suggest import suggest_or_list
from kbot.trials.measures import FAMILIES, find_measure
from kbot.trials.results import MeasureResult
from kbot.trials.trace import Trace


@runtime_checkable
class Expectation(Protocol):
    """What is expected of a run."""

    def results(self, trace: Trace) -> tuple[MeasureResult, ...]:
        """The measures of a run, with their bounds."""
        ...


@dataclass(frozen=True, slots=True)
class Bound:
    """A measure is within bounds, in its unit.

    measure  its name
    min      lowest value
    max      highest value
    """

    measure: str
    min: float | None = None
    max: float | None = None

    def __post_init__(self) -> None:
        find_measure(self.measure)
        if self.min is None and self.max is None:
            raise KbotError(f"'{self.measure}' needs a bound: min, max, or both")
        if self.min is not None and self.max is not None and self.min > self.max:
            raise KbotError(
                f"the bounds of '{self.measure}' exclude every value: {self.min:g} > {self.max:g}"
            )

    def results(self, trace: Trace) -> tuple[MeasureResult, ...]:
        measure = find_measure(self.measure)
        detail = ", ".join(trace.touched) if self.measure == "contacts" else ""
        family, _, part = self.measure.partition("/")
        if part and family in FAMILIES and part not in (known := FAMILIES[family].parts(trace)):
            detail = suggest_or_list(part, known)
        if self.measure in ("goals_reached", "goal_time"):
            detail = "; ".join(event.text for event in trace.events if event.kind == "goal")
        value = measure.compute(trace)
        return (MeasureResult(measure.name, value, measure.unit, self.min, self.max, detail),)


@dataclass(frozen=True, slots=True)
class Reaches:
    """At the end, the robot is at a place in the world.

    x           x of the place in m
    y           y of the place in m
    within      largest distance to the place in m
    yaw         heading in rad; by default any
    yaw_within  largest difference to the heading in rad
    before      time in s from which it is there and stays; by default any
    """

    x: float
    y: float
    within: float
    yaw: float | None = None
    yaw_within: float = 0.1
    before: float | None = None

    def __post_init__(self) -> None:
        _require_positive("within", self.within)
        _require_positive("yaw_within", self.yaw_within)

    def results(self, trace: Trace) -> tuple[MeasureResult, ...]:
        apart = np.hypot(trace["x"] - self.x, trace["y"] - self.y)
        end = f"it ends at {_metres(trace['x'][-1])}, {_metres(trace['y'][-1])}"
        found = [MeasureResult("distance_to_target", float(apart[-1]), "m", None, self.within, end)]
        is_there = apart <= self.within
        if self.yaw is not None:
            off = np.abs(wrap_all(trace["yaw"] - self.yaw))
            found.append(MeasureResult("heading_to_target", float(off[-1]), "rad", None, self.yaw_within))
            is_there &= off <= self.yaw_within
        if self.before is not None:
            away = np.flatnonzero(~is_there)
            last = int(away[-1]) if len(away) else -1
            arrived = float(trace["time"][last + 1]) if last + 1 < len(trace) else math.nan
            found.append(MeasureResult("arrival_time", arrived, "s", None, self.before))
        return tuple(found)


@dataclass(frozen=True, slots=True)
class PassesThrough:
    """At some time, the robot's base is at a place in the world.

    x       x of the place in m
    y       y of the place in m
    within  largest distance to the place in m
    """

    x: float
    y: float
    within: float

    def __post_init__(self) -> None:
        _require_positive("within", self.within)

    def results(self, trace: Trace) -> tuple[MeasureResult, ...]:
        nearest = float(np.hypot(trace["x"] - self.x, trace["y"] - self.y).min())
        name = f"distance_from_path({self.x:g},{self.y:g})"
        return (MeasureResult(name, nearest, "m", None, self.within),)


@dataclass(frozen=True, slots=True)
class NeverTouches:
    """The robot touches no object.

    objects  their names; by default everything but the ground
    """

    objects: tuple[str, ...] = ()

    def results(self, trace: Trace) -> tuple[MeasureResult, ...]:
        touched = [name for name in trace.touched if not self.objects or name in self.objects]
        return (MeasureResult("contacts", float(len(touched)), "", None, 0.0, ", ".join(touched)),)


@dataclass(frozen=True, slots=True)
class StaysUpright:
    """The robot does not tilt far.

    max_tilt  largest angle between the base's z axis and the vertical in rad
    """

    max_tilt: float = math.radians(30.0)

    def results(self, trace: Trace) -> tuple[MeasureResult, ...]:
        return Bound("max_tilt", max=self.max_tilt).results(trace)


@dataclass(frozen=True, slots=True)
class Settles:
    """The robot comes to rest, and rests until the end.

    within  longest time in s since the scenario's last step began
    """

    within: float

    def __post_init__(self) -> None:
        _require_positive("within", self.within)

    def results(self, trace: Trace) -> tuple[MeasureResult, ...]:
        return Bound("settling_time", max=self.within).results(trace)


@dataclass(frozen=True)
class Check:
    """A function of the trace that returns a number with bounds, for scenarios in Python."""

    name: str
    compute: Callable[[Trace], float]
    min: float | None = None
    max: float | None = None
    unit: str = ""

    def results(self, trace: Trace) -> tuple[MeasureResult, ...]:
        return (MeasureResult(self.name, float(self.compute(trace)), self.unit, self.min, self.max),)


def _require_positive(name: str, value: float) -> None:
    if not value > 0.0:
        raise KbotError(f"'{name}' must be above 0, not {value}")


def _metres(value: float) -> str:
    return f"{round(value, 3) + 0.0:g}"  # + 0.0 turns -0.0 into 0.0
