"""The drive of one robot: twist commands in, wheel odometry out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import inf

from kbot.kinematics.drive.drive import DifferentialDrive, HolonomicDrive, SteeredDrive, find_drive
from kbot.model import RobotModel
from kbot.sim.drive.holonomic_servos import HolonomicServos
from kbot.sim.drive.odometry_settings import Source
from kbot.sim.drive.settings import DriveSettings, drive_settings
from kbot.sim.drive.steered_servos import SteeredServos
from kbot.sim.drive.twist_controller import STILL, SavedTwist, Twist, TwistController
from kbot.sim.drive.wheel_servos import ServoState, WheelServos
from kbot.sim.engine.engine import Engine
from kbot.sim.recipe import CONTROL_PERIOD, SLEW_PERIOD
from kbot.sim.wheel_odometry import (
    ORIGIN,
    CommandOdometry,
    Motion,
    PlanarOdometry,
    TrueOdometry,
    UnwrappedPose,
    WheelOdometry,
    motion_between,
)
from kbot.text import DiagnosticCollector

SavedDrive = tuple[SavedTwist, tuple[float, ...], ServoState, bool]


def twist_controller(
    robot: RobotModel, drive: DifferentialDrive, settings: DriveSettings, period: float
) -> TwistController:
    """Follows twists within the limits of a robot's controller and of its wheels, one `period` at a time."""
    of_joints = [robot.joints[joint].speed_limit for joint in drive.joints]
    fastest = min(of_joints, default=settings.rim_speed / settings.radius)
    return TwistController(settings.with_controller_sizes(drive), settings.limits, fastest, period)


def described_top_speeds(robot: RobotModel) -> Twist:
    """The highest speeds that a description allows, infinite without a limit and without a drive."""
    drive = find_drive(robot)
    if not isinstance(drive, DifferentialDrive):
        return inf, inf, inf
    settings = drive_settings(robot, drive, DiagnosticCollector())
    return twist_controller(robot, drive, settings, SLEW_PERIOD).fastest


