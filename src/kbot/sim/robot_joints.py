"""The joints of a robot that do not drive: what they are told, and by whom."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

from kbot.model import Robot
from kbot.sim.joint_control.controllers import JointControl
from kbot.sim.joint_control.kinds import Interface
from kbot.sim.joint_control.servos import JointServos
from kbot.sim.joint_control.trajectory import Point
from kbot.sim.robot_body import Frames, RobotBody
from kbot.text import KbotError

NO_CONTROL = JointControl()


class JointHost(Frames, Protocol):
    """The simulation that takes commands for joints."""

    def command_joints(self, values: Mapping[str, float], interface: str, robot: str | None) -> None:
        """See `Simulation.command_joints`."""
        ...

    def follow_trajectory(
        self, joints: Sequence[str], points: Sequence[Sequence[Any]], robot: str | None
    ) -> None:
        """See `Simulation.follow_trajectory`."""
        ...

    def serve(self, robot: Any) -> None:
        """Call the robot's `slew` when it is due, from now on."""
        ...


class RobotJoints(RobotBody):
    """A robot whose joints are commanded; those that are `driving` are not."""

    joint_servos: JointServos

    def __init__(
        self,
        name: str,
        robot: Robot,
        base: str,
        host: JointHost,
        control: JointControl,
        driving: tuple[str, ...],
        period: float,
        timestep: float,
    ) -> None:
        """`period`: seconds between two commands to the servos."""
        super().__init__(name, robot, base, host)
        self._joint_host = host
        self.control = control
        self._driving = driving
        self._period, self._timestep = period, timestep
        self._is_bound = False

    def bind(self, model: Any, data: Any) -> None:
        """Look up this robot's places in a compiled model; joints go on as they were told."""
        told = self.joint_servos.save() if self._is_bound else None
        self._is_bound = True
        super().bind(model, data)
        others = [name for name in self._joints if name not in self._driving]
        self.joint_servos = JointServos(
            self.robot, model, data, others, self.prefix, self._period, self._timestep
        )
        if told is not None:
            self.joint_servos.restore(told)

    def command_joints(self, values: Mapping[str, float], interface: str = Interface.POSITION) -> None:
        """See `Simulation.command_joints`."""
        self._joint_host.command_joints(values, interface, self.name)

    def follow_trajectory(self, joints: Sequence[str], points: Sequence[Sequence[Any]]) -> None:
        """See `Simulation.follow_trajectory`."""
        self._joint_host.follow_trajectory(joints, points, self.name)

    def take_joint_command(self, values: Mapping[str, float], interface: Interface) -> None:
        """Command joints from now on.

        Raises:
            KbotError: no such joint, one that drives or follows another, or a number that is none.
        """
        for joint in values:
            self._require_free_joint(joint)
        self.joint_servos.command(values, interface)
        self._joint_host.serve(self)

    def take_trajectory(self, joints: tuple[str, ...], points: tuple[Point, ...], step: int) -> None:
        """Let joints follow points from a step on. Raises KbotError as `take_joint_command` does."""
        for joint in joints:
            self._require_free_joint(joint)
        self.joint_servos.follow(joints, points, step)
        self._joint_host.serve(self)

    def _release(self, joint: str) -> None:
        """Let a commanded joint move freely again. Raises KbotError for an unknown joint."""
        self._require_joint(joint)
        self.joint_servos.release(joint)

    def _require_free_joint(self, joint: str) -> None:
        self._require_joint(joint)
        if joint not in self.joint_servos.joints:
            why = "drives the robot" if joint in self._driving else "follows another joint"
            raise KbotError(f"joint '{joint}' {why} and cannot be held")

    def _start_joints(self) -> None:
        """Put joints where the description has them start, and hold those that its controllers hold."""
        self.joint_servos.release_all()
        for joint, position in self.control.starts.items():
            if joint in self.joint_servos.joints:
                self._set_position(joint, position)
        held = [joint for joint in self.joint_servos.joints if joint in self.control.holds]
        here = self.joint_positions
        self.joint_servos.command({joint: here[joint] for joint in held}, Interface.POSITION)
