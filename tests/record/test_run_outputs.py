"""The outputs of a run, also when the description changes in the page."""

from pathlib import Path

import pytest

import kbot
from kbot.record import Recording
from kbot.record.record_options import RecordOptions
from kbot.record.replay import replay
from kbot.record.run_outputs import RunOutputs
from kbot.ros.peers import RosPeers
from kbot.sim import Simulation
from kbot.sim.real_time import run_in_real_time
from kbot.text import KbotError
from kbot.workbench.serve import open_session

SQUARE = """<robot name="r">
  <link name="base_link"><inertial><mass value="1"/>
  <inertia ixx=".01" iyy=".01" izz=".01" ixy="0" ixz="0" iyz="0"/>
  </inertial><visual><geometry><box size=".2 .2 {height}"/></geometry></visual>
  <collision><geometry><box size=".2 .2 {height}"/></geometry></collision></link></robot>"""


def test_changed_description_is_recorded_to_its_own_file(tmp_path: Path) -> None:
    file = tmp_path / "r.urdf"
    file.write_text(SQUARE.format(height=0.1))
    reports: list[str] = []
    outputs = RunOutputs(reports.append, RecordOptions(str(tmp_path / "run.mcap")))
    session = open_session(str(file), simulate=True, on_start=lambda sim: outputs.join(sim, "", "empty"))
    for _ in range(10):
        session.advance(0.02)
    file.write_text(SQUARE.format(height=0.3))
    session.adopt(session.read())
    for _ in range(20):
        session.advance(0.02)
    outputs.close()
    assert [Path(text.partition(": ")[0]).name for text in reports] == ["run.mcap", "run-2.mcap"]
    first, second = (Recording(str(tmp_path / name)) for name in ("run.mcap", "run-2.mcap"))
    assert first.summary().topics["/clock"].count == 10
    assert second.summary().topics["/clock"].count == 20
    texts = [
        next(e.message().data for e in r.entries() if e.topic == "/robot_description")
        for r in (first, second)
    ]
    assert ["0.3" in text for text in texts] == [False, True]
    assert replay(str(tmp_path / "run.mcap")).is_same
    with pytest.raises(KbotError, match="begins at step 100 of its run"):
        replay(str(tmp_path / "run-2.mcap"))


def test_bridges_keep_their_addresses_when_the_simulation_changes(tmp_path: Path) -> None:
    reports: list[str] = []
    outputs = RunOutputs(reports.append, peers=RosPeers(reports.append, ["foxglove"]))
    for _ in range(2):
        outputs.join(Simulation(kbot.load("kbot")), "", "empty")
    assert len([text for text in reports if text.startswith("Foxglove")]) == 1
    outputs.close()
    outputs.close()


def test_bridge_that_cannot_be_opened_leaves_no_resources(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    peers = RosPeers(print, ["foxglove"], "192.0.2.1")
    outputs = RunOutputs(print, RecordOptions(str(path)), peers)
    with pytest.raises(KbotError, match="Foxglove cannot be served"):
        outputs.join(Simulation(kbot.load("kbot")), "", "empty")
    assert not Recording(str(path)).summary().broken


def test_pacing_runs_exactly_the_requested_time() -> None:
    sim = Simulation(kbot.load("kbot"))
    run_in_real_time(sim, 0.133)
    assert sim.steps == 66
