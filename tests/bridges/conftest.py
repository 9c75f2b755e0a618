"""A simulation that runs on a thread of its own, as fast as the wall's clock, with bridges on it."""

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
    """Steps until it is stopped; `told` is what the link told the user."""

    def __init__(self) -> None:
        self.told: list[str] = []
        self.link = PeerLink(self.told.append)
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

    def goes_on(self) -> bool:
        """Whether simulated time still passes."""
        before = self.simulation.time
        wait_until(lambda: self.simulation.time > before + 0.1)
        return True


def wait_until(condition: Callable[[], object], seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it did not come about"
        time.sleep(0.01)


@pytest.fixture
def running() -> Iterator[Running]:
    found = Running()
    found.start()
    try:
        yield found
    finally:
        found.stop()


@pytest.fixture
def graph_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where a KBot of this test says that it is there, and is looked for."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    return tmp_path / "kbot"


@pytest.fixture
def graph(running: Running, graph_folder: Path) -> Iterator[GraphServer]:
    wait_until(lambda: "/tf_static" in running.link.topics)
    found = GraphServer(running.link)
    found.announce("kbot", "empty")
    try:
        yield found
    finally:
        found.close()


Said = pytest.CaptureFixture[str]


def told(capsys: Said, *words: str, status: int = 0) -> str:
    """What a verb says: on stdout, or why it fails."""
    capsys.readouterr()
    assert run(words) == status
    captured = capsys.readouterr()
    return captured.out if status == 0 else captured.err
