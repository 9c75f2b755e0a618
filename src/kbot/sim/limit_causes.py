"""Limits of a drive's controller and motors that cause what `MotionWatch` observed."""

from __future__ import annotations

from functools import cached_property
from math import hypot, inf, radians

from kbot.kinematics.controller_files import Parameter
from kbot.kinematics.drive.declared import DeclaredDrive, declared_drives, drive_controller
from kbot.kinematics.drive.drive import DifferentialDrive, SteeredDrive
from kbot.kinematics.transform import Transform
from kbot.sim.cause import LEAST_SHARE, Cause, percent
from kbot.sim.command_watch import Miss
from kbot.sim.drive.settings import TORQUE, DriveSettings
from kbot.sim.drive.twist_controller import Twist
from kbot.sim.engine.engine import Engine
from kbot.sim.engine.joints import resistance
from kbot.sim.motion_watch import Excess, Standstill, Weakness
from kbot.sim.recipe import LINEAR_ACCELERATION
from kbot.sim.robot import SimulatedRobot
from kbot.sim.statics import mass_of
from kbot.text import Origin

_SAME = 0.01
"""Share by which a declared size may differ, as in D105 and D106."""
_SLOWEST = 0.05
"""Share of its highest speed at which a robot ordinarily drives at least."""

_LOWER_SPEED = "command a lower speed, in m/s and rad/s"
_REAL_TORQUE = "write the motor's torque, or the robot's real mass"

_NO_DRIVE = DifferentialDrive((), (), {}, {}, 1.0, 1.0, "", Transform.identity(), ())
_NO_SETTINGS = DriveSettings(1.0, 1.0)
"""The drive of a robot that cannot drive: it has neither wheels nor limits."""


