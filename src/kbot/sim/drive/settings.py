"""Reads the settings of a robot's own drive plugin or controller: sizes, limits, topics and frames."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, pi, sin

from kbot.kinematics.controller_files import Parameter
from kbot.kinematics.drive.declared import (
    DIAMETER,
    LEVERS,
    RADII,
    SEPARATION,
    SPANS,
    WHEELBASE,
    WHEELBASE_MULTIPLIER,
    DeclaredDrive,
    Holonomic,
    declared_drives,
    drive_controller,
    track_controllers,
)
from kbot.kinematics.drive.drive import DifferentialDrive, SteeredDrive
from kbot.messages.types import Twist, TwistStamped
from kbot.model import RobotModel
from kbot.sim.drive.odometry_settings import OdometrySettings, Source, odometry_settings
from kbot.sim.drive.twist_controller import DriveLimits
from kbot.sim.naming import ROOT_NAMING, Naming
from kbot.sim.plugin_topics import PluginNames, is_of_gazebo_ros
from kbot.sim.recipe import ANGULAR_ACCELERATION, LINEAR_ACCELERATION, WATCHDOG
from kbot.text import DiagnosticCollector

DEFAULT_LIMITS = DriveLimits()
DEFAULT_ODOMETRY = OdometrySettings()
TORQUE = ("wheelTorque", "max_wheel_torque")
"""The names of a plugin's torque limit of a wheel, N m."""
ABSURD = 1000.0
"""A size that is this many times too large or too small is replaced by the one measured on the robot.

Smaller errors are simulated as written.
"""


@dataclass(frozen=True, slots=True)
class DriveSettings:
    """The settings of a drive controller.

    `radius`, `separation` and, for a drive that steers, `wheelbase` (m) are the sizes that the controller
    computes with, right or wrong. `torque` is the limit of a wheel in N m, or None. `rim_speed` is the
    highest speed of a track in m/s. `curvature` (1/m) and `steering_rate` (rad/s) are the limits of a drive
    that steers. `watchdog` is in s.
    """

    radius: float
    separation: float
    limits: DriveLimits = DEFAULT_LIMITS
    torque: float | None = None
    wheelbase: float | None = None
    curvature: float = inf
    steering_rate: float = inf
    watchdog: float = WATCHDOG
    command_topic: str = "cmd_vel"
    odometry_topic: str = "odom"
    odometry_frame: str = "odom"
    odometry: OdometrySettings = DEFAULT_ODOMETRY
    controller: str = ""
    """The full name of the controller that drives. It has topics under this name too."""
    rim_speed: float = inf
    own_command: str = "cmd_vel"
    """The controller's own command topic, below its name."""
    own_odometry: str = "odom"
    """The controller's own topic of odometry, below its name."""
    is_stamped: bool = False
    """Whether the controller subscribes to TwistStamped.

    ROS 2's does, unless `use_stamped_vel` (Humble) is false.
    """

    @property
    def command_topics(self) -> Mapping[str, type[Twist] | type[TwistStamped]]:
        """The command topics with their message types.

        The page and a twist_mux publish on `command_topic`. The controller has its own topic besides.
        """
        topics: dict[str, type[Twist] | type[TwistStamped]] = {self.command_topic: Twist}
        if self.controller:
            topics[f"{self.controller}/{self.own_command}"] = TwistStamped if self.is_stamped else Twist
        return topics

    @property
    def odometry_topics(self) -> tuple[str, ...]:
        """The topics on which odometry is published."""
        if not self.odometry.is_published:
            return ()
        own = [f"{self.controller}/{self.own_odometry}"] if self.controller else []
        return (self.odometry_topic, *own)

    def with_controller_sizes(self, drive: DifferentialDrive) -> DifferentialDrive:
        """The drive with the sizes that the controller computes with."""
        if isinstance(drive, SteeredDrive):
            wheelbase = self.wheelbase or drive.wheelbase
            limits = self.curvature, self.steering_rate
            return drive.with_sizes(self.radius, self.separation, wheelbase, *limits)
        return dataclasses.replace(drive, radius=self.radius, separation=self.separation)


