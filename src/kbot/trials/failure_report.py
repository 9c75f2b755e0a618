"""What a report about a failed run shows: the last seconds of its values, its findings, and a picture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kbot.kinematics.planar_pose import PlanarPose
from kbot.render.path_plot import draw
from kbot.text import KbotError
from kbot.text.render import place, render_text
from kbot.trials.quantities import QUANTITIES
from kbot.trials.results import TrialResult
from kbot.trials.trace import Trace
from kbot.world import World

LAST = 3.0
"""Seconds before the end of a run whose values are shown."""
_COLUMNS = 6
"""Times in the table: with the names of the quantities, it fits into 80 columns."""
_SHOWN = (
    "x",
    "y",
    "yaw",
    "speed",
    "turn_rate",
    "tilt",
    "odometry_error",
    "command_linear",
    "command_angular",
)


def sections(result: TrialResult) -> list[tuple[str, str]]:
    """Titles and texts about a run."""
    found = []
    if result.trace is not None:
        found.append(("KBot: the last seconds of the run", last_seconds(result.trace)))
    if result.findings:
        found.append(("KBot: findings about the run", render_text(result.findings)))
    if result.source_lines:
        lines = (f"{place(line.origin)}: {line.message}" for line in result.source_lines)
        found.append(("KBot: lines that the failure concerns", "\n".join(lines)))
    return found


def path_picture(result: TrialResult, world: World) -> bytes:
    """A PNG of the driven path, seen from above. It needs no display and no OpenGL."""
    trace = result.trace
    if trace is None:
        raise KbotError(f"the run of {result.title} was not sampled")
    truth = _poses(trace, "x", "y", "yaw")
    odometry = _poses(trace, "odometry_x", "odometry_y", "odometry_yaw")
    return draw(truth, odometry, world, f"{result.title}, {trace['time'][-1]:.2f} s")


def last_seconds(trace: Trace) -> str:
    """A table of the last `LAST` seconds of a run, and the touches and steps within them."""
    time = trace["time"]
    resets = np.flatnonzero(np.diff(time) < 0.0)
    first = int(resets[-1]) + 1 if len(resets) else 0
    begin = max(float(time[first]), float(time[-1]) - LAST)
    wanted = np.linspace(begin, float(time[-1]), _COLUMNS)
    rows = sorted({first + int(np.abs(time[first:] - at).argmin()) for at in wanted})
    lines = [_line("time", "s", [f"{time[row]:.2f}" for row in rows])]
    for name in _SHOWN:
        values = [f"{round(float(trace[name][row]), 4) + 0.0:.4f}" for row in rows]  # + 0.0: no -0.0000
        lines.append(_line(name, QUANTITIES[name].unit, values))
    lines += [f"{event.time:.2f} s: {event.text}" for event in trace.events if event.time >= begin]
    return "\n".join(lines)


def _line(name: str, unit: str, values: Sequence[str]) -> str:
    return f"{f'{name} [{unit}]':24}" + "".join(f"{value:>9}" for value in values)


def _poses(trace: Trace, x: str, y: str, yaw: str) -> list[PlanarPose]:
    return [PlanarPose(*row) for row in trace.until_divergence(x, y, yaw).tolist()]
