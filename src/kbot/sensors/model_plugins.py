"""Reads sensors that are model plugins of Gazebo Classic (p3d, IMU, GPS), and reports unsupported plugins."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import PurePosixPath

from kbot.kinematics.drive.declared import declared_drives
from kbot.kinematics.transform import Transform
from kbot.model import RobotModel
from kbot.model.extensions import extensions
from kbot.sensors.imu import Imu
from kbot.sensors.noise import NONE, Noise
from kbot.sensors.position import Gps, GroundTruth
from kbot.sensors.readers import Keywords
from kbot.sensors.sdf_values import SensorValues
from kbot.sensors.sensor import Spec
from kbot.sim.naming import Naming
from kbot.sim.plugin_topics import PluginNames
from kbot.text import Diagnostic, Element, KbotError
from kbot.text.numbers import to_float
from kbot.text.suggest import did_you_mean

Read = Callable[[SensorValues, Keywords], Spec]

_WITHOUT: Mapping[str, str] = {
    "gazebo_ros_kobuki": "KBot subscribes to cmd_vel and publishes odom, and each sensor has its own topic. "
    "Remap mobile_base/commands/velocity to cmd_vel. mobile_base/events is not published",
    "gazebo_ros_create": "KBot subscribes to cmd_vel and publishes odom, and each sensor has its own topic. "
    "turtlebot_node/sensor_state is not published",
    "gazebo_ros_video": "the robot's screen stays blank",
    "warthog_suspension_plugin": "its joints have no springs: make them fixed or use a controller",
    "sawyer_gazebo_ros_control": "use libgazebo_ros_control.so to command its joints",
}
"""What happens without a plugin that is not run, by its library."""

_ELSEWHERE = (
    "ros_control",
    "ros2_control",
    "joint_state_publisher",
    "joint_pose_trajectory",
    "gz-",
    "ignition-",
)
"""Words in the library names of plugins that another part of KBot simulates or reports."""


def model_plugins(robot: RobotModel, naming: Naming, diagnostics: list[Diagnostic]) -> Iterator[Spec]:
    """The sensors among a robot's plugins. Errors, and plugins that are not run, go to `diagnostics`."""
    driving = [controller.plugin for controller in declared_drives(robot)]
    for plugin in _plugins(robot):
        values = SensorValues(plugin, diagnostics)
        library = _library(plugin)
        read = _READERS.get(library)
        if read is not None:
            yield from _sensor(values, read, robot, naming)
        elif not any(plugin is drive for drive in driving) and not _is_handled_elsewhere(plugin):
            hint = _WITHOUT.get(library, "the rest of the robot is simulated")
            message = f"KBot does not run the plugin {plugin.attributes.get('filename', '')}"
            values.inform(message, plugin, hint)


def _plugins(robot: RobotModel) -> Iterator[Element]:
    """The plugins of the model, of its links and of their visuals. Plugins of sensors are read elsewhere."""
    for extension in extensions(robot, "gazebo"):
        yield from extension.elements("plugin")
        for visual in extension.elements("visual"):
            yield from visual.elements("plugin")


def _library(plugin: Element) -> str:
    """The library of a plugin: `gazebo_ros_p3d` for `libgazebo_ros_p3d.so`."""
    return PurePosixPath(plugin.attributes.get("filename", "").strip()).stem.removeprefix("lib")


def _is_handled_elsewhere(plugin: Element) -> bool:
    library, name = _library(plugin), plugin.attributes.get("name", "")
    is_of_gz = name.startswith(("gz::", "ignition::"))
    return library not in _WITHOUT and (is_of_gz or any(word in library for word in _ELSEWHERE))


def _sensor(values: SensorValues, read: Read, robot: RobotModel, naming: Naming) -> Iterator[Spec]:
    plugin = values.element
    link = values.text("bodyName", "body_name")
    if link not in robot.links:
        hint = did_you_mean(link, robot.links)
        what = f"unknown link '{link}'" if link else "the plugin has no <bodyName>"
        values.error(what + (f": {hint}" if hint else ""), values.find("bodyName", "body_name") or plugin)
        return
    before = sum(d.is_error for d in values.diagnostics)
    topic = values.text("topicName", "topic_name")
    common: Keywords = {
        "link": link,
        "name": plugin.attributes.get("name", ""),
        "origin": plugin.origin,
    }
    rate = values.number(0.0, "updateRate", "update_rate")
    if rate:
        common["rate"] = rate
    try:
        spec = read(values, common)
    except KbotError as error:
        values.error(str(error).removeprefix(f"{common['name']}: "), plugin)
        return
    default = _TOPICS.get(_library(plugin), spec.label)
    if sum(d.is_error for d in values.diagnostics) == before:
        yield replace(spec, topic=PluginNames(plugin, naming).topic(topic or default))