def drive_settings(
    robot: RobotModel, drive: DifferentialDrive, findings: DiagnosticCollector, naming: Naming = ROOT_NAMING
) -> DriveSettings:
    """Read the settings of the robot's own controller.

    Missing values come from the robot's shapes and the defaults. `naming` has the robot's names in the
    simulation.
    """
    controller = drive_controller(declared_drives(robot))
    if controller is None:
        return DriveSettings(drive.radius, drive.separation)
    values = _Values(controller, findings)
    if controller.holonomic is None:
        radius, separation = _radius(values, drive.radius), _separation(values, drive.separation)
    else:
        radius, separation = _holonomic_sizes(values, controller.holonomic, drive)
    read = _of_controller if controller.plugin is None else _of_plugin
    settings = read(values, radius, separation)
    odometry = odometry_settings(robot, controller, naming, findings)
    _note_source(values, odometry)
    settings = dataclasses.replace(settings, odometry=odometry)
    if isinstance(drive, SteeredDrive):
        settings = _with_steering(values, settings, drive)
    if controller.plugin is None:
        return settings
    if controller.holonomic is Holonomic.TRACKS:
        settings = dataclasses.replace(settings, rim_speed=_track_speed(robot, controller))
    if not is_of_gazebo_ros(controller.plugin):
        return settings
    names = PluginNames(controller.plugin, naming)
    return dataclasses.replace(
        settings,
        command_topic=names.topic(settings.command_topic),
        odometry_topic=names.topic(settings.odometry_topic),
    )


class _Values:
    """Reads values of a plugin or controller. Each value may have one of several names."""

    def __init__(self, controller: DeclaredDrive, findings: DiagnosticCollector) -> None:
        self.controller, self.findings = controller, findings

    def word(self, default: str, *names: str) -> str:
        """A text. The default if it is not given, is empty, or is a list (reported as W130)."""
        given = self.controller.first(*names)
        if given is not None and isinstance(given.value, list):
            self._warn("W130", given, f"must be a text, not '{given.text}'", f"KBot uses '{default}'")
            return default
        return (given.text if given is not None else "") or default

    def is_false(self, name: str) -> bool:
        given = self.controller.first(name)
        return given is not None and given.value is False

    def number(self, *names: str) -> float | None:
        """A finite number. None if it is not given, or is not a number (reported as W130)."""
        given = self.controller.first(*names)
        if given is None or given.is_nan:
            return None
        if given.number is None:
            self._warn("W130", given, f"must be a number, not '{given.text}'", "KBot ignores the value")
        return given.number

    def positive(self, *names: str) -> float | None:
        """A number above 0. None if it is not given, is 0, or is negative (reported as W130)."""
        given, value = self.controller.first(*names), self.number(*names)
        if given is not None and value is not None and value < 0.0:
            self._warn("W130", given, f"must be above 0, not {value:g}", "KBot ignores the value")
        return value if value is not None and value > 0.0 else None

    def size(self, true: float, *names: str) -> float | None:
        """A size in m above 0. None if it is not given, or is absurd (reported as W131).

        `true` is the size measured on the robot.
        """
        given, value = self.controller.first(*names), self.positive(*names)
        if given is None or value is None or true / ABSURD <= value <= true * ABSURD:
            return value
        what = f"is {value:g} m, but the robot has {true:g} m: KBot uses {true:g} m"
        self._warn("W131", given, what, f"write {true:g}")
        return None

    def multiplier(self, name: str) -> float:
        given, value = self.controller.first(name), self.number(name)
        if given is None or value is None:
            return 1.0
        if 1.0 / ABSURD <= value <= ABSURD:
            return value
        what = f"must be above 0 and near 1, not {value:g}"
        self._warn("W130", given, what, "KBot ignores the value and uses 1")
        return 1.0

    def _warn(self, code: str, given: Parameter, what: str, hint: str) -> None:
        name = given.name if self.controller.plugin is None else f"<{given.name}>"
        self.findings.warning(code, f"{name} {what}", given.origin, hint)


def _separation(values: _Values, true: float) -> float:
    """The distance between the wheels that the controller computes with, m."""
    given = values.size(true, *SEPARATION) or true
    return given * values.multiplier("wheel_separation_multiplier")


def _radius(values: _Values, true: float) -> float:
    """The radius of the wheels that the controller computes with, m."""
    radius, diameter = values.size(true, *RADII), values.size(2.0 * true, *DIAMETER)
    given = radius or (diameter / 2.0 if diameter is not None else true)
    factors = [values.multiplier(name) for name in values.controller.radius_multipliers]
    return given * (sum(factors) / len(factors))


