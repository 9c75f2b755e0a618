"""Where commands lead a robot that moves exactly as its controller commands."""

from __future__ import annotations

import math

from kbot.kinematics.planar_pose import PlanarPose, arc
from kbot.sim.recipe import SLEW_PERIOD
from kbot.trials.actions import Command
from kbot.trials.robot_facts import RobotFacts
from kbot.trials.scenario import Step
from kbot.trials.trace import RATE

TICK = 1.0 / RATE
"""Seconds between the times at which steps of a scenario can begin."""
_ORIGIN = PlanarPose()
_LONGEST = 120.0
"""Seconds after which a command ends that does not reach its speed."""


class CommandedMotion:
    """A sequence of commands, and the pose to which they lead.

    The pose follows from the twists that the robot's controller commands within its limits of speed,
    acceleration and jerk. A constant twist moves the base along an arc (see `planar_pose`).
    """

    def __init__(self, facts: RobotFacts, start: PlanarPose = _ORIGIN, at: float = 0.0) -> None:
        """Motion from the pose `start` of the base in the world, from the time `at` on."""
        self.start = start
        self._controller = facts.twist_controller()
        self._sharpest = math.inf if facts.turns_in_place else 1.0 / facts.smallest_radius
        self._axle = facts.drive.axle_in_base_planar
        self._world_from_axle = start @ self._axle
        self.steps: list[Step] = []
        self.time = at
        self.path_length = 0.0
        """Length in m of the path of the base's origin."""
        self.turned = 0.0
        """Angle in rad, both directions added."""
        self.turn = 0.0
        """Angle in rad from the start, to the left positive, with full turns."""
        self.settling = 0.0
        """Seconds from the last command to stop until the controller commands no more motion."""

    @staticmethod
    def whole_ticks(seconds: float) -> float:
        """A time rounded up to whole ticks."""
        return round(math.ceil(seconds / TICK - 1e-9) * TICK, 6)

    @property
    def pose(self) -> PlanarPose:
        """The pose of the base in the world. Its yaw counts full turns."""
        pose = self._world_from_axle @ self._axle.inverse()
        return PlanarPose(pose.x, pose.y, self.start.yaw + self.turn)

    def drive(self, linear: float, angular: float, seconds: float, lateral: float = 0.0) -> None:
        """Command a twist for a time, rounded to whole ticks."""
        self.steps.append(Step(Command(linear, angular, lateral), at=self.time))
        self._controller.set_target(linear, lateral, angular, None)
        ticks = max(1, round(seconds / TICK))
        for _ in range(ticks * round(TICK / SLEW_PERIOD)):
            self._advance()
        self.time = round(self.time + ticks * TICK, 6)

    def stop(self) -> None:
        """Command a stop, and wait until the controller commands no more motion."""
        self.steps.append(Step(Command(), at=self.time))
        self._controller.set_target(0.0, 0.0, 0.0, None)
        count, settled = 0, False
        while not settled and count * SLEW_PERIOD < _LONGEST:
            settled = self._advance()
            count += 1
        self.settling = math.ceil(count * SLEW_PERIOD / TICK) * TICK
        self.time = round(self.time + self.settling, 6)

    def wait(self, seconds: float) -> None:
        self.time = round(self.time + max(1, round(seconds / TICK)) * TICK, 6)

    def _advance(self) -> bool:
        x, y, yaw, settled = self._controller.advance()
        most = self._sharpest * abs(x) if self._sharpest < math.inf else math.inf
        yaw = min(max(yaw, -most), most)
        length, turn, before = math.hypot(x, y) * SLEW_PERIOD, yaw * SLEW_PERIOD, self.pose
        heading = PlanarPose(yaw=math.atan2(y, x))
        self._world_from_axle = self._world_from_axle @ heading @ arc(length, turn) @ heading.inverse()
        self.path_length += math.hypot(self.pose.x - before.x, self.pose.y - before.y)
        self.turned += abs(turn)
        self.turn += turn
        return settled
