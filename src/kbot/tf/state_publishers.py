"""A robot_state_publisher for each robot of a simulation, also for those that are spawned later."""

from __future__ import annotations

from typing import TYPE_CHECKING

from kbot.model.writer import to_urdf
from kbot.tf.robot_state_publisher import RobotStatePublisher

if TYPE_CHECKING:
    from kbot.sim import Simulation


class StatePublishers:
    """Each speaks in its robot's namespace, of frames with its robot's prefix."""

    def __init__(self, simulation: Simulation, description: str = "") -> None:
        """`description` is the URDF that the first robot was read from, made anew where empty."""
        self._simulation = simulation
        self._publishers: dict[str, RobotStatePublisher] = {}
        self._add(simulation.robots.first.name, description)
        simulation.robots.when_changed.append(self._look)
        self._look()

    def close(self) -> None:
        """Say no more."""
        self._simulation.robots.when_changed.remove(self._look)
        for publisher in self._publishers.values():
            publisher.close()

    def _look(self) -> None:
        robots = self._simulation.robots
        for name in self._publishers.keys() - robots.keys():
            self._publishers.pop(name).close()
        for name in robots:
            if name not in self._publishers:
                self._add(name)

    def _add(self, name: str, description: str = "") -> None:
        simulation, robot = self._simulation, self._simulation.robots[name]
        namespace = robot.naming.namespace
        self._publishers[name] = RobotStatePublisher(
            robot.robot,
            simulation.bus,
            simulation.clock,
            description=description or to_urdf(robot.robot),
            frame_prefix=robot.naming.frame_prefix,
            namespace=f"/{namespace}" if namespace else "",
        )