def _holonomic_sizes(values: _Values, kind: Holonomic, drive: DifferentialDrive) -> tuple[float, float]:
    """The radius and the separation that a holonomic drive computes with, m. See `HolonomicDrive`."""
    if kind is Holonomic.BODY:
        return drive.radius, drive.separation
    if kind is Holonomic.TRACKS:
        values.positive("steering_efficiency")  # reports a wrong value
        separation = values.size(drive.separation, *SEPARATION) or 1.0  # gz's default
        return drive.radius, separation / values.controller.steering_efficiency
    radius = _radius(values, drive.radius)
    half = values.size(drive.separation / 2.0, *LEVERS)
    if half is not None:
        return radius, 2.0 * half
    for along, across in SPANS:
        x, y = (values.size(drive.separation, name) for name in (along, across))
        if x is not None and y is not None:
            sizes = ((x, along), (y, across))
            x, y = (s * values.multiplier(values.controller.span_multiplier(name)) for s, name in sizes)
            return radius, x + y
    return radius, drive.separation


def _with_steering(values: _Values, settings: DriveSettings, drive: SteeredDrive) -> DriveSettings:
    """The settings of a drive that steers: gz's AckermannSteering, and controllers of ros_control."""
    wheelbase = values.size(drive.wheelbase, *WHEELBASE)
    if wheelbase is not None:
        wheelbase *= values.multiplier(WHEELBASE_MULTIPLIER)
    end, rate = values.positive("steering_limit"), values.positive("steering.max_velocity")
    # tricycle_controller limits the speed of the wheel
    speed, acceleration = (values.positive(f"traction.max_{kind}") for kind in ("velocity", "acceleration"))
    limits = settings.limits
    if speed is not None:
        limits = dataclasses.replace(limits, linear_velocity=speed * settings.radius)
    if acceleration is not None:
        limits = dataclasses.replace(limits, linear_acceleration=acceleration * settings.radius)
    return dataclasses.replace(
        settings,
        limits=limits,
        wheelbase=wheelbase,
        curvature=sin(min(end, pi / 2.0)) / (wheelbase or drive.wheelbase) if end is not None else inf,
        steering_rate=rate or inf,
    )


def _of_plugin(values: _Values, radius: float, separation: float) -> DriveSettings:
    return DriveSettings(
        radius,
        separation,
        _plugin_limits(values, separation),
        values.positive(*TORQUE),
        watchdog=values.positive("cmdVelTimeOut", "cmdTimeout") or WATCHDOG,
        command_topic=values.word("cmd_vel", "commandTopic", "command_topic", "topic"),
        odometry_topic=values.word("odom", "odometryTopic", "odometry_topic", "odom_topic"),
        odometry_frame=values.word("odom", "odometryFrame", "odometry_frame", "frame_id"),
    )


def _plugin_limits(values: _Values, separation: float) -> DriveLimits:
    kind = values.controller.holonomic
    if kind is Holonomic.BODY:
        return DEFAULT_LIMITS  # these plugins ignore the tags of other drives
    if kind is Holonomic.TRACKS:
        # as the parameters of a controller, but as tags
        return _controller_limits(values, "linear_velocity", "", "angular_velocity", is_on=True)
    rim = values.positive("wheelAcceleration", "max_wheel_acceleration")
    linear = values.positive("max_linear_acceleration", "max_acceleration")
    angular = values.positive("max_angular_acceleration", "max_acceleration")
    if rim is not None:
        # the acceleration of the wheel's rim in m/s^2 limits both driving and turning
        linear, angular = linear or rim, angular or min(rim / (separation / 2.0), ANGULAR_ACCELERATION)
    limits = DriveLimits(
        linear_velocity=values.positive("max_linear_velocity", "max_velocity") or inf,
        angular_velocity=values.positive("max_angular_velocity", "max_velocity") or inf,
        linear_acceleration=linear or LINEAR_ACCELERATION,
        angular_acceleration=angular or ANGULAR_ACCELERATION,
        reverse_velocity=_below_zero(values.number("min_linear_velocity", "min_velocity")),
        linear_deceleration=_below_zero(values.number("min_linear_acceleration", "min_acceleration")) or None,
        angular_deceleration=_below_zero(values.number("min_angular_acceleration", "min_acceleration"))
        or None,
        linear_jerk=values.positive("max_linear_jerk", "max_jerk") or inf,
        angular_jerk=values.positive("max_angular_jerk", "max_jerk") or inf,
    )
    if kind is not None:
        # gz's MecanumDrive applies the same limits in each direction, and to the turn
        limits = dataclasses.replace(
            limits,
            lateral_velocity=limits.linear_velocity,
            lateral_acceleration=limits.linear_acceleration,
            lateral_jerk=limits.linear_jerk,
        )
    return limits


