"""A simulation that runs on a thread of its own, as fast as the wall's clock, with bridges on it."""

import threading
import time
from collections.abc import Callable, Iterator

import pytest

import kbot
from kbot.bridges.gazebo.services import gazebo_services
from kbot.bridges.gazebo.states import GazeboTopics
from kbot.bridges.link import Link
from kbot.nodes import RobotStatePublisher
from kbot.sim import Simulation
from kbot.wire import Feed


class Running:
    """Steps until it is stopped; `told` is what the link told the user."""

    def __init__(self) -> None:
        self.told: list[str] = []
        self.link = Link(self.told.append)
        self.link.services = gazebo_services("empty")
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
