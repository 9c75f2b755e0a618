"""The plugins and controllers that KBot replaces, and what it does with each of their settings.

Their settings are in programs.tsv, one line per setting, with the names and defaults of their sources. The
page docs/reference/plugin-settings.md and the finding W149 come from the same table."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from kbot.kinematics.controller_files import Parameter, controller_parameters
from kbot.model import RobotModel
from kbot.model.extensions import gazebo_plugins
from kbot.text import Diagnostic, DiagnosticCollector, Element, Severity
from kbot.text.numbers import to_float

FAR = 1e12
"""The variance that Gazebo Classic's drives report for z, roll and pitch, which they do not measure."""

ODOMETRY, TRANSFORM, RATE, SOURCE, OPEN_LOOP = "odometry", "transform", "rate", "source", "open_loop"
TOPIC, TRANSFORM_TOPIC = "odometry_topic", "transform_topic"
FRAME, BASE, PREFIX, PREFIX_ENABLE = "odometry_frame", "base_frame", "prefix", "prefix_enable"
POSE_COVARIANCE, TWIST_COVARIANCE = "pose_covariance", "twist_covariance"
COVARIANCES = ("covariance_x", "covariance_y", "covariance_yaw")
IGNORED, SAME = "no", "same"
"""What KBot does with a setting: it ignores it, or the setting makes no difference in KBot. With any other
word, KBot uses the setting, and the words above name its purpose."""

Diagonal = tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Setting:
    """A setting of a program, with the text of its default and of its effect.

    `kbot` is what KBot does with it: `IGNORED`, `SAME`, or what it uses it for, joined by `+`."""

    name: str
    default: str
    kbot: str
    effect: str

    def has_role(self, role: str) -> bool:
        return role in self.kbot.split("+")


@dataclass(frozen=True, slots=True)
class Program:
    """A plugin of Gazebo or a controller of ROS.

    title       its name in the documentation
    words       a pattern for a controller's type, or for what `words_of` a plugin returns
    source      where its settings come from: a repository, a branch or version, and a file
    ros         1 or 2 for a controller, 0 for a plugin
    pose, twist the variances in its odometry, unless it has settings for these
    needs_rate  True if it publishes no odometry at a rate of 0, where others publish at every step
    """

    key: str
    title: str
    words: str
    source: str
    ros: int = 0
    pose: Diagonal = (0.0,) * 6
    twist: Diagonal = (0.0,) * 6
    needs_rate: bool = False

    @property
    def settings(self) -> tuple[Setting, ...]:
        return _table().get(self.key, ())

    def of_role(self, role: str) -> tuple[Setting, ...]:
        return tuple(setting for setting in self.settings if setting.has_role(role))


def _planar(x: float, y: float, yaw: float) -> Diagonal:
    return x, y, FAR, FAR, FAR, yaw


_CLASSIC = _planar(1e-5, 1e-5, 1e-3)
_GAZEBO_1 = "gazebo_ros_pkgs, noetic-devel, gazebo_plugins/src/{}.cpp"
_GAZEBO_2 = "gazebo_ros_pkgs, ros2, gazebo_plugins/src/{}.cpp"
_GZ = "gz-sim, src/systems/{}.cc"
_ROS_1 = "ros_controllers, noetic-devel, {}"
_ROS_2 = "ros2_controllers, humble and master, {}"


def _gz(key: str, name: str, folder: str) -> Program:
    word, file = name.lower(), folder.replace("_", "")
    words = rf"systems::{word}$|(gzsim|ignitiongazebo)\d*{file}system"
    return Program(key, f"gz {name}", words, _GZ.format(f"{folder}/{name}"))


def _classic_1(key: str, file: str, pose: Diagonal = _CLASSIC, twist: Diagonal = (0.0,) * 6) -> Program:
    words = file.replace("_", "")
    return Program(key, f"{file}, ROS 1", words, _GAZEBO_1.format(file), 0, pose, twist)


def _classic_2(key: str, file: str, twist: Diagonal = _CLASSIC) -> Program:
    words = file.replace("_", "")
    return Program(key, f"{file}, ROS 2", words, _GAZEBO_2.format(file), 0, _CLASSIC, twist)


