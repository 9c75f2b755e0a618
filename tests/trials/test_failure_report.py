"""Reports about failed runs: the table of the last seconds, and the picture."""

from __future__ import annotations

import io
import math

import numpy as np
from PIL import Image

from kbot.render.path_plot import TRUTH
from kbot.trials.failure_report import last_seconds, path_picture
from kbot.trials.quantities import QUANTITIES
from kbot.trials.results import TrialResult
from kbot.trials.trace import Event, Trace
from kbot.world import load_world


def trace_of(times: list[float], **columns: list[float]) -> Trace:
    every = {name: np.zeros(len(times)) for name in QUANTITIES}
    every |= {name: np.array(values) for name, values in columns.items()}
    return Trace(
        every | {"time": np.array(times)}, {}, {}, (Event(1.0, "early"), Event(8.5, "touches 'box'"))
    )


def test_the_table_has_six_times_of_the_last_three_seconds_and_their_events() -> None:
    times = [0.1 * step for step in range(101)]
    table = last_seconds(trace_of(times, x=[2.0 * time for time in times])).splitlines()
    assert table[0].split() == ["time", "[s]", "7.00", "7.60", "8.20", "8.80", "9.40", "10.00"]
    assert table[1].split() == ["x", "[m]", *(f"{2.0 * t:.4f}" for t in (7.0, 7.6, 8.2, 8.8, 9.4, 10.0))]
    assert table[-1] == "8.50 s: touches 'box'"
    assert all(len(line) <= 80 for line in table)


def test_a_run_that_was_reset_shows_what_came_after() -> None:
    table = last_seconds(trace_of([8.0, 9.0, 0.0, 0.1, 0.2], x=[1.0, 2.0, 3.0, 4.0, 5.0])).splitlines()
    assert table[0].split()[2:] == ["0.00", "0.10", "0.20"]
    assert table[1].split()[2:] == ["3.0000", "4.0000", "5.0000"]


def test_a_picture_shows_the_path_up_to_a_divergence() -> None:
    trace = trace_of([0.0, 0.1, 0.2], x=[0.0, 0.1, math.nan])
    picture = Image.open(
        io.BytesIO(path_picture(TrialResult("diverged", 0, trace=trace), load_world("rooms")))
    )
    assert TRUTH in {colour for _, colour in picture.convert("RGB").getcolors(1 << 24) or ()}
