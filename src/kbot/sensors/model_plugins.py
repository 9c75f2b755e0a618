"""Sensors that are plugins of a whole model in Gazebo Classic (p3d, IMU, GPS), and plugins that KBot does not
run."""

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

_UNLIKE: Mapping[str, str] = {
    "gazebo_ros_planar_move": "no base goes sideways here: it stands, or drives as its wheels do",
    "gazebo_ros_kobuki": "the base drives by its wheels, on cmd_vel and odom, and its sensors are heard one "
    "by one: remap mobile_base/commands/velocity; there are no mobile_base/events",
    "gazebo_ros_create": "the base drives by its wheels, on cmd_vel and odom, and its sensors are heard one "
    "by one: there is no turtlebot_node/sensor_state",
    "gazebo_ros_video": "nothing is shown on a robot's screen",
    "warthog_suspension_plugin": "nothing springs its joints: fix them, or have a controller hold them",
    "sawyer_gazebo_ros_control": "libgazebo_ros_control.so has its joints commanded",
}
"""What becomes of a robot whose plugin is not run, by its library."""

_ELSEWHERE = (
    "ros_control",
    "ros2_control",
    "joint_state_publisher",
    "joint_pose_trajectory",
    "gz-",
    "ignition-",
)
"""Words in the libraries of plugins whose work is done, or whose lack is said, elsewhere."""


def model_plugins(robot: RobotModel, naming: Naming, diagnostics: list[Diagnostic]) -> Iterator[Spec]:
    """The sensors among a robot's plugins; what cannot be read, or is not run, is in the diagnostics."""
    driving = [controller.plugin for controller in declared_drives(robot)]
    for plugin in _plugins(robot):
        values = SensorValues(plugin, diagnostics)
        library = _library(plugin)
        read = _READERS.get(library)
        if read is not None:
            yield from _sensor(values, read, robot, naming)
        elif not any(plugin is one for one in driving) and not _is_done_elsewhere(plugin):
            hint = _UNLIKE.get(library, "the rest of the robot is simulated")
            values.inform(f"the plugin {plugin.attributes.get('filename', '')} is not run", plugin, hint)


def _plugins(robot: RobotModel) -> Iterator[Element]:
    """Those of the model, of its links and of what is seen of them; a sensor's are read with the sensor."""
    for extension in extensions(robot, "gazebo"):
        yield from extension.elements("plugin")
        for visual in extension.elements("visual"):
            yield from visual.elements("plugin")


def _library(plugin: Element) -> str:
    """`gazebo_ros_p3d` of `libgazebo_ros_p3d.so`."""
    return PurePosixPath(plugin.attributes.get("filename", "").strip()).stem.removeprefix("lib")


def _is_done_elsewhere(plugin: Element) -> bool:
    library, name = _library(plugin), plugin.attributes.get("name", "")
    is_of_gz = name.startswith(("gz::", "ignition::"))
    return library not in _UNLIKE and (is_of_gz or any(word in library for word in _ELSEWHERE))


def _sensor(values: SensorValues, read: Read, robot: RobotModel, naming: Naming) -> Iterator[Spec]:
    plugin = values.element
    link = values.text("bodyName", "body_name")
    if link not in robot.links:
        hint = did_you_mean(link, robot.links)
        what = f"there is no link '{link}'" if link else "it has no <bodyName>"
        values.error(what + (f": {hint}" if hint else ""), values.find("bodyName", "body_name") or plugin)
        return
    before = len([one for one in values.diagnostics if one.is_error])
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
    if len([one for one in values.diagnostics if one.is_error]) == before:
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
    """The offsets turn and move what is said to be the sensor's place on its link."""
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
    """Its x points north at a heading of 0 and east at 90 degrees, which is how a world lies here."""
    heading = values.find("referenceHeading")
    turned = values.number(0.0, "referenceHeading")
    if turned != 90.0:
        values.warn(
            f"a reference heading of {turned:g} degrees is left out: x points east and y north, which is 90",
            heading or values.element,
        )
    velocity = values.find("velocityTopicName")
    if velocity is not None:
        values.warn("a speed is not told: the place is, and the speed in the truth of a p3d plugin", velocity)
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
    """What is said of the x axis stands for all three."""
    drift = _numbers(values, f"{what}Drift")[0]
    time = _drift_time(values, f"{what}DriftFrequency")
    return _drifting(_numbers(values, f"{what}GaussianNoise")[0], drift, time)


def _drift_time(values: SensorValues, name: str) -> float:
    """Seconds in which a drift comes back: an hour, where no frequency (Hz) is given."""
    frequency = values.number(1.0 / 3600.0, name)
    return 1.0 / frequency if frequency > 0.0 else math.inf


def _drifting(stddev: float, drift: float, time: float) -> Noise:
    """White noise, and a bias that wanders with the deviation `drift` in the long run."""
    if not (stddev or drift):
        return NONE
    if math.isinf(time):
        return Noise(stddev=abs(stddev), bias_stddev=abs(drift))
    # of an Ornstein-Uhlenbeck process: what it spreads by in the long run is walk sqrt(time / 2)
    return Noise(stddev=abs(stddev), walk=abs(drift) * math.sqrt(2.0 / time), correlation_time=time)


def _offset(values: SensorValues) -> Transform:
    """`<xyzOffsets>` in m and `<rpyOffsets>` in rad."""
    xyz = _numbers(values, "xyzOffsets", "xyz_offsets", "xyz_offset", "xyzOffset")
    rpy = _numbers(values, "rpyOffsets", "rpy_offsets", "rpy_offset", "rpyOffset")
    return Transform.from_xyz_rpy(xyz, rpy)


def _numbers(values: SensorValues, *names: str) -> tuple[float, float, float]:
    """Three numbers, or one that counts three times; 0 where there is none."""
    found = values.find(*names)
    if found is None:
        return 0.0, 0.0, 0.0
    try:
        numbers = [to_float(word) for word in found.text.split()]
        x, y, z = numbers * 3 if len(numbers) == 1 else numbers
        if not all(map(math.isfinite, (x, y, z))):
            raise ValueError
    except ValueError:
        values.error(f"<{found.tag}> is one finite number or three, not '{found.text.strip()}'", found)
        return 0.0, 0.0, 0.0
    return x, y, z


_READERS: Mapping[str, Read] = {
    "gazebo_ros_p3d": _p3d,
    "gazebo_ros_imu": _imu,
    "hector_gazebo_ros_imu": _hector_imu,
    "hector_gazebo_ros_gps": _hector_gps,
}
_TOPICS = {"gazebo_ros_p3d": "odom", "hector_gazebo_ros_imu": "imu", "hector_gazebo_ros_gps": "fix"}
"""Where they speak unless they are told: else by their own name."""