_SKID = _planar(1e-4, 1e-4, 1e-2)
PROGRAMS: tuple[Program, ...] = (
    _classic_2("diff_drive_2", "gazebo_ros_diff_drive"),
    _classic_1("diff_drive_1", "gazebo_ros_diff_drive"),
    _classic_1("skid_steer_1", "gazebo_ros_skid_steer_drive", _SKID, _SKID),
    _classic_2("planar_move_2", "gazebo_ros_planar_move"),
    Program(
        "planar_move_1",
        "gazebo_ros_planar_move, ROS 1",
        "gazeborosplanarmove",
        _GAZEBO_1.format("gazebo_ros_planar_move"),
        pose=_CLASSIC,
        needs_rate=True,
    ),
    Program(
        "force_based_move",
        "gazebo_ros_force_based_move, ROS 1",
        "forcebasedmove",
        "hector_gazebo, hector_gazebo_plugins/src/gazebo_ros_force_based_move.cpp",
        # while it turns, the plugin reports 100 for the yaw
        pose=_planar(1e-3, 1e-3, 1e-2),
        needs_rate=True,
    ),
    _classic_2("tricycle_2", "gazebo_ros_tricycle_drive", (0.0,) * 6),
    _classic_1("tricycle_1", "gazebo_ros_tricycle_drive"),
    _classic_2("ackermann_2", "gazebo_ros_ackermann_drive"),
    _classic_2("joint_states_2", "gazebo_ros_joint_state_publisher"),
    _classic_1("joint_states_1", "gazebo_ros_joint_state_publisher"),
    _classic_2("p3d_2", "gazebo_ros_p3d"),
    _classic_1("p3d_1", "gazebo_ros_p3d"),
    _gz("gz_diff_drive", "DiffDrive", "diff_drive"),
    _gz("gz_mecanum", "MecanumDrive", "mecanum_drive"),
    _gz("gz_ackermann", "AckermannSteering", "ackermann_steering"),
    _gz("gz_velocity_control", "VelocityControl", "velocity_control"),
    _gz("gz_tracked_vehicle", "TrackedVehicle", "tracked_vehicle"),
    _gz("gz_track_controller", "TrackController", "track_controller"),
    _gz("gz_joint_states", "JointStatePublisher", "joint_state_publisher"),
    _gz("gz_odometry_publisher", "OdometryPublisher", "odometry_publisher"),
    _gz("gz_pose_publisher", "PosePublisher", "pose_publisher"),
    Program(
        "ros2_diff_drive",
        "diff_drive_controller, ROS 2",
        "diff_drive_controller/.*",
        _ROS_2.format("diff_drive_controller/src/diff_drive_controller_parameter.yaml"),
        2,
    ),
    Program(
        "ros2_mecanum",
        "mecanum_drive_controller, ROS 2",
        "mecanum_drive_controller/.*",
        _ROS_2.format("mecanum_drive_controller/src/mecanum_drive_controller.yaml"),
        2,
    ),
    Program(
        "ros2_omni",
        "omni_wheel_drive_controller, ROS 2",
        "omni_wheel_drive_controller/.*",
        _ROS_2.format("omni_wheel_drive_controller/src/omni_wheel_drive_controller_parameters.yaml"),
        2,
    ),
    Program(
        "ros2_steering",
        "ackermann_steering_controller, bicycle_steering_controller, tricycle_steering_controller, ROS 2",
        "(ackermann|bicycle|tricycle)_steering_controller/.*",
        _ROS_2.format("steering_controllers_library/src/steering_controllers_library.yaml"),
        2,
    ),
    Program(
        "ros2_tricycle",
        "tricycle_controller, ROS 2",
        "tricycle_controller/.*",
        _ROS_2.format("tricycle_controller/src/tricycle_controller_parameter.yaml"),
        2,
    ),
    Program(
        "ros2_joint_states",
        "joint_state_broadcaster, ROS 2",
        "joint_state_broadcaster/.*",
        _ROS_2.format("joint_state_broadcaster/src/joint_state_broadcaster_parameters.yaml"),
        2,
    ),
    Program(
        "ros2_imu",
        "imu_sensor_broadcaster, ROS 2",
        "imu_sensor_broadcaster/.*",
        _ROS_2.format("imu_sensor_broadcaster/src/imu_sensor_broadcaster_parameters.yaml"),
        2,
    ),
    Program(
        "ros2_wrench",
        "force_torque_sensor_broadcaster, ROS 2",
        "force_torque_sensor_broadcaster/.*",
        _ROS_2.format("force_torque_sensor_broadcaster/src/force_torque_sensor_broadcaster_parameters.yaml"),
        2,
    ),
    Program(
        "ros1_diff_drive",
        "diff_drive_controller, ROS 1",
        "diff_drive_controller/.*",
        _ROS_1.format("diff_drive_controller/src/diff_drive_controller.cpp"),
        1,
    ),
    Program(
        "ros1_ackermann",
        "ackermann_steering_controller, ROS 1",
        "ackermann_steering_controller/.*",
        _ROS_1.format("ackermann_steering_controller/src/ackermann_steering_controller.cpp"),
        1,
    ),
    Program(
        "ros1_joint_states",
        "joint_state_controller, ROS 1",
        "joint_state_controller/.*",
        _ROS_1.format("joint_state_controller/src/joint_state_controller.cpp"),
        1,
    ),
)
"""A plugin for ROS 2 comes before the one for ROS 1 that has the same file."""


