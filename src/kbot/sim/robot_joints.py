"""Commands and servos of the joints that are not part of the drive."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from kbot.sim.engine.engine import Engine
from kbot.sim.joint_control.kinds import Interface
from kbot.sim.joint_control.servos import JointServos
from kbot.sim.joint_control.trajectory import TrajectoryPoint
from kbot.sim.preparation import Prepared
from kbot.sim.robot_body import RobotBody
from kbot.text import KbotError

NOTICEABLE = 1e-3
"""rad or m by which a command may exceed a joint's limit without a report: pi is often written as 3.1416."""


class RobotJoints:
    """The joints of a robot that can be commanded, with their `servos`."""

    def __init__(
        self,
        prepared: Prepared,
        body: RobotBody,
        engine: Engine,
        period: float,
        report: Callable[[str], None],
    ) -> None:
        """`period`: seconds between calls of `advance`. `report` receives reports to the user."""
        self.control = prepared.control
        """The controllers of the joints."""
        self._body, self._engine, self._period, self._report = body, engine, period, report
        self._driving = prepared.driving
        self._beyond: set[str] = set()
        """Joints for which a command beyond the limits was reported."""
        self.servos = self._find_servos()

    def bind(self) -> None:
        """Find the joints in the engine's new model. Their commands continue."""
        saved = self.servos.save()
        self.servos = self._find_servos()
        self.servos.restore(saved)

    def _find_servos(self) -> JointServos:
        body, engine = self._body, self._engine
        others = [name for name in body.joints if name not in self._driving]
        return JointServos(
            body.robot, engine.model, engine.data, others, body.prefix, self._period, engine.timestep
        )

    def command(self, values: Mapping[str, float], interface: Interface) -> None:
        """Command joints from now on.

        Raises:
            KbotError: a joint does not exist, drives the robot or mimics another joint, or a value is not a
                number.
        """
        for joint in values:
            self._require_free(joint)
        self.servos.command(values, interface)
        if interface is Interface.POSITION:
            self._report_beyond(values.items())

    def follow(self, joints: tuple[str, ...], points: tuple[TrajectoryPoint, ...], step: int) -> None:
        """Move joints along a trajectory that starts at `step`. Raises KbotError as `command` does."""
        for joint in joints:
            self._require_free(joint)
        self.servos.follow(joints, points, step)
        self._report_beyond(pair for point in points for pair in zip(joints, point.positions, strict=True))

    def _report_beyond(self, wanted: Iterable[tuple[str, float]]) -> None:
        """Report, once per joint, that a commanded position is beyond its limit."""
        for joint, position in wanted:
            limit = self.servos.within(joint, position)
            if abs(limit - position) > NOTICEABLE and joint not in self._beyond:
                self._beyond.add(joint)
                self._report(f"joint '{joint}': {position:g} is beyond its limit. It moves to {limit:.6g}")

    def release(self, joint: str) -> None:
        """Let a commanded joint move freely again. Raises KbotError for an unknown joint."""
        self._body.require_joint(joint)
        self.servos.release(joint)

    def _require_free(self, joint: str) -> None:
        self._body.require_joint(joint)
        if joint not in self.servos.joints:
            why = "drives the robot" if joint in self._driving else "mimics another joint"
            raise KbotError(f"joint '{joint}' {why} and cannot be commanded")

    def start(self) -> None:
        """Set joints to the description's start positions, and hold those that a controller holds."""
        self.servos.release_all()
        for joint, position in self.control.starts.items():
            if joint in self.servos.joints:
                self._body.set_position(joint, position)
        held = [joint for joint in self.servos.joints if joint in self.control.holds]
        here = self._body.joint_positions
        self.servos.command({joint: here[joint] for joint in held}, Interface.POSITION)
