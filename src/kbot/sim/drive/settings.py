"""The settings of a robot's own drive plugin or controller: sizes, limits, topics and frames."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from math import inf

from kbot.kinematics.controller_files import Parameter
from kbot.kinematics.drive.declared import (
    DIAMETER,
    RADIUS,
    SEPARATION,
    DeclaredDrive,
    declared_drives,
    drive_controller,
)
from kbot.kinematics.drive.drive import DifferentialDrive
from kbot.messages.types import Twist, TwistStamped
from kbot.model import RobotModel
from kbot.sim.drive.twist_controller import DriveLimits
from kbot.sim.naming import ROOT_NAMING, Naming
from kbot.sim.plugin_topics import PluginNames, is_of_gazebo_ros
from kbot.sim.recipe import ANGULAR_ACCELERATION, LINEAR_ACCELERATION, WATCHDOG
from kbot.text import DiagnosticCollector

DEFAULT_LIMITS = DriveLimits()
ABSURD = 1000.0
"""A size that is this many times too large or too small is replaced by the robot's own."""


@dataclass(frozen=True, slots=True)
class DriveSettings:
    """`radius` and `separation` (m) are those that the controller reckons with, right or wrong.

    `torque` (N m) and `watchdog` (s) are None where nothing is said.
    """

    radius: float
    separation: float
    limits: DriveLimits = DEFAULT_LIMITS
    torque: float | None = None
    watchdog: float = WATCHDOG
    command_topic: str = "cmd_vel"
    odometry_topic: str = "odom"
    odometry_frame: str = "odom"
    controller: str = ""
    """The full name of the controller that drives: it hears and tells on its own topics too."""
    ros: int = 2
    """Whose controller it is, ROS 1's or ROS 2's."""
    is_stamped: bool = False
    """Whether that hears TwistStamped, as ROS 2's does unless Humble's `use_stamped_vel` is false."""

    @property
    def command_topics(self) -> Mapping[str, type[Twist] | type[TwistStamped]]:
        """All on which twists are heard, and how: the controller's own besides `command_topic`, where a page
        and a twist_mux speak."""
        topics: dict[str, type[Twist] | type[TwistStamped]] = {self.command_topic: Twist}
        if self.controller:
            own = "cmd_vel" if self.ros == 1 or self.is_stamped else "cmd_vel_unstamped"
            topics[f"{self.controller}/{own}"] = TwistStamped if self.is_stamped else Twist
        return topics

    @property
    def odometry_topics(self) -> tuple[str, ...]:
        """All on which odometry is told."""
        return (self.odometry_topic, *([f"{self.controller}/odom"] if self.controller else []))

    def reckoned(self, drive: DifferentialDrive) -> DifferentialDrive:
        """The drive as the controller takes it to be."""
        return dataclasses.replace(drive, radius=self.radius, separation=self.separation)


def drive_settings(
    robot: RobotModel, drive: DifferentialDrive, findings: DiagnosticCollector, naming: Naming = ROOT_NAMING
) -> DriveSettings:
    """Read the robot's own settings. What it does not give comes from its shapes and the defaults. `naming`
    is what the simulation calls it."""
    controller = drive_controller(declared_drives(robot))
    if controller is None:
        return DriveSettings(drive.radius, drive.separation)
    values = _Values(controller, findings)
    radius, separation = _radius(values, drive.radius), _separation(values, drive.separation)
    if controller.plugin is None:
        return _of_controller(values, radius, separation)
    settings = _of_plugin(values, radius, separation)
    if not is_of_gazebo_ros(controller.plugin):
        return settings
    names = PluginNames(controller.plugin, naming)
    return dataclasses.replace(
        settings,
        command_topic=names.topic(settings.command_topic),
        odometry_topic=names.topic(settings.odometry_topic),
    )


class _Values:
    """Numbers and words that a plugin or controller is given, by whichever of several names is there."""

    def __init__(self, controller: DeclaredDrive, findings: DiagnosticCollector) -> None:
        self.controller, self.findings = controller, findings

    def word(self, default: str, *names: str) -> str:
        given = self.controller.first(*names)
        return (given.text if given is not None else "") or default

    def is_false(self, name: str) -> bool:
        given = self.controller.first(name)
        return given is not None and given.value is False

    def number(self, *names: str) -> float | None:
        """A finite number; None where it is not given or, with a finding, is not one."""
        given = self.controller.first(*names)
        if given is None or given.value != given.value:  # NaN in YAML: no limit
            return None
        if given.number is None:
            self._leave_out("W130", given, f"is not a number: '{given.text}'", "it is left out")
        return given.number

    def positive(self, *names: str) -> float | None:
        """A number above zero; None where it is not given, is 0 or, with a finding, is below."""
        given, value = self.controller.first(*names), self.number(*names)
        if given is not None and value is not None and value < 0.0:
            self._leave_out("W130", given, f"is above zero, not {value:g}", "it is left out")
        return value if value is not None and value > 0.0 else None

    def size(self, true: float, *names: str) -> float | None:
        """A size in m, above zero; None where it is not given or, with a finding, is absurd. `true` is the
        robot's own."""
        given, value = self.controller.first(*names), self.positive(*names)
        if given is None or value is None or true / ABSURD <= value <= true * ABSURD:
            return value
        what = f"is {value:g} m, and {true:g} m on the robot: KBot uses {true:g} m"
        self._leave_out("W131", given, what, f"write {true:g}")
        return None

    def multiplier(self, name: str, default: float = 1.0) -> float:
        given, value = self.controller.first(name), self.number(name)
        if given is None or value is None:
            return default
        if 1.0 / ABSURD <= value <= ABSURD:
            return value
        self._leave_out(
            "W130", given, f"is {value:g}: it is left out", "a multiplier is above zero and near 1"
        )
        return default

    def _leave_out(self, code: str, given: Parameter, what: str, hint: str) -> None:
        name = given.name if self.controller.plugin is None else f"<{given.name}>"
        self.findings.warning(code, f"{name} {what}", given.origin, hint)


