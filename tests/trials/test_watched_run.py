"""A watched run is equal to one that is not watched, and its result describes it."""

from __future__ import annotations

from pathlib import Path

import pytest

from kbot.record.reader import Recording
from kbot.sim import Simulation
from kbot.trials.watched_run import WatchedRun


@pytest.mark.parametrize("film", [False, True])
def test_watching_does_not_change_a_run(tmp_path: Path, film: bool) -> None:
    expected, simulation = Simulation("kbot"), Simulation("kbot")
    recording = tmp_path / "run.mcap"
    run = WatchedRun(simulation, "circle", "empty", record=str(recording) if film else "", film=film)
    for each in (expected, simulation):
        each.cmd_vel(0.2, 0.5)
        each.run(3.03)
    result = run.result(film=film)
    run.close()
    assert result.state_sha256 == expected.state_sha256()
    assert result.trace is not None
    # ten samples a second, the first, and the end, which is between two samples
    assert len(result.trace) == 32
    assert result.trace["yaw"][-1] == pytest.approx(expected.ground_truth.pose.yaw)
    assert bool(result.film or result.film_problem) == film
    assert recording.exists() == film
    if film:
        assert Recording(str(recording)).summary().topics["/odom"].count > 100
