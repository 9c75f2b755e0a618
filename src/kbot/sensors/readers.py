"""Reads a `<sensor>` of Gazebo Classic or gz as a spec."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from kbot.sensors.camera import Camera
from kbot.sensors.contact import Contact
from kbot.sensors.force_torque import ForceTorque
from kbot.sensors.imu import Imu
from kbot.sensors.lidar import Lidar
from kbot.sensors.noise import Noise
from kbot.sensors.position import Gps
from kbot.sensors.proximity import Range
from kbot.sensors.sdf_values import SensorValues
from kbot.sensors.sensor import Spec
from kbot.sim.naming import ROOT_NAMING, Naming
from kbot.sim.plugin_topics import PluginNames, is_of_gazebo_ros
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean

_ROS1_CAMERA = ("cameraName", "imageTopicName", "cameraInfoTopicName")
_NAMED = ("topicName", "topic_name", "bumperTopicName")


def sensor_topics(values: SensorValues, naming: Naming, *, has_pictures: bool) -> dict[str, str]:
    """The spec's `topic`, and for a camera `info_topic` and `depth_topic`. Missing ones keep their default.

    The topics of gazebo_ros plugins are full names.
    """
    plugin = values.find("plugin")
    if plugin is None or not (
        is_of_gazebo_ros(plugin) or any(plugin.find(tag) is not None for tag in (*_ROS1_CAMERA, *_NAMED))
    ):
        return _of_gz(values, has_pictures=has_pictures)
    names = PluginNames(plugin, naming)
    if has_pictures:
        return {key: names.topic(name) for key, name in _pictures(values, names).items()}
    own = values.text(*(f"plugin/{tag}" for tag in _NAMED))
    if not own and names.is_ros_2:
        own = "bumper_states" if "bumper" in plugin.attributes.get("filename", "") else "~/out"
    own = own or values.element.attributes.get("name", "").strip()
    return {"topic": names.topic(own)} if own else {}


def _pictures(values: SensorValues, names: PluginNames) -> dict[str, str]:
    """The topics of a camera plugin.

    In ROS 2 they are below `<camera_name>`, or else below the sensor's name. In ROS 1 they are below
    `<cameraName>`, or else in the plugin's namespace itself.
    """
    if names.is_ros_2 or values.find(*(f"plugin/{tag}" for tag in _ROS1_CAMERA)) is None:
        name = values.text("plugin/camera_name") or values.element.attributes.get("name", "").strip()
        stem = name or "camera"
        return {
            "topic": f"{stem}/image_raw",
            "info_topic": f"{stem}/camera_info",
            "depth_topic": f"{stem}/depth/image_raw",
        }
    stem = values.text("plugin/cameraName")

    def beneath(tag: str, default: str) -> str:
        own = values.text(f"plugin/{tag}") or default
        return own if own.startswith("/") or not stem else f"{stem}/{own}"

    return {
        "topic": beneath("imageTopicName", "image_raw"),
        "info_topic": beneath("cameraInfoTopicName", "camera_info"),
        "depth_topic": beneath("depthImageTopicName", "depth/image_raw"),
    }


def _of_gz(values: SensorValues, *, has_pictures: bool) -> dict[str, str]:
    """The topics of gz's `<topic>`.

    For a camera it is that of the pictures, for a depth camera that of the depths. An RGBD camera publishes
    both below it.
    """
    topic = values.text("topic").strip("/")
    if not (topic and has_pictures):
        return {"topic": topic}
    above = topic.rpartition("/")[0]
    info = values.text("camera/camera_info_topic") or (f"{above}/camera_info" if above else "camera_info")
    kind = values.element.attributes.get("type", "")
    if kind.startswith("rgbd"):
        return {"topic": f"{topic}/image", "depth_topic": f"{topic}/depth_image"}
    if kind.startswith("depth"):
        return {"topic": f"{topic}/image", "info_topic": info, "depth_topic": topic}
    return {"topic": topic, "info_topic": info}


Keywords = dict[str, Any]  # arguments of the constructors of specs, which have fields of many types
Read = Callable[[SensorValues, Keywords], Spec]

_RATES = ("update_rate", "plugin/updateRate", "plugin/updateRateHZ", "plugin/update_rate")


def read_sensor(values: SensorValues, link: str, naming: Naming = ROOT_NAMING) -> Spec | None:
    """Read the sensor of an element on a link (for force_torque, in a joint).

    `naming` has the robot's names in the simulation. Returns None, with a finding, if the sensor is not
    simulated.
    """
    element = values.element
    kind = element.attributes.get("type", "")
    read = READERS.get(kind)
    if read is None:
        hint = did_you_mean(kind, READERS)
        values.warn(f"the sensor type '{kind}' is not simulated{': ' + hint if hint else ''}", element)
        return None
    common: Keywords = {
        "link": link,
        "name": element.attributes.get("name", ""),
        "pose": values.pose(),
        "frame": _frame(values),
        "origin": element.origin,
        **sensor_topics(values, naming, has_pictures=read is _camera),
    }
    rate = values.number(0.0, *_RATES)
    if rate:
        common["rate"] = rate
    try:
        spec = read(values, common)
    except KbotError as error:
        values.error(str(error).removeprefix(f"{common['name']}: "), element)
        return None
    endless = values.find(*_RATES)
    if endless is not None and not rate:
        values.warn(
            f"a rate of 0 (in Gazebo: every physics step) is not simulated: KBot uses {spec.rate:g} Hz",
            endless,
        )
    return spec


def _frame(values: SensorValues) -> str:
    named = values.text(
        "gz_frame_id", "ignition_frame_id", "plugin/frameName", "plugin/frame_name", "plugin/frame_id"
    )
    return named.rsplit("/", 1)[-1]


def _lidar(values: SensorValues, common: Keywords) -> Spec:
    """Read `<ray>` (Classic) or `<lidar>` (gz)."""
    plugin = values.find("plugin")
    file = plugin.attributes.get("filename", "") if plugin is not None else ""
    across, up = (
        ("ray/scan/horizontal", "lidar/scan/horizontal"),
        ("ray/scan/vertical", "lidar/scan/vertical"),
    )

    def both(paths: tuple[str, str], leaf: str) -> tuple[str, str]:
        return f"{paths[0]}/{leaf}", f"{paths[1]}/{leaf}"

    least = values.number(0.0, "ray/range/min", "lidar/range/min")
    most = values.number(10.0, "ray/range/max", "lidar/range/max")
    noise = values.noise("ray/noise", "lidar/noise")
    low, high = (
        values.number(d, *both(across, f"{end}_angle")) for d, end in ((-math.pi, "min"), (math.pi, "max"))
    )
    if "gazebo_ros_range" in file:
        infrared = values.text("plugin/radiation", "plugin/radiation_type").lower() == "infrared"
        field = values.number(high - low, "plugin/fov")
        return Range(
            field_of_view=field, range_min=least, range_max=most, infrared=infrared, noise=noise, **common
        )
    samples = values.number(640.0, *both(across, "samples")) * values.number(1.0, *both(across, "resolution"))
    rows = values.number(1.0, *both(up, "samples")) * values.number(1.0, *both(up, "resolution"))
    return Lidar(
        samples=round(samples),
        angle_min=low,
        angle_max=high,
        range_min=least,
        range_max=most,
        rows=max(1, round(rows)),
        elevation_min=values.number(0.0, *both(up, "min_angle")),
        elevation_max=values.number(0.0, *both(up, "max_angle")),
        noise=noise,
        **common,
    )


def _imu(values: SensorValues, common: Keywords) -> Spec:
    """Read the noise of SDFormat 1.5 and later, the older `<noise><rate>`, or the plugin's `<gaussianNoise>`.

    The noise of the x axis is used for all three axes.
    """
    spread = values.number(0.0, "plugin/gaussianNoise", "plugin/gaussian_noise")
    gyroscope = values.noise("imu/angular_velocity/x/noise", "imu/noise/rate")
    accelerometer = values.noise("imu/linear_acceleration/x/noise", "imu/noise/accel")
    if spread:
        gyroscope = accelerometer = Noise(stddev=abs(spread))
    return Imu(gyroscope=gyroscope, accelerometer=accelerometer, **common)


def _contact(values: SensorValues, common: Keywords) -> Spec:
    return Contact(**common)


def _gps(values: SensorValues, common: Keywords) -> Spec:
    horizontal = values.noise(
        "gps/position_sensing/horizontal/noise", "navsat/position_sensing/horizontal/noise"
    )
    vertical = values.noise("gps/position_sensing/vertical/noise", "navsat/position_sensing/vertical/noise")
    return Gps(horizontal=horizontal, vertical=vertical, **common)


def _sonar(values: SensorValues, common: Keywords) -> Spec:
    """Read a cone whose radius at its far end is `<radius>`."""
    most = values.number(1.0, "sonar/max")
    radius = values.number(0.5, "sonar/radius")
    field = 2.0 * math.atan2(radius, most)
    return Range(
        field_of_view=field, range_min=values.number(0.0, "sonar/min"), range_max=most,
        noise=values.noise("sonar/noise"), **common,
    )  # fmt: skip


def _camera(values: SensorValues, common: Keywords) -> Spec:
    """Read a camera. The types depth, depth_camera, rgbd and rgbd_camera publish depth images."""
    kind = values.element.attributes["type"]
    frame = common.pop("frame") or values.text("camera/optical_frame_id").rsplit("/", 1)[-1]
    return Camera(
        width=values.whole(320, "camera/image/width"),
        height=values.whole(240, "camera/image/height"),
        fov=values.number(1.047, "camera/horizontal_fov"),
        near=values.number(0.1, "camera/clip/near"),
        far=values.number(100.0, "camera/clip/far"),
        depth=kind != "camera",
        noise=values.noise("camera/noise"),
        frame=frame,
        **common,
    )


def _force_torque(values: SensorValues, common: Keywords) -> Spec:
    """Read a force-torque sensor. Gazebo's `<frame>` is child, parent or sensor."""
    axes = values.word("child", ("child", "parent", "sensor"), "force_torque/frame")
    directions = ("child_to_parent", "parent_to_child")
    direction = values.word("child_to_parent", directions, "force_torque/measure_direction")
    return ForceTorque(
        joint=common.pop("link"),
        axes=axes,  # type: ignore[arg-type]  # one of the three words
        direction=direction,  # type: ignore[arg-type]  # one of the two words
        force=values.noise("force_torque/force/x/noise"),
        torque=values.noise("force_torque/torque/x/noise"),
        **common,
    )


READERS: dict[str, Read] = {
    "ray": _lidar,
    "gpu_ray": _lidar,
    "lidar": _lidar,
    "gpu_lidar": _lidar,
    "imu": _imu,
    "camera": _camera,
    "contact": _contact,
    "depth": _camera,
    "depth_camera": _camera,
    "force_torque": _force_torque,
    "gps": _gps,
    "navsat": _gps,
    "rgbd": _camera,
    "rgbd_camera": _camera,
    "sonar": _sonar,
}
"""By the type of a `<sensor>`."""