@cache
def _table() -> Mapping[str, tuple[Setting, ...]]:
    """The settings of each program. A line has one or more settings with the same default and effect."""
    found: dict[str, list[Setting]] = {}
    for line in Path(__file__).with_suffix(".tsv").read_text("utf-8").splitlines()[1:]:
        key, names, default, kbot, effect = line.split("\t")
        found.setdefault(key, []).extend(Setting(name, default, kbot, effect) for name in names.split(", "))
    return {key: tuple(settings) for key, settings in found.items()}


def program_of_plugin(words: str, given: Iterable[str]) -> Program | None:
    """The program of a plugin by its file and name, which `words_of` returns, and the names of its tags.

    Plugins for ROS 1 and ROS 2 have the same file, so the one with most of the tags counts. None if KBot does
    not know the file, or none of its tags."""
    tags = set(given)
    known = [p for p in PROGRAMS if not p.ros and re.search(p.words, words)]
    if not tags:
        return known[0] if known else None
    counts = [sum(setting.name in tags for setting in program.settings) for program in known]
    most = max(counts, default=0)
    return known[counts.index(most)] if most else None


def program_of_controller(kind: str, ros: int) -> Program | None:
    """The program of a controller by its type and the ROS that it is for, 1 or 2."""
    return next((p for p in PROGRAMS if p.ros == ros and re.fullmatch(p.words, kind)), None)


def tags_of(plugin: Element) -> dict[str, Parameter]:
    """A plugin's tags by name, those inside a tag as `tag.name`; the first of several tags with one name."""
    given: dict[str, Parameter] = {}
    for element in plugin.elements():
        given.setdefault(element.tag, tag_parameter(element))
    for element in plugin.elements():
        for inner in element.elements():
            given.setdefault(f"{element.tag}.{inner.tag}", tag_parameter(inner))
    return given


def tag_parameter(element: Element) -> Parameter:
    return Parameter(element.tag, element.text.strip(), element.text_origin, element.origin)


def words_of(plugin: Element) -> str:
    """A plugin's file and name in lower case, without `_` and `-`."""
    words = (plugin.attributes.get("filename", "") + plugin.attributes.get("name", "")).lower()
    return words.replace("_", "").replace("-", "")


def setting_findings(robot: RobotModel) -> Iterator[Diagnostic]:
    """W149: the settings of plugins and controllers that KBot ignores and that change what these do."""
    for name, program, given, is_plugin in _programs(robot):
        for setting in program.settings:
            found = given.get(setting.name)
            if found is None or setting.kbot != IGNORED or _is_default(found, setting.default):
                continue
            if _is_mirrored(found, given.get(setting.name.replace("min_", "max_"))):
                continue  # KBot applies the limit of one direction to both
            tag = f"<{setting.name}>" if is_plugin else setting.name
            message = f"{name}: KBot ignores {tag} ({setting.effect})"
            yield Diagnostic("W149", Severity.INFO, message, found.key)


def _programs(robot: RobotModel) -> Iterator[tuple[str, Program, Mapping[str, Parameter], bool]]:
    """Each known plugin and controller: its name, its program, its settings, and whether it is a plugin."""
    for plugin in gazebo_plugins(robot):
        given = tags_of(plugin)
        program = program_of_plugin(words_of(plugin), given)
        if program is not None:
            yield plugin.attributes.get("name", program.title), program, given, True
    for found in controller_parameters(robot, DiagnosticCollector()):
        program = program_of_controller(found.kind, found.ros)
        if program is not None:
            yield found.controller, program, found.given, False


def _is_default(given: Parameter, default: str) -> bool:
    """Whether a setting has its default, written in any way. If there is no default, it is an empty text."""
    if given.is_nan or given.text.strip() == default:
        return True
    if isinstance(given.value, list):
        return _numbers(map(str, given.value)) == _numbers(default.strip("[]").split(","))
    if given.boolean is not None and default in ("true", "false"):
        return given.boolean is (default == "true")
    numbers = _numbers(default.split())
    return numbers is not None and _numbers(given.text.split()) == numbers


def _is_mirrored(low: Parameter, high: Parameter | None) -> bool:
    """Whether the limits of both directions are equal."""
    return high is not None and None not in (low.number, high.number) and low.number == -(high.number or 0.0)


def _numbers(words: Iterable[str]) -> list[float] | None:
    try:
        return [to_float(word) for word in words if word.strip()]
    except ValueError:
        return None
