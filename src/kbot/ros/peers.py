"""What goes along with a simulation: a recording, and bridges to other systems."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from kbot.messages import ClockMessage, String, Timer
from kbot.messages.live import Live
from kbot.model.writer import to_urdf
from kbot.record.feed import Feed
from kbot.record.recorder import NODES, STATE_PUBLISHER, TRANSFORMS, Recorder
from kbot.ros.bridges.link import Link
from kbot.ros.graph.server import GraphServer
from kbot.ros.peer_options import CompanionOptions
from kbot.text import KbotError
from kbot.tf.state_publishers import StatePublishers
from kbot.tf.static_transforms import publish_static_transforms, to_json

if TYPE_CHECKING:
    from kbot.ros.gazebo.states import GazeboTopics
    from kbot.sim import Simulation

CLOCK_RATE = 50.0
"""Hz of /clock where there is no simulation to say it."""


class Bridge(Protocol):
    """One protocol. What never waits runs on the loop of all bridges, the rest on threads of its own."""

    def describe(self) -> str:
        """Where it is to be found, in one sentence."""
        ...

    def close(self) -> None: ...


class Companions:
    """Opened once; `join` goes along with a simulation, also with one that takes another's place."""

    def __init__(
        self, options: CompanionOptions, tell: Callable[[str], None], *, served: bool = False
    ) -> None:
        """`tell` is given sentences for the user; `served`: it runs by the wall's clock, so that others of
        this machine may ask it."""
        self._options, self._tell = options, tell
        self._is_live = served or options.is_live
        self.failure: KbotError | None = None
        """Why the recording ended early, if it did."""
        self._gazebo: GazeboTopics | None = None
        self._link = Link(tell, frozenset() if options.navigation else _navigation_topics())
        self._bridges: list[Bridge] = []
        self._recorder: Recorder | None = None
        self._publishers: StatePublishers | None = None
        self._timer: Timer | None = None
        self._simulation: Simulation | None = None
        """The one whose services are offered."""
        self._joined = 0
        self._first_world = ""

    def join(self, simulation: Simulation, description: str, world: str) -> None:
        """Go along with a simulation from now on. `description` is its URDF, made anew where
        empty; `world` names its world.

        Raises:
            KbotError: the recording cannot be made, or a bridge cannot be opened.
        """
        self._leave()
        description = description or to_urdf(simulation.robot)
        self._first_world = self._first_world or simulation.world.name
        if simulation.world.name != self._first_world:
            world = simulation.world.name
        feed = Feed(simulation.bus, lambda: simulation.clock.nanoseconds)
        self._publishers = StatePublishers(simulation, description)
        transforms = self._options.transforms
        if transforms:
            publish_static_transforms(simulation.bus, simulation.clock, transforms)
        if self._options.record:
            self._recorder = Recorder(
                simulation,
                feed,
                _numbered(self._options.record, self._joined),
                topics=self._options.topics,
                description=description,
                world=world,
                facts={NODES: STATE_PUBLISHER, TRANSFORMS: to_json(transforms)},
                on_failure=self._lost,
            )
        self._joined += 1
        if self._is_live:
            from kbot.ros.gazebo.states import GazeboTopics

            self._simulation = simulation
            simulation.tells.append(self._link.tell)
            simulation.when_robots_change.append(self._offer)
            self._offer()
            self._gazebo = GazeboTopics(simulation)
            self._connect(simulation, feed, description, simulation.robot.name, world)

    def _offer(self) -> None:
        """Have Gazebo's services called, and those of the robots' controller managers."""
        simulation = self._simulation
        if simulation is None:
            return
        from kbot.ros.gazebo.controller_manager import controller_services
        from kbot.ros.gazebo.services import gazebo_services

        managers = controller_services(simulation, lambda: self._link.parameters, self._link.tell)
        self._link.offer(gazebo_services(simulation.world.name) | managers)

    def show(self, shown: Live, description: str, name: str, *, tells_time: bool = True) -> None:
        """Go along with a robot that is shown and not simulated: `shown` says its joints and transforms.
        There is nothing to be recorded. `description` is its URDF, empty where there is none, `name` what
        others are told that runs; unless it `tells_time`, that is the wall's.

        Raises:
            KbotError: a bridge cannot be opened.
        """
        self._leave()
        if tells_time and "/clock" not in shown.bus.topics:  # a recording that is played may have its own
            clock = shown.bus.advertise("/clock", ClockMessage, rate=CLOCK_RATE)
            self._timer = shown.clock.every(
                CLOCK_RATE, lambda: clock.publish(ClockMessage(shown.clock.stamp))
            )
        if description:
            shown.bus.advertise("/robot_description", String, latched=True).publish(String(description))
        if self._options.transforms:
            publish_static_transforms(shown.bus, shown.clock, self._options.transforms)
        if self._is_live:
            feed = Feed(shown.bus, lambda: shown.clock.nanoseconds)
            self._connect(shown, feed, description, name, tells_time=tells_time)

    def _connect(
        self,
        live: Live,
        feed: Feed,
        description: str,
        robot: str,
        world: str = "",
        *,
        tells_time: bool = True,
    ) -> None:
        told: dict[str, object] = {"/robot_description": description} if description else {}
        if tells_time:
            told["/use_sim_time"] = True
        self._link.parameters = {**self._options.parameters, **self._link.parameters, **told}
        self._link.attach(live, feed)
        if not self._bridges:
            self._open_bridges()
            graph = GraphServer(self._link)
            self._bridges.append(graph)
            graph.announce(robot, world)

    def interrupt(self, error: BaseException) -> None:
        """Raise an error that comes from outside, as Ctrl-C does; what is recorded stays whole."""
        if self._recorder is None:
            raise error
        self._recorder.interrupt(error)

    def close(self) -> None:
        """Finish the recording and take leave of all peers."""
        self._leave()
        self._link.end()
        for bridge in self._bridges:
            bridge.close()
        self._bridges.clear()

    def _leave(self) -> None:
        if self._recorder is not None:
            self._recorder.close()
            if self._recorder.failure is None:
                self._tell(f"{self._recorder.path}: {self._recorder.count} messages recorded")
            self._recorder = None
        if self._publishers is not None:
            self._publishers.close()
            self._publishers = None
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        self._link.detach()
        if self._simulation is not None:
            self._simulation.when_robots_change.remove(self._offer)
            self._simulation.tells.remove(self._link.tell)
            self._simulation = None
        if self._gazebo is not None:
            self._gazebo.close()
            self._gazebo = None

    def _lost(self, failure: KbotError) -> None:
        self.failure = failure
        self._tell(f"error: {failure}")

    def _open_bridges(self) -> None:
        try:
            if self._options.ros1:
                from kbot.ros.bridges.ros1 import Ros1Bridge

                self._add(Ros1Bridge(self._link, self._options.host))
            if self._options.ros2:
                self._add(ros2_bridge(self._link, self._options.host))
            if self._options.zenoh:
                self._add(_zenoh_bridge(self._link, self._options.host))
            if self._options.foxglove:
                from kbot.ros.bridges.foxglove.bridge import FoxgloveBridge

                self._add(FoxgloveBridge(self._link, self._options.host))
            if self._options.rosbridge:
                from kbot.ros.bridges.rosbridge.bridge import RosbridgeBridge

                self._add(RosbridgeBridge(self._link, self._options.host))
        except KbotError:
            self.close()
            raise

    def _add(self, bridge: Bridge) -> None:
        self._bridges.append(bridge)
        self._tell(bridge.describe())


def ros2_bridge(link: Link, host: str | None, node: str = "/kbot") -> Bridge:
    """Raises KbotError: the extra is not installed, or ROS 2 cannot be served."""
    try:
        from kbot.ros.bridges.ros2 import Ros2Bridge
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != "cyclonedds":
            raise
        raise KbotError("ROS 2 needs an extra: pip install 'kbot[ros2]'") from None
    return Ros2Bridge(link, host, node)


def _zenoh_bridge(link: Link, host: str | None) -> Bridge:
    try:
        from kbot.ros.bridges.zenoh.bridge import ZenohBridge
    except ModuleNotFoundError as error:
        if error.name != "zenoh":
            raise
        raise KbotError("Zenoh needs an extra: pip install 'kbot[zenoh]'") from None
    return ZenohBridge(link, host)


def _navigation_topics() -> frozenset[str]:
    from kbot.navigation.topics import TOPICS

    return TOPICS


def _numbered(path: str, number: int) -> str:
    """`run.mcap` for the first simulation, `run-2.mcap` for the second."""
    target = Path(path)
    return path if number == 0 else str(target.with_name(f"{target.stem}-{number + 1}{target.suffix}"))