def _separation(values: _Values, true: float) -> float:
    """The distance between the wheels that the controller computes with, m."""
    given = values.size(true, *SEPARATION) or true
    return given * values.multiplier("wheel_separation_multiplier")


def _radius(values: _Values, true: float) -> float:
    """The radius of the wheels that the controller computes with, m."""
    radius, diameter = values.size(true, RADIUS), values.size(2.0 * true, *DIAMETER)
    given = radius or (diameter / 2.0 if diameter is not None else true)
    both = values.multiplier("wheel_radius_multiplier")
    left, right = (values.multiplier(f"{side}_wheel_radius_multiplier", both) for side in ("left", "right"))
    return given * ((left + right) / 2.0)


def _of_plugin(values: _Values, radius: float, separation: float) -> DriveSettings:
    _note_source(values)
    rim = values.positive("wheelAcceleration", "max_wheel_acceleration")
    linear = values.positive("max_linear_acceleration", "max_acceleration")
    angular = values.positive("max_angular_acceleration")
    if rim is not None:
        # the rim's acceleration in m/s^2 bounds both ways of moving
        linear, angular = linear or rim, angular or min(rim / (separation / 2.0), ANGULAR_ACCELERATION)
    limits = DriveLimits(
        linear_velocity=values.positive("max_linear_velocity", "max_velocity") or inf,
        angular_velocity=values.positive("max_angular_velocity") or inf,
        linear_acceleration=linear or LINEAR_ACCELERATION,
        angular_acceleration=angular or ANGULAR_ACCELERATION,
        reverse_velocity=_below_zero(values.number("min_linear_velocity", "min_velocity")),
        linear_deceleration=_below_zero(values.number("min_linear_acceleration", "min_acceleration")) or None,
        angular_deceleration=_below_zero(values.number("min_angular_acceleration")) or None,
        linear_jerk=values.positive("max_linear_jerk", "max_jerk") or inf,
        angular_jerk=values.positive("max_angular_jerk") or inf,
    )
    return DriveSettings(
        radius,
        separation,
        limits,
        values.positive("wheelTorque", "max_wheel_torque"),
        command_topic=values.word("cmd_vel", "commandTopic", "command_topic", "topic"),
        odometry_topic=values.word("odom", "odometryTopic", "odometry_topic", "odom_topic"),
        odometry_frame=values.word("odom", "odometryFrame", "odometry_frame", "frame_id"),
    )


def _note_source(values: _Values) -> None:
    """Gazebo Classic's drive can publish the model's own pose as odometry: `world`, in ROS 2 the number 1."""
    source = values.controller.first("odometrySource", "odometry_source")
    if source is not None and source.text in ("world", "1"):
        values.findings.info(
            "W139",
            f"<{source.name}> asks for the robot's own pose in the world as odometry: here it is computed"
            " from the wheels, and drifts as theirs does",
            source.origin,
            "write encoder, or in ROS 2 the number 0: a real robot has no other",
        )


def _below_zero(value: float | None) -> float | None:
    """How far below zero a least value lies; None where there is none, or it is not below."""
    return -value if value is not None and value < 0.0 else None


def _of_controller(values: _Values, radius: float, separation: float) -> DriveSettings:
    controller = values.controller
    return DriveSettings(
        radius,
        separation,
        # limits hold where no `has_…_limits` is given, which ROS 1 always requires
        _controller_limits(values, switched_on=controller.ros == 2),
        watchdog=values.number("cmd_vel_timeout") or WATCHDOG,
        odometry_frame=values.word("odom", "odom_frame_id"),
        controller=controller.name,
        ros=controller.ros,
        is_stamped=controller.ros == 2 and not values.is_false("use_stamped_vel"),
    )


def _controller_limits(values: _Values, *, switched_on: bool) -> DriveLimits:
    def limit(axis: str, kind: str, end: str = "max") -> float | None:
        """A limit that is given and, in versions with `has_…_limits`, switched on."""
        switch = values.controller.first(f"{axis}.has_{kind}_limits")
        if (switch.value if switch is not None else switched_on) is False:
            return None
        value = values.number(f"{axis}.{end}_{kind}") or 0.0
        value = -value if end == "min" else value
        return value if value > 0.0 else None

    x, z = "linear.x", "angular.z"
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
    )