def _p3d(values: SensorValues, common: Keywords) -> Spec:
    spread = abs(values.number(0.0, "gaussianNoise", "gaussian_noise"))
    return GroundTruth(
        fixed_frame=values.text("frameName", "frame_name").strip("/") or "world",
        offset=_offset(values),
        noise=Noise(stddev=spread),
        **common,
    )


def _imu(values: SensorValues, common: Keywords) -> Spec:
    """Read gazebo_ros_imu. The offsets are the sensor's pose on its link."""
    spread = abs(values.number(0.0, "gaussianNoise", "gaussian_noise"))
    noise = Noise(stddev=spread)
    return Imu(gyroscope=noise, accelerometer=noise, **common, pose=_offset(values))


def _hector_imu(values: SensorValues, common: Keywords) -> Spec:
    return Imu(
        gyroscope=_hector_noise(values, "rate"),
        accelerometer=_hector_noise(values, "accel"),
        frame=values.text("frameId").rsplit("/", 1)[-1],
        pose=_offset(values),
        **common,
    )


def _hector_gps(values: SensorValues, common: Keywords) -> Spec:
    """Read hector_gazebo_ros_gps.

    Its x axis points north at a reference heading of 0, and east at 90 degrees, as in KBot's worlds.
    """
    heading = values.find("referenceHeading")
    turned = values.number(0.0, "referenceHeading")
    if turned != 90.0:
        values.warn(
            f"a reference heading of {turned:g} degrees is not simulated: x points east and y north"
            " (90 degrees)",
            heading or values.element,
        )
    velocity = values.find("velocityTopicName")
    if velocity is not None:
        values.warn("the velocity is not published: use the odometry of a p3d plugin instead", velocity)
    spread = _numbers(values, "gaussianNoise")
    drift, time = _numbers(values, "drift"), _drift_time(values, "driftFrequency")
    return Gps(
        latitude=values.number(49.860246, "referenceLatitude"),
        longitude=values.number(8.687077, "referenceLongitude"),
        altitude=values.number(0.0, "referenceAltitude"),
        horizontal=_drifting(spread[0], drift[0], time),
        vertical=_drifting(spread[2], drift[2], time),
        frame=values.text("frameId").rsplit("/", 1)[-1],
        **common,
    )


def _hector_noise(values: SensorValues, what: str) -> Noise:
    """The noise of the x axis, which is used for all three axes."""
    drift = _numbers(values, f"{what}Drift")[0]
    time = _drift_time(values, f"{what}DriftFrequency")
    return _drifting(_numbers(values, f"{what}GaussianNoise")[0], drift, time)


def _drift_time(values: SensorValues, name: str) -> float:
    """The correlation time of a drift in s: an hour if no frequency (Hz) is given, as in hector_gazebo."""
    frequency = values.number(1.0 / 3600.0, name)
    return 1.0 / frequency if frequency > 0.0 else math.inf


def _drifting(stddev: float, drift: float, time: float) -> Noise:
    """White noise, and a bias that drifts with the long-term standard deviation `drift`."""
    if not (stddev or drift):
        return NONE
    if math.isinf(time):
        return Noise(stddev=abs(stddev), bias_stddev=abs(drift))
    # the long-term standard deviation of an Ornstein-Uhlenbeck process is walk sqrt(time / 2)
    return Noise(stddev=abs(stddev), walk=abs(drift) * math.sqrt(2.0 / time), correlation_time=time)


def _offset(values: SensorValues) -> Transform:
    """`<xyzOffsets>` in m and `<rpyOffsets>` in rad."""
    xyz = _numbers(values, "xyzOffsets", "xyz_offsets", "xyz_offset", "xyzOffset")
    rpy = _numbers(values, "rpyOffsets", "rpy_offsets", "rpy_offset", "rpyOffset")
    return Transform.from_xyz_rpy(xyz, rpy)


def _numbers(values: SensorValues, *names: str) -> tuple[float, float, float]:
    """Three numbers, or one number for all three. Zeros if none is given."""
    found = values.find(*names)
    if found is None:
        return 0.0, 0.0, 0.0
    try:
        numbers = [to_float(word) for word in found.text.split()]
        x, y, z = numbers * 3 if len(numbers) == 1 else numbers
        if not all(map(math.isfinite, (x, y, z))):
            raise ValueError
    except ValueError:
        values.error(f"<{found.tag}> must be one or three finite numbers, not '{found.text.strip()}'", found)
        return 0.0, 0.0, 0.0
    return x, y, z


_READERS: Mapping[str, Read] = {
    "gazebo_ros_p3d": _p3d,
    "gazebo_ros_imu": _imu,
    "hector_gazebo_ros_imu": _hector_imu,
    "hector_gazebo_ros_gps": _hector_gps,
}
_TOPICS = {"gazebo_ros_p3d": "odom", "hector_gazebo_ros_imu": "imu", "hector_gazebo_ros_gps": "fix"}
"""Default topics. Other plugins use their own name."""