class LimitCauses:
    """What the limits of a robot's `controller` and motors allow.

    `drive` and `settings` are the robot's. Without a drive they have neither wheels nor limits.
    """

    def __init__(self, engine: Engine, robot: SimulatedRobot) -> None:
        self._engine, self._robot, self._model = engine, robot, robot.robot
        self.drive = robot.drive if isinstance(robot.drive, DifferentialDrive) else _NO_DRIVE
        self.settings = robot.settings or _NO_SETTINGS

    # the controller

    @cached_property
    def controller(self) -> DeclaredDrive | None:
        """The plugin or controller that drives the robot."""
        return drive_controller(declared_drives(self._model))

    def _given(self, *names: str) -> Parameter | None:
        """The first given one of these tags or parameters of the plugin or controller that drives."""
        return None if self.controller is None else self.controller.first(*names)

    @property
    def acceleration(self) -> float:
        """The acceleration in m/s^2 that the drive's controller asks for at most."""
        limit = self.settings.limits.linear_acceleration
        return limit if limit < inf else LINEAR_ACCELERATION

    def of_excess(self, seen: Excess) -> Cause:
        """The limit of speed that a command exceeds by far."""
        text, origin = self._speed_limit_of(seen.allowed, seen.axis)
        small = _in_small_unit(seen)
        return Cause(text, origin, f"cmd_vel takes m/s and rad/s: {small}" if small else _LOWER_SPEED)

    def of_standstill(self, seen: Standstill) -> Cause:
        """The limit of speed, or of acceleration, that holds the wheels back now."""
        wanted, wheels = self._robot.commanded_twist, self._robot.wheels
        x, y, yaw = wanted.x, wanted.y, wanted.yaw
        is_turn = self.drive.separation / 2.0 * abs(yaw) > hypot(x, y)
        unit, speed = ("rad/s", abs(yaw)) if is_turn else ("m/s", hypot(x, y))
        axis = _main_axis((x, y, yaw), is_turn=is_turn)
        fastest = wheels.fastest[axis] if wheels is not None else inf
        if fastest < speed:
            limit, origin = self._speed_limit_of(fastest, axis)
            text = f"the limits of the drive allow only {percent(seen.allowed)} of the commanded speed"
            return Cause(f"{text}: {limit}", origin, "raise the velocity limit, or command a lower speed")
        limits = self.settings.limits
        most = (limits.linear_acceleration, limits.lateral_acceleration, limits.angular_acceleration)[axis]
        given = self._given(*_limit_names("acceleration", axis))
        whose = "KBot's default limit" if given is None else "its limit"
        text = f"reaching {speed:g} {unit} takes {speed / most:.4g} s with {whose} of {most:.3g} {unit}^2"
        return Cause(text, _origin(given), _LOWER_SPEED)

    def of_miss(self, seen: Miss) -> Cause | None:
        """The limit of the controller that explains most of a miss, or None."""
        return self._limit_of(seen) or self._steering_limit(seen)

    def _limit_of(self, seen: Miss) -> Cause | None:
        """The limit of speed, acceleration or jerk that explains most of a miss."""
        wheels, controller = self._robot.wheels, self.controller
        axis = _main_axis(seen.wanted, is_turn=seen.is_turn)
        asked = seen.wanted[axis] * seen.seconds
        if wheels is None or not asked:
            return None
        own, without_jerk = (
            1.0 - wheels.reach(seen.wanted, seen.seconds, has_jerk=has_jerk)[axis] / asked
            for has_jerk in (True, False)
        )
        if own < LEAST_SHARE * (1.0 - seen.share):
            return None
        if wheels.fastest[axis] < abs(seen.wanted[axis]) * (1.0 - _SAME):
            text, origin = self._speed_limit_of(wheels.fastest[axis], axis)
            return Cause(text, origin, "command a lower speed, or raise the limit", is_limit=True)
        kind = "jerk" if without_jerk < LEAST_SHARE * own else "acceleration"
        given = self._given(*_limit_names(kind, axis))
        if controller is None or given is None:
            return None
        text = f"{controller.name} limits its {kind} with {given.name} = {given.text}"
        hint = "command it for longer, or raise the limit"
        return Cause(text, given.origin, hint, is_fault=False, is_limit=True)

    def _speed_limit_of(self, speed: float, axis: int) -> tuple[str, Origin | None]:
        """What limits the speed on an axis to m/s or rad/s, and where it is written: the controller, or the
        joint of a wheel."""
        joints, controller = self._model.joints, self.controller
        given = self._given(*_limit_names("velocity", axis))
        if controller is not None and given is not None and given.number == speed:
            return f"{controller.name} limits it with {given.name}", given.origin
        name = min(self.drive.joints, key=lambda joint: joints[joint].speed_limit, default="")
        limit = joints[name].limit if name else None
        if limit is None:
            return "the limits of the drive", None
        return f"'{name}' has a velocity limit of {joints[name].speed_limit:g} rad/s", limit.origin

    def _steering_limit(self, seen: Miss) -> Cause | None:
        """The limit of the steering angles that allows only wider curves than the commanded one."""
        drive = self.drive
        if not isinstance(drive, SteeredDrive) or not seen.is_turn:
            return None
        right, left = drive.curvatures
        x, _, yaw = seen.wanted
        sharpest = min(left, -right) if not x else left if yaw * x > 0.0 else -right
        sharpest = min(sharpest, self.settings.curvature)
        if sharpest == inf or abs(yaw) <= sharpest * abs(x) * (1.0 + _SAME):
            return None
        origin = _origin(self._given("steering_limit"))
        if origin is None or sharpest != self.settings.curvature:
            module = min(drive.modules, key=lambda module: min(module.curvatures[1], -module.curvatures[0]))
            joint = self._model.joints[module.steering or module.rolls]
            origin = joint.origin if joint.limit is None else joint.limit.origin
        text = f"its steering limits allow no curve with a radius below {1.0 / sharpest:.3g} m"
        return Cause(text, origin, "command a wider curve, or raise the limit", is_limit=True)

    # the motors

    def motor_acceleration(self) -> float:
        """The acceleration in m/s^2 that the torque limits of the driving joints allow on level ground,
        infinite without one. A limit also turns the wheels and rotors."""
        drive, model = self.drive, self._engine.model
        if not drive.joints:
            return inf
        torque, turning = 0.0, 0.0
        for name in drive.joints:
            dof = self._robot.body.dof(name)
            torque += self._torque_limit(name)[2]
            body, axis = model.dof_bodyid[dof], drive.wheels[name].axis
            turning += float(model.dof_armature[dof]) + float(model.body_inertia[body] @ (axis * axis))
        return torque / drive.radius / (mass_of(model, self._robot) + turning / drive.radius**2)

    def of_slow_start(self, seen: Miss) -> Cause | None:
        """A torque limit with which the start takes so long that it explains the missing way: half of the
        speed for the longer time."""
        able = self.motor_acceleration()
        if able == inf or seen.is_turn:
            return None
        speed = hypot(*seen.wanted[:2])
        start = min(speed / able, seen.seconds)
        missing = (start - speed / self.acceleration) / (2.0 * seen.seconds)
        return self.of_motors(able, is_fault=False) if missing >= LEAST_SHARE * (1.0 - seen.share) else None

    def of_motors(self, able: float, *, is_fault: bool = True) -> Cause:
        """The lowest torque limit of the driving joints. All of them allow `able` m/s^2."""
        joints = self._model.joints
        weakest = min(self.drive.joints, key=lambda joint: joints[joint].effort_limit, default="")
        limit, origin, most = self._torque_limit(weakest)
        text = f"{limit} of '{weakest}' is {most:.3g} N m, which allows {able:.2g} m/s^2"
        return Cause(text, origin, _REAL_TORQUE, is_fault)

    def of_resistance(self, seen: Weakness | None) -> Cause | None:
        """The damping and friction of a driving joint, if its torque limit is too small for these alone."""
        if seen is None:
            return None
        damping, friction = resistance(self._model.joints[seen.joint])
        needed = damping * seen.commanded + friction
        if needed <= seen.most:
            return None
        limit, origin, _ = self._torque_limit(seen.joint)
        text = (
            f"{limit} of '{seen.joint}' is {seen.most:.3g} N m, but at {seen.commanded:.3g} rad/s its damping"
            f" and friction need {needed:.3g} N m, {needed / seen.most:.3g} times as much"
        )
        return Cause(text, origin, f"write at least {needed:.3g} N m, or the joint's real <dynamics>")

    def of_motor(self, joint: str) -> Cause:
        """A driving joint whose motor is at its torque limit."""
        limit, origin, most = self._torque_limit(joint)
        return Cause(f"the motor of '{joint}' is at {limit} of {most:.3g} N m", origin, _REAL_TORQUE)

    def _torque_limit(self, joint: str) -> tuple[str, Origin | None, float]:
        """What limits the torque of a motor, where it is written, and to how many N m."""
        own, limit = self.settings.torque or inf, self._model.joints[joint].limit
        effort = self._model.joints[joint].effort_limit
        if effort <= own:
            return "the effort limit", None if limit is None else limit.origin, effort
        return "the drive's torque limit", _origin(self._given(*TORQUE)), own