class DriveController:
    """Turns the wheels of a robot by its commanded twist, and computes odometry from them."""

    def __init__(
        self,
        robot: RobotModel,
        drive: DifferentialDrive,
        settings: DriveSettings,
        engine: Engine,
        prefix: str,
        period: float,
        truth: Callable[[], Motion],
    ) -> None:
        """`prefix` starts the engine's names of the joints. `period`: seconds between calls of `advance`.

        `truth` returns the base's true motion.
        """
        self._engine, self._robot, self._drive = engine, robot, drive
        self._prefix, self._period = prefix, period
        self._believed = settings.with_controller_sizes(drive)
        """The drive with the sizes that the robot's own controller uses, right or wrong."""
        self._controller = twist_controller(robot, drive, settings, period)
        self._odometry = self._find_odometry(settings.odometry.source, truth)
        self._servos = self._find_servos()
        self.is_driving = False
        """Whether `advance` has to be called, because the wheels have not reached the commanded twist."""

    def bind(self) -> None:
        """Find the wheels in the engine's new model. Their commands continue."""
        state = self._servos.state
        self._servos = self._find_servos()
        self._servos.state = state

    def _find_odometry(
        self, source: Source, truth: Callable[[], Motion]
    ) -> WheelOdometry | PlanarOdometry | TrueOdometry | CommandOdometry:
        if source is Source.TRUTH:
            return TrueOdometry(truth, self._believed)
        if source is Source.COMMANDS:
            return CommandOdometry(lambda: self.twist, CONTROL_PERIOD, self._believed)
        return self._wheel_odometry()

    def _wheel_odometry(self) -> WheelOdometry | PlanarOdometry:
        if isinstance(self._believed, SteeredDrive | HolonomicDrive):
            return PlanarOdometry(self._believed)
        return WheelOdometry(self._believed)

    def _find_servos(self) -> WheelServos | SteeredServos | HolonomicServos:
        model, data = self._engine.model, self._engine.data
        if isinstance(self._drive, HolonomicDrive) and isinstance(self._believed, HolonomicDrive):
            return HolonomicServos(model, data, self._robot, self._drive, self._believed, self._prefix)
        if isinstance(self._believed, SteeredDrive):
            return SteeredServos(model, data, self._believed, self._prefix, self._period)
        return WheelServos(model, data, self._drive, self._believed, self._prefix)

    def reset(self) -> None:
        """Clear the command and the odometry, after the engine's state was reset."""
        self._controller.reset()
        self._odometry.reset()
        self._servos = self._find_servos()  # steered servos measure from the current angles
        self.is_driving = False

    def drive_at(self, x: float, y: float, yaw: float, deadline: int | None) -> bool:
        """Follow a twist (m/s, m/s, rad/s) until the step `deadline`, or without an end if it is None.

        Returns whether `advance` has to be called.
        """
        controller = self._controller
        if controller.wanted == (x, y, yaw):
            controller.deadline = deadline
        elif controller.set_target(x, y, yaw, deadline):
            self.is_driving = True
        return self.is_driving

    def advance(self) -> None:
        """Send the wheels their speeds for the next period."""
        x, y, yaw, is_settled = self._controller.advance()
        has_followed = self._servos.move(x, y, yaw)
        self.is_driving = not (is_settled and has_followed)

    def tick(self, step: int) -> bool:
        """Update odometry, limit the servos' wind-up, and stop if the command has timed out.

        Call this every control period. Returns whether `advance` has to be called to stop the robot.
        """
        self._odometry.update(*self._servos.roll())
        deadline = self._controller.deadline
        if deadline is not None and step >= deadline:
            return self.drive_at(*STILL, None)
        return False

    @property
    def fastest(self) -> Twist:
        """The highest speeds that the drive allows."""
        return self._controller.fastest

    def reach(self, wanted: Twist, seconds: float, *, has_jerk: bool = True) -> Twist:
        """How far the drive's limits let a command move it from standstill, also without those of jerk: m, m
        and rad."""
        limits = self._controller.limits
        if not has_jerk:
            limits = replace(limits, linear_jerk=inf, lateral_jerk=inf, angular_jerk=inf)
        return self._controller.reach(*wanted, seconds, limits)

    @property
    def wanted(self) -> Twist:
        """The last command as given."""
        return self._controller.wanted

    @property
    def twist(self) -> Twist:
        """The commanded twist after acceleration limits."""
        return self._controller.twist

    @property
    def odometry(self) -> Motion:
        """The base's pose in the odometry frame and its twist in its own frame, computed from the wheels."""
        servos = self._servos
        return Motion.of(self._odometry.base(*servos.angles()), self._odometry.twist(*servos.speeds()))

    def wheel_motion(self) -> Callable[[], Twist]:
        """A function that returns the axle's motion since its last call in m, m and rad, by the wheels,
        whatever the odometry that the robot publishes is computed from."""
        odometry = self._wheel_odometry()
        odometry.reset(*self._servos.angles())

        def moved() -> Twist:
            before = odometry.axle
            odometry.update(*self._servos.angles())
            return motion_between(before, odometry.axle)

        return moved

    @property
    def has_true_odometry(self) -> bool:
        """Whether odometry is the true motion, because the plugin of the drive publishes that."""
        return isinstance(self._odometry, TrueOdometry)

    @property
    def axle(self) -> UnwrappedPose:
        """The axle's pose by odometry, as of the last `tick`."""
        return self._odometry.axle

    def restart_odometry(self) -> None:
        """Restart odometry at zero, at the current pose and wheel angles."""
        self._odometry.reset(*self._servos.angles())

    def settle(self) -> None:
        """Stop the wheels at their current angles and clear their servos' state."""
        self._servos.settle()

    def take_over(self, other: DriveController | None) -> None:
        """Continue the odometry and the command of another drive, if there is one."""
        self.settle()
        base = ORIGIN if other is None else other._odometry.base(*other._servos.angles())
        self._odometry.start_at(base, *self._servos.angles())
        if other is not None:
            self.drive_at(*other._controller.target, other._controller.deadline)

    def shift_time(self, steps: int) -> None:
        """Shift the deadline after the time was set back by `steps`."""
        if self._controller.deadline is not None:
            self._controller.deadline -= steps

    def save(self) -> SavedDrive:
        """The state for `restore`."""
        return self._controller.save(), self._odometry.state, self._servos.state, self.is_driving

    def restore(self, saved: SavedDrive) -> None:
        commanded, self._odometry.state, self._servos.state, self.is_driving = saved
        self._controller.restore(commanded)
