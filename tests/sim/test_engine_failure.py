"""A step that the engine cannot take stops the run with one error, until a reset."""

import mujoco
import pytest

import kbot
from kbot.sim.divergence import SimulationDiverged


def test_failed_step_is_one_error_until_a_reset(monkeypatch: pytest.MonkeyPatch) -> None:
    sim = kbot.Simulation(kbot.load("kbot"))
    sim.run(0.1)

    def fail(*_: object) -> None:
        raise mujoco.FatalError("mj_stackAlloc: out of memory\nmax = 1")

    with monkeypatch.context() as patch:
        patch.setattr(mujoco, "mj_step", fail)
        with pytest.raises(
            SimulationDiverged, match="engine stopped: mj_stackAlloc: out of memory \\[W120\\]"
        ):
            sim.step()
    with pytest.raises(SimulationDiverged):
        sim.step()
    sim.reset()
    sim.run(0.1)
    assert sim.time == pytest.approx(0.1)
