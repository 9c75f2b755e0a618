"""The plots over time that show why a measure is out of bounds."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kbot.render.plot import Bound, Curve, plot_svg
from kbot.trials.measures import REST_TIME
from kbot.trials.quantities import QUANTITIES
from kbot.trials.results import MeasureResult, TrialResult, with_unit
from kbot.trials.surroundings import Target
from kbot.trials.trace import Trace

Array = NDArray[np.float64]

WIDTH, HEIGHT = 560, 230
_MOST_POINTS = 600
"""Points of a curve: more than a plot has columns of pixels."""

QUANTITIES_OF: dict[str, tuple[str, ...]] = {
    "final_x": ("x", "odometry_x"),
    "final_y": ("y", "odometry_y"),
    "final_z": ("z",),
    "final_yaw": ("yaw", "odometry_yaw"),
    "final_roll": ("roll",),
    "final_pitch": ("pitch",),
    "final_forward": ("forward",),
    "final_left": ("left",),
    "final_turn": ("turn",),
    "max_left": ("left",),
    "final_up": ("up",),
    "path_length": ("distance",),
    "forward_agreement": ("forward", "command_linear"),
    "lateral_agreement": ("left", "command_lateral"),
    "turn_agreement": ("turn_rate", "command_angular"),
    "max_speed": ("speed", "command_linear"),
    "max_turn_rate": ("turn_rate", "command_angular"),
    "max_acceleration": ("speed", "command_linear"),
    "odometry_error": ("odometry_error",),
    "max_odometry_error": ("odometry_error",),
    "odometry_turn_error": ("yaw", "odometry_yaw"),
    "odometry_path_length": ("distance",),
    "slip": ("speed", "command_linear"),
    "max_tilt": ("tilt",),
    "max_effort": ("effort",),
    "energy": ("energy",),
    "contacts": ("touched",),
    "clearance": ("clearance",),
    "settling_time": ("speed", "turn_rate"),
    "stopping_distance": ("distance",),
    "goals_reached": ("goals_reached",),
    "goal_time": ("goals_reached",),
    "heading_to_target": ("yaw", "odometry_yaw"),
}
"""The quantities that show a measure over time. The first one is what the bound applies to."""
_LONGEST_LABEL = 60
_END_SHARE = 0.03
"""The part of a plot in which the bound of a value at the end is shaded."""
_DEFAULT = ("speed", "command_linear")
"""For measures of other packages, and for checks in Python."""
_OF_MAGNITUDE = ("max_left", "max_turn_rate")
"""Measures of the magnitude of a quantity that has a sign. The bound applies to both signs."""
_WITHOUT_LEVEL = (
    "forward_agreement",
    "lateral_agreement",
    "turn_agreement",
    "max_acceleration",
    "odometry_turn_error",
    "odometry_path_length",
    "slip",
    "heading_to_target",
)
"""Measures whose bound is not a value of their quantities."""


@dataclass(frozen=True)
class Chart:
    """A plot: a title, and its SVG in the colours of the page that contains it."""

    title: str
    svg: str


def charts(result: TrialResult, measures: Sequence[MeasureResult]) -> Iterator[Chart]:
    """Yield a plot for each measure that the trace of a result can show.

    Labels have at most `_LONGEST_LABEL` characters: a stranger's link may have any name.
    """
    trace = result.trace
    if trace is None or len(trace) < 2:
        return
    for measure in measures:
        curves = _curves(measure, trace, result.surroundings.targets if result.surroundings else ())
        if not curves:
            continue
        # what is worst is shown against all of the time, and each curve keeps its peaks
        kept = _kept(trace["time"], [values for _, values in curves])
        drawn = [Curve(label[:_LONGEST_LABEL], _plain(values[kept])) for label, values in curves]
        bounds = list(_bounds(measure, trace, curves))
        svg = plot_svg(trace["time"][kept].tolist(), drawn, WIDTH, HEIGHT, None, bounds)
        yield Chart(measure.name, svg)


def _curves(measure: MeasureResult, trace: Trace, targets: Sequence[Target]) -> list[tuple[str, Array]]:
    """The labels and values that show a measure."""
    family, _, part = measure.name.partition("/")
    if family == "support":
        return [(f"{part} [N]", trace.support[part])] if part in trace.support else []
    if family == "joint_travel":
        return [(f"{part} [rad]", trace.joints[part])] if part in trace.joints else []
    if measure.name == "joint_overshoot":
        return [(f"{joint} [rad]", trace.joints[joint]) for joint in list(trace.joint_limits)[:6]]
    if measure.name in ("distance_to_target", "arrival_time"):
        reached = [target for target in targets if target.kind == "reach"]
        return [
            (f"to {t.x:g}, {t.y:g} [m]", np.hypot(trace["x"] - t.x, trace["y"] - t.y)) for t in reached[:3]
        ]
    if measure.name.startswith("distance_from_path("):
        place = next((t for t in targets if measure.name == f"distance_from_path({t.x:g},{t.y:g})"), None)
        if place is None:
            return []
        return [(f"to {place.x:g}, {place.y:g} [m]", np.hypot(trace["x"] - place.x, trace["y"] - place.y))]
    names = QUANTITIES_OF.get(measure.name, _DEFAULT)
    return [(_label(name), trace[name]) for name in names if np.isfinite(trace[name]).any()]


def _label(name: str) -> str:
    unit = QUANTITIES[name].unit
    return f"{name} [{unit}]" if unit else name


def _bounds(measure: MeasureResult, trace: Trace, curves: Sequence[tuple[str, Array]]) -> Iterator[Bound]:
    is_time = measure.unit == "s"
    name = measure.name
    if name not in QUANTITIES_OF and "/" not in name and not name.startswith("distance_") and not is_time:
        return
    if name in _WITHOUT_LEVEL or name.startswith(("joint_travel", "joint_overshoot")):
        return
    offset = 0.0
    if name == "settling_time":
        offset = trace.last_step
    elif name == "stopping_distance":
        at = int(np.searchsorted(trace["time"], trace.last_step - 1e-9))
        offset = float(curves[0][1][min(at, len(trace) - 1)])
    since = _since(measure.name, trace)
    for value, is_above, word in ((measure.max, True, "at most"), (measure.min, False, "at least")):
        if value is None or not math.isfinite(value):
            continue
        label = f"{word} {with_unit(value, measure.unit)}"
        # a highest value may be below its lower bound most of the time
        is_reference = (name.startswith("max_") and not is_above) or (name == "clearance" and is_above)
        yield Bound(value + offset, label, is_above, is_time, None if is_reference else since)
        if name in _OF_MAGNITUDE and is_above:
            yield Bound(-value, "", is_above=False)  # the label of the other sign is near


def _since(name: str, trace: Trace) -> float:
    """The time from which a bound counts: from the start, or for the values at the end the last few percent
    of the plot, so that it can be seen."""
    if name.startswith(("max_", "clearance", "contacts", "energy")):
        return -math.inf
    begin, end = float(trace["time"].min()), float(trace["time"].max())
    return end - (REST_TIME if name.startswith("support/") else _END_SHARE * (end - begin))


def _kept(time: Array, curves: Sequence[Array]) -> NDArray[np.int_]:
    """The samples that a plot needs: those with the lowest and highest values of each short span of time."""
    count = len(time)
    if count <= _MOST_POINTS:
        return np.arange(count)
    edges = np.linspace(0, count, _MOST_POINTS // (2 * len(curves)) + 1).astype(int)
    found = {0, count - 1}
    for values in curves:
        known = np.where(np.isfinite(values), values, 0.0)
        for first, end in itertools.pairwise(edges.tolist()):
            found.add(first + int(known[first:end].argmin()))
            found.add(first + int(known[first:end].argmax()))
    return np.array(sorted(found))


def _plain(values: Array) -> list[float | None]:
    """Values without differences of less than 1e-6, which only show that a robot at rest still settles."""
    return [value if math.isfinite(value) else None for value in values.round(6).tolist()]
