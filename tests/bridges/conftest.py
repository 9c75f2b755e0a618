"""Fixtures: a simulation that runs in real time on its own thread, with a link for bridges."""

import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import kbot
from kbot.cli.main import run
from kbot.record.feed import Feed
from kbot.ros.bridges.link import PeerLink
from kbot.ros.gazebo.gazebo_services import gazebo_services
from kbot.ros.gazebo.states import GazeboTopics
from kbot.ros.graph.server import GraphServer
from kbot.sim import Simulation
from kbot.tf.robot_state_publisher import RobotStatePublisher


class Running:
    """Steps until it is stopped. `reported` collects what the link reports to the user."""

    def __init__(self) -> None:
        self.reported: list[str] = []
        self.link = PeerLink(self.reported.append)
        self.link.services = gazebo_services()
        self.simulation = Simulation(kbot.load("kbot"))
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def start(self) -> None:
        sim = self.simulation
        RobotStatePublisher(sim.robot, sim.bus, sim.clock, description="<robot/>")
        GazeboTopics(sim)
        self.link.parameters = {"/robot_description": "<robot/>", "/use_sim_time": True}
        self.link.attach(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds))
        self._thread.start()

    def stop(self) -> None:
        self._stop.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._stop.is_set():
            self.simulation.run_errands()
            if not self.simulation.paused:
                self.simulation.step(10)
            time.sleep(0.01)

    def is_stepping(self) -> bool:
        """Wait until the simulated time has advanced; fails if it does not."""
        before = self.simulation.time
        wait_until(lambda: self.simulation.time > before + 0.1)
        return True


def wait_until(condition: Callable[[], object], seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, f"the condition did not hold within {seconds:g} s"
        time.sleep(0.01)


@pytest.fixture
def running() -> Iterator[Running]:
    simulation = Running()
    simulation.start()
    try:
        yield simulation
    finally:
        simulation.stop()


@pytest.fixture
def graph_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder in which a KBot of this test writes its presence file."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    return tmp_path / "kbot"


@pytest.fixture
def graph(running: Running, graph_folder: Path) -> Iterator[GraphServer]:
    wait_until(lambda: "/tf_static" in running.link.topics)
    server = GraphServer(running.link)
    server.announce("kbot", "empty")
    try:
        yield server
    finally:
        server.close()


Capture = pytest.CaptureFixture[str]


def run_verb(capsys: Capture, *words: str, status: int = 0) -> str:
    """What a verb prints: to stdout, or to stderr if it is expected to fail."""
    capsys.readouterr()
    assert run(words) == status
    captured = capsys.readouterr()
    return captured.out if status == 0 else captured.err
