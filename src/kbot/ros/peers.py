"""The peers of a run: bridges, Gazebo's topics and services, and the graph that `kbot topic` queries."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from kbot.messages.live import Live
from kbot.record.feed import Feed
from kbot.ros.bridges.kind import Bridge
from kbot.ros.bridges.link import PeerLink, any_version
from kbot.ros.bridges.registry import BRIDGES
from kbot.ros.bridges.ros_versions import version_of
from kbot.ros.graph.server import GraphServer
from kbot.ros.parameter_values import ParameterValue
from kbot.text import KbotError

if TYPE_CHECKING:
    from kbot.ros.gazebo.states import GazeboTopics
    from kbot.sim import Simulation


class RosPeers:
    """Opens the bridges at the first `join` or `show` and keeps them open until `close`.

    In between, one simulation can replace another.
    """

    def __init__(
        self,
        report: Callable[[str], None],
        bridges: Sequence[str] = (),
        host: str | None = None,
        *,
        navigation: bool = True,
        parameters: Mapping[str, ParameterValue] | None = None,
    ) -> None:
        """`report` receives sentences for the user. PeerOptions describes the other parameters."""
        self._report = report
        self._kinds = [kind for kind in BRIDGES if kind.name in bridges]
        self._host = host
        self._parameters = dict(parameters or {})
        self._link = PeerLink(report, frozenset() if navigation else _navigation_topics())
        self._bridges: list[Bridge] = []
        self._gazebo: GazeboTopics | None = None
        self._simulation: Simulation | None = None

    def join(self, simulation: Simulation, feed: Feed, description: str, world: str) -> None:
        """Connect a simulation to the peers, with Gazebo's topics and services.

        Raises:
            KbotError: a bridge cannot be opened.
        """
        from kbot.ros.gazebo.gazebo_services import gazebo_services  # imported lazily: they load the engine
        from kbot.ros.gazebo.states import GazeboTopics

        self._simulation = simulation
        simulation.journal.listeners.append(self._link.report)
        self._link.offer(gazebo_services())
        self._link.version_of = version_of
        self._gazebo = GazeboTopics(simulation)
        self._connect(simulation, feed, description, simulation.robot.name, world, publishes_clock=True)

    def show(self, shown: Live, feed: Feed, description: str, name: str, *, publishes_clock: bool) -> None:
        """Connect a robot that is shown and not simulated, under the name `name`.

        If it `publishes_clock`, peers use its time, else wall-clock time.

        Raises:
            KbotError: a bridge cannot be opened.
        """
        self._link.version_of = any_version
        self._connect(shown, feed, description, name, "", publishes_clock=publishes_clock)

    def leave(self) -> None:
        """Disconnect the simulation or the shown robot. The bridges stay open."""
        self._link.detach()
        if self._simulation is not None:
            self._simulation.journal.listeners.remove(self._link.report)
            self._simulation = None
        if self._gazebo is not None:
            self._gazebo.close()
            self._gazebo = None

    def close(self) -> None:
        self.leave()
        self._link.end()
        for bridge in self._bridges:
            bridge.close()
        self._bridges.clear()

    def _connect(
        self, live: Live, feed: Feed, description: str, robot: str, world: str, *, publishes_clock: bool
    ) -> None:
        published: dict[str, ParameterValue] = {"/robot_description": description} if description else {}
        if publishes_clock:
            published["/use_sim_time"] = True
        self._link.parameters = {**self._parameters, **self._link.parameters, **published}
        self._link.attach(live, feed)
        if not self._bridges:
            self._open_bridges()
            graph = GraphServer(self._link)
            self._bridges.append(graph)
            graph.announce(robot, world)

    def _open_bridges(self) -> None:
        try:
            for kind in self._kinds:
                bridge = kind.open(self._link, self._host)
                self._bridges.append(bridge)
                self._report(bridge.describe())
        except KbotError:
            self.close()
            raise


def _navigation_topics() -> frozenset[str]:
    from kbot.navigation.goals.topics import TOPICS  # imported lazily, for a fast start-up

    return TOPICS