def _main_axis(twist: Twist, *, is_turn: bool) -> int:
    """The axis of a motion in a twist: 0 forwards, 1 sideways, 2 for the turn."""
    x, y, _ = twist
    return 2 if is_turn else int(abs(y) > abs(x))


def _limit_names(kind: str, axis: int) -> tuple[str, ...]:
    """The tags and parameters that limit the velocity, acceleration or jerk on an axis.

    They are read in this order by `drive_settings`. gz applies `max_velocity` to driving and turning alike.
    """
    what, where = (("linear", "linear.x"), ("linear", "linear.y"), ("angular", "angular.z"))[axis]
    rim = ("wheelAcceleration", "max_wheel_acceleration") if kind == "acceleration" else ()
    return (f"max_{what}_{kind}", f"max_{kind}", f"{where}.max_{kind}", *rim)


def _origin(given: Parameter | None) -> Origin | None:
    return None if given is None else given.origin


def _in_small_unit(seen: Excess) -> str:
    """What the command is if it means mm/s or degrees/s, or nothing if that does not fit the drive."""
    given = abs(seen.commanded)
    meant, small, unit = (
        (radians(given), "degrees/s", "rad/s") if seen.is_turn else (given / 1000.0, "mm/s", "m/s")
    )
    if not _SLOWEST * seen.allowed <= meant <= seen.allowed:
        return ""
    return f"{given:g} {small} are {meant:.3g} {unit}"
