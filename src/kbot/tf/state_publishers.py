"""A robot_state_publisher for each robot of a simulation, also for those that are spawned later."""

from __future__ import annotations

from typing import TYPE_CHECKING

from kbot.model.writer import to_urdf
from kbot.tf.robot_state_publisher import RobotStatePublisher

if TYPE_CHECKING:
    from kbot.sim import Simulation


class StatePublishers:
    """Each publishes in its robot's namespace, with its robot's frame prefix."""

    def __init__(self, simulation: Simulation, description: str = "") -> None:
        """`description` is the first robot's URDF. If it is empty, it is written from the model."""
        self._simulation = simulation
        self._publishers: dict[str, RobotStatePublisher] = {}
        self._add(simulation.robots.first.name, description)
        simulation.robots.when_changed.append(self._update)
        self._update()

    def close(self) -> None:
        """Stop publishing."""
        self._simulation.robots.when_changed.remove(self._update)
        for publisher in self._publishers.values():
            publisher.close()

    def _update(self) -> None:
        """Add publishers for new robots and close those of removed robots."""
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