def _track_speed(robot: RobotModel, controller: DeclaredDrive) -> float:
    """The lowest limit of the TrackControllers of a vehicle, m/s."""
    tracks = {track.text for side in controller.sides.values() for track in side}
    given = [tags.get("max_velocity") for link, tags in track_controllers(robot).items() if link in tracks]
    speeds = [tag.number for tag in given if tag is not None and tag.number and tag.number > 0.0]
    return min(speeds, default=inf)


def _note_source(values: _Values, odometry: OdometrySettings) -> None:
    """W139: a drive whose setting makes the true pose its odometry.

    It is Gazebo Classic's default too. KBot computes odometry from the wheels then, as a real robot does.
    """
    given = values.controller.first("odometrySource", "odometry_source")
    if odometry.source is Source.TRUTH and given is not None:
        values.findings.info(
            "W139",
            f"<{given.name}> makes the robot's true pose its odometry, so it does not drift",
            given.origin,
            "write encoder, or in ROS 2 the number 0: a real robot does not know its true pose",
        )


def _below_zero(value: float | None) -> float | None:
    """The magnitude of a negative value. None for other values."""
    return -value if value is not None and value < 0.0 else None


def _of_controller(values: _Values, radius: float, separation: float) -> DriveSettings:
    controller = values.controller
    is_stamped = controller.ros == 2 and not values.is_false("use_stamped_vel")
    # mecanum_drive_controller of ros2_controllers has other topics than its copies with other parameters. So
    # have ROS 2's controllers that steer, except for tricycle_controller
    kind = controller.given.get("type")
    steers = controller.is_steering and controller.ros == 2
    is_tricycle = kind is not None and kind.text.startswith("tricycle_controller/")
    has_references = controller.first("kinematics.wheels_radius") is not None or (steers and not is_tricycle)
    command = "reference" if has_references else "cmd_vel"
    timeout = values.number("cmd_vel_timeout", "reference_timeout")
    if timeout is not None and is_tricycle and controller.ros == 2:
        timeout /= 1000.0  # tricycle_controller gives it in ms
    return DriveSettings(
        radius,
        separation,
        # ROS 2: limits apply unless a `has_…_limits` is false. ROS 1: only if it is true.
        _controller_limits(values, is_on=controller.ros == 2),
        watchdog=timeout or WATCHDOG,
        odometry_frame=values.word("odom", "odom_frame_id"),
        controller=controller.name,
        own_command=command if controller.ros == 1 or is_stamped else f"{command}_unstamped",
        own_odometry="odometry" if has_references else "odom",
        is_stamped=is_stamped,
    )


def _controller_limits(
    values: _Values, x: str = "linear.x", y: str = "linear.y", z: str = "angular.z", *, is_on: bool
) -> DriveLimits:
    """The limits of the three axes, whose names start with these words. `is_on`: without a switch."""

    def limit(axis: str, kind: str, end: str = "max") -> float | None:
        """A limit that is given and, if there are `has_…_limits`, switched on."""
        switch = values.controller.first(f"{axis}.has_{kind}_limits")
        if (switch.value if switch is not None else is_on) is False:
            return None
        value = values.number(f"{axis}.{end}_{kind}") or 0.0
        value = -value if end == "min" else value
        return value if value > 0.0 else None

    return DriveLimits(
        linear_velocity=limit(x, "velocity") or inf,
        angular_velocity=limit(z, "velocity") or inf,
        linear_acceleration=limit(x, "acceleration") or LINEAR_ACCELERATION,
        angular_acceleration=limit(z, "acceleration") or ANGULAR_ACCELERATION,
        reverse_velocity=limit(x, "velocity", "min"),
        linear_deceleration=limit(x, "acceleration", "min"),
        angular_deceleration=limit(z, "acceleration", "min"),
        linear_jerk=limit(x, "jerk") or inf,
        angular_jerk=limit(z, "jerk") or inf,
        lateral_velocity=limit(y, "velocity") or inf,
        lateral_acceleration=limit(y, "acceleration") or LINEAR_ACCELERATION,
        lateral_jerk=limit(y, "jerk") or inf,
    )
