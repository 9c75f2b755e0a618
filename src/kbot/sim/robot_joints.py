"""The joints of a robot that do not drive: what they are told, and by whom."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Protocol

from kbot.sim.engine.engine import Engine
from kbot.sim.joint_control.kinds import Interface
from kbot.sim.joint_control.servos import JointServos
from kbot.sim.joint_control.trajectory import Point
from kbot.sim.preparation import Prepared
from kbot.sim.robot_body import RobotBody
from kbot.text import KbotError

NOTICEABLE = 1e-3
"""rad or m: how far beyond its limit a joint may be told to be, as by 3.1416, before that is said."""


class JointHost(Protocol):
    """The simulation that takes commands for joints, and writes them in its journal."""

    def command_joints(self, values: Mapping[str, float], interface: str, robot: str | None) -> None: ...

    def follow_trajectory(
        self, joints: Sequence[str], points: Sequence[Sequence[Any]], robot: str | None
    ) -> None: ...

    def tell(self, text: str) -> None: ...


class RobotJoints(RobotBody):
    """A robot whose joints are commanded, but for those that drive it."""

    def __init__(
        self, prepared: Prepared, host: JointHost, engine: Engine, period: float, timestep: float
    ) -> None:
        """`period`: seconds between two commands to the servos."""
        super().__init__(prepared, engine)
        self._joint_host = host
        self.control = prepared.control
        """What commands its joints."""
        self._driving = prepared.driving
        self._beyond: set[str] = set()
        """Joints of which it was told that they stop at their limits."""
        self._period, self._timestep = period, timestep
        self._joint_servos = self._servos_of_joints()

    def _bind(self) -> None:
        """Joints go on as they were told."""
        super()._bind()
        told = self._joint_servos.save()
        self._joint_servos = self._servos_of_joints()
        self._joint_servos.restore(told)

    def _servos_of_joints(self) -> JointServos:
        model, data = self._engine.model, self._engine.data
        others = [name for name in self._joints if name not in self._driving]
        return JointServos(self.robot, model, data, others, self.prefix, self._period, self._timestep)

    def command_joints(self, values: Mapping[str, float], interface: str = Interface.POSITION) -> None:
        """See `Simulation.command_joints`."""
        self._joint_host.command_joints(values, interface, self.name)

    def follow_trajectory(self, joints: Sequence[str], points: Sequence[Sequence[Any]]) -> None:
        """See `Simulation.follow_trajectory`."""
        self._joint_host.follow_trajectory(joints, points, self.name)

    def tell(self, text: str) -> None:
        """See `Running.tell`."""
        self._joint_host.tell(text)

    def _command_joints(self, values: Mapping[str, float], interface: Interface) -> None:
        """Command joints from now on.

        Raises:
            KbotError: no such joint, one that drives or follows another, or a number that is none.
        """
        for joint in values:
            self._require_free_joint(joint)
        self._joint_servos.command(values, interface)
        if interface is Interface.POSITION:
            self._say_beyond(values.items())

    def _follow(self, joints: tuple[str, ...], points: tuple[Point, ...], step: int) -> None:
        """Let joints follow points from a step on. Raises KbotError as `_command_joints` does."""
        for joint in joints:
            self._require_free_joint(joint)
        self._joint_servos.follow(joints, points, step)
        self._say_beyond(pair for point in points for pair in zip(joints, point.positions, strict=True))

    def _say_beyond(self, wanted: Iterable[tuple[str, float]]) -> None:
        """Tell, once a joint, that it stops at its limit before the position that it was told."""
        for joint, position in wanted:
            limit = self._joint_servos.within(joint, position)
            if abs(limit - position) > NOTICEABLE and joint not in self._beyond:
                self._beyond.add(joint)
                self.tell(f"'{joint}' was told {position:g}, beyond its limit: it goes to {limit:.6g}")

    def _save_joints(self) -> tuple[Any, ...]:
        """What `_restore_joints` takes back."""
        return self._joint_servos.save()

    def _restore_joints(self, saved: tuple[Any, ...]) -> None:
        self._joint_servos.restore(saved)

    def _release(self, joint: str) -> None:
        """Let a commanded joint move freely again. Raises KbotError for an unknown joint."""
        self._require_joint(joint)
        self._joint_servos.release(joint)

    def _require_free_joint(self, joint: str) -> None:
        self._require_joint(joint)
        if joint not in self._joint_servos.joints:
            why = "drives the robot" if joint in self._driving else "follows another joint"
            raise KbotError(f"joint '{joint}' {why} and cannot be held")

    def _start_joints(self) -> None:
        """Put joints where the description has them start, and hold those that its controllers hold."""
        self._joint_servos.release_all()
        for joint, position in self.control.starts.items():
            if joint in self._joint_servos.joints:
                self._set_position(joint, position)
        held = [joint for joint in self._joint_servos.joints if joint in self.control.holds]
        here = self.joint_positions
        self._joint_servos.command({joint: here[joint] for joint in held}, Interface.POSITION)
