"""MCAP's JavaScript library reads the files that KBot writes."""

import json
import shutil
import subprocess
from pathlib import Path

import pytest

import kbot
from kbot.record import Recorder, Recording
from kbot.record.feed import Feed
from kbot.sim import Simulation

from .conftest import install_npm, node_programs

READER = Path(__file__).parent / "mcap_reader.mjs"
PACKAGES = ("@mcap/core@2", "@mcap/nodejs@1", "fzstd@0.1")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = install_npm(tmp_path_factory.mktemp("mcap"), PACKAGES)
    shutil.copy(READER, found)
    return found


def test_index_finds_every_message_time_and_note(folder: Path) -> None:
    file = folder / "run.mcap"
    sim = Simulation(kbot.load("kbot"))
    with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), str(file)):
        sim.cmd_vel(0.3, 0.2)
        sim.run(5.0)
    done = subprocess.run(
        [node_programs()[0], READER.name, str(file)],
        cwd=folder,
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    theirs = json.loads(done.stdout)
    summary = Recording(str(file)).summary()
    assert theirs["profile"] == "ros2"
    assert {name: (t["type"], t["count"]) for name, t in theirs["topics"].items()} == {
        name: (t.type_name, t.count) for name, t in summary.topics.items()
    }
    assert {t["encoding"] for t in theirs["topics"].values()} == {"ros2msg cdr"}
    assert theirs["notes"] == summary.notes
    entries = [entry for entry in Recording(str(file)).entries() if entry.topic == "/odom"]
    odometry = theirs["topics"]["/odom"]
    assert len(entries) == 250
    assert odometry["times"] == [str(entry.nanoseconds) for entry in entries]
    assert odometry["bytes"] == sum(len(entry.cdr) for entry in entries)
