"""A replay ends a fault early if the run did."""

from pathlib import Path

from kbot.record.replay import replay
from kbot.sim import Simulation
from kbot.sim.injected_faults import Slip

from .conftest import record


def test_end_of_a_fault_is_replayed(tmp_path: Path) -> None:
    ended: list[str] = []

    def drive(sim: Simulation) -> None:
        sim.cmd_vel(0.2, 0.1)
        number = sim.disturbances.schedule(Slip("left_wheel", 0.1), at=0.2, duration=5.0)
        sim.run(0.5)
        sim.disturbances.end_fault(number)
        sim.run(0.5)
        ended.append(sim.state_sha256())

    record(tmp_path / "run.mcap", drive)
    again = replay(str(tmp_path / "run.mcap"))
    assert again.is_same
    assert again.same_state is True
    assert [again.simulation.state_sha256()] == ended
