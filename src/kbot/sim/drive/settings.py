"""How a description's own plugin or controller drives: its sizes, limits, topics and frames."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import chain
from math import inf, isfinite

from kbot.kinematics.controllers import drive_plugins, steering_plugins
from kbot.kinematics.differential_drive import DifferentialDrive
from kbot.messages.types import Twist, TwistStamped
from kbot.model import Robot
from kbot.sim.drive.sizes import ABSURD, compared, compared_radius
from kbot.sim.drive.twist_controller import DriveLimits
from kbot.sim.joint_control.controllers_yaml import Parameters, diff_drive_parameters
from kbot.sim.naming import PLAIN, Naming
from kbot.sim.plugin_names import PluginNames, is_of_gazebo_ros
from kbot.sim.recipe import ANGULAR_ACCELERATION, LINEAR_ACCELERATION, WATCHDOG
from kbot.text import Element, Origin
from kbot.text.numbers import to_float
from kbot.world.findings import Findings

DEFAULT_LIMITS = DriveLimits()
TRACK = "distance between the wheels"
_DIAMETER = ("wheelDiameter", "wheel_diameter")


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
    robot: Robot, drive: DifferentialDrive, findings: Findings, naming: Naming = PLAIN
) -> DriveSettings:
    """Read the robot's own settings; what it does not say is taken from its shapes and the defaults. `naming`
    is what the simulation calls it."""
    plugin = next(chain(drive_plugins(robot), steering_plugins(robot)), None)
    if plugin is not None:
        values = _PluginValues(plugin, findings)
        settings = _from_plugin(values, drive)
        if not is_of_gazebo_ros(plugin):
            return settings
        names = PluginNames(plugin, naming)
        return dataclasses.replace(
            settings,
            command_topic=names.topic(settings.command_topic),
            odometry_topic=names.topic(settings.odometry_topic),
        )
    found = diff_drive_parameters(robot, findings)
    if found is not None:
        return _from_controller(found, drive, findings)
    return DriveSettings(drive.radius, drive.separation)


class _PluginValues:
    """Numbers and words of a `<plugin>`, by whichever of several names is there."""

    def __init__(self, plugin: Element, findings: Findings) -> None:
        self._plugin, self.findings = plugin, findings

    def element(self, *names: str) -> Element | None:
        return next((e for name in names if (e := self._plugin.find(name)) is not None), None)

    def place(self, *names: str) -> Origin | None:
        element = self.element(*names)
        return element.origin if element is not None else None

    def word(self, default: str, *names: str) -> str:
        element = self.element(*names)
        return (element.text.strip() if element is not None else "") or default

    def number(self, *names: str) -> float | None:
        """A finite number, None where it is not there or, with a finding, is none."""
        element = self.element(*names)
        if element is None:
            return None
        try:
            value = to_float(element.text)
        except ValueError:
            value = inf
        if not isfinite(value):
            self.findings.warning(
                "W130", f"<{element.tag}> is not a number: '{element.text.strip()}'", element.origin,
                "it is left out",
            )  # fmt: skip
            return None
        return value

    def positive(self, *names: str) -> float | None:
        """A number above zero, None where there is none, or 0, or, with a finding, one below."""
        value, element = self.number(*names), self.element(*names)
        if value is not None and element is not None and value < 0.0:
            self.findings.warning(
                "W130", f"<{element.tag}> is above zero, not {value:g}", element.origin, "it is left out"
            )
        return value if value is not None and value > 0.0 else None


def _from_plugin(values: _PluginValues, drive: DifferentialDrive) -> DriveSettings:
    separation = values.positive("wheelSeparation", "wheel_separation")
    diameter = values.positive(*_DIAMETER)
    radius = values.positive("wheel_radius")
    is_diameter = radius is None
    if radius is None and diameter is not None:
        radius = diameter / 2.0
    if separation is not None:
        place = values.place("wheelSeparation", "wheel_separation")
        separation = compared(TRACK, separation, drive.separation, place, values.findings)
    if radius is not None:
        place = values.place(*_DIAMETER) if is_diameter else values.place("wheel_radius")
        radius = compared_radius(radius, drive, place, values.findings, is_diameter=is_diameter)
    _note_source(values)
    rim = values.positive("wheelAcceleration", "max_wheel_acceleration")
    half = (separation or drive.separation) / 2.0
    linear = values.positive("max_linear_acceleration", "max_acceleration")
    angular = values.positive("max_angular_acceleration")
    if rim is not None:
        # the rim's acceleration in m/s^2 bounds both ways of moving
        linear, angular = linear or rim, angular or min(rim / half, ANGULAR_ACCELERATION)
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
        radius or drive.radius,
        separation or drive.separation,
        limits,
        values.positive("wheelTorque", "max_wheel_torque"),
        command_topic=values.word("cmd_vel", "commandTopic", "command_topic", "topic"),
        odometry_topic=values.word("odom", "odometryTopic", "odometry_topic", "odom_topic"),
        odometry_frame=values.word("odom", "odometryFrame", "odometry_frame", "frame_id"),
    )


def _note_source(values: _PluginValues) -> None:
    """Gazebo Classic's drive can tell the model's own pose as odometry: `world`, in ROS 2 the number 1."""
    element = values.element("odometrySource", "odometry_source")
    if element is not None and element.text.strip() in ("world", "1"):
        values.findings.info(
            "W139",
            f"<{element.tag}> asks for the robot's own pose in the world as odometry: here it is reckoned"
            " from the wheels, and drifts as theirs does",
            element.origin,
            "write encoder, or in ROS 2 the number 0: a real robot has no other",
        )


def _below_zero(value: float | None) -> float | None:
    """How far below zero a least value lies; None where there is none, or it is not below."""
    return -value if value is not None and value < 0.0 else None


def _from_controller(found: Parameters, drive: DifferentialDrive, findings: Findings) -> DriveSettings:
    values = found.values

    def number(name: str, default: float) -> float:
        value = values.get(name, default)
        if isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value):
            return float(value)
        if not (isinstance(value, float) and value != value):
            what = f"{name} of the controller is no number: {value}"
            findings.warning("W130", what, found.place(name))
        return default

    def multiplier(name: str, default: float = 1.0) -> float:
        value = number(name, default)
        if 1.0 / ABSURD <= value <= ABSURD:
            return value
        what = f"{name} of the controller is {value:g}: it is left out"
        findings.warning("W130", what, found.place(name), "a multiplier is above zero and near 1")
        return default

    separation, radius = number("wheel_separation", 0.0), number("wheel_radius", 0.0)
    if separation:
        place = found.place("wheel_separation")
        separation = compared(TRACK, separation, drive.separation, place, findings)
    if radius:
        radius = compared_radius(radius, drive, found.place("wheel_radius"), findings)
    separation, radius = separation or drive.separation, radius or drive.radius
    separation *= multiplier("wheel_separation_multiplier")
    both = multiplier("wheel_radius_multiplier")
    radius *= sum(multiplier(f"{side}_wheel_radius_multiplier", both) for side in ("left", "right")) / 2.0
    return DriveSettings(
        radius,
        separation,
        _controller_limits(values, number, switched_on=found.ros == 2),
        watchdog=number("cmd_vel_timeout", WATCHDOG) or WATCHDOG,
        odometry_frame=str(values.get("odom_frame_id", "odom")),
        controller=found.controller,
        ros=found.ros,
        is_stamped=found.ros == 2 and values.get("use_stamped_vel") is not False,
    )


def _controller_limits(
    values: Mapping[str, object], number: Callable[[str, float], float], *, switched_on: bool
) -> DriveLimits:
    """`switched_on`: whether limits hold where no `has_…_limits` says so, which ROS 1 always wants."""

    def limit(axis: str, kind: str, end: str = "max") -> float | None:
        """A limit that is given and, in versions with `has_…_limits`, switched on."""
        if values.get(f"{axis}.has_{kind}_limits", switched_on) is False:
            return None
        value = number(f"{axis}.{end}_{kind}", 0.0)
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
