"""Reads the settings of ros_gz_bridge from YAML and arguments: the ROS topic for each topic of gz."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import PurePosixPath
from typing import Any

from kbot.ros import names
from kbot.ros.launch.node_arguments import full_remaps, place_of, split
from kbot.ros.launch.plan import Plan, PlannedNode
from kbot.ros.nodes.gz_bridge import Bridged, Direction
from kbot.ros.parameter_values import ROSPARAM
from kbot.text import DescriptionError, Diagnostic, Origin, Severity, read_source
from kbot.text.span import Call
from kbot.text.suggest import did_you_mean
from kbot.text.yaml import Keys, YamlDocument, YamlError, read_yaml

_MARKS = {"@": Direction.BOTH, "[": Direction.TO_ROS, "]": Direction.TO_GZ}
_ARGUMENT = re.compile(r"(?P<topic>[^@\s]+)@(?P<ros>[\w/]+)(?P<mark>[@\[\]])(?P<gz>[\w.]+)")
_SERVICE = re.compile(r"[^@\s]+@\w+/srv/\w+(?:@[\w.]+@[\w.]+)?")
_TOPIC = re.compile(r"[~/]?\w[\w/]*", re.ASCII)
_GZ_TOPIC = re.compile(r"[^\s@]+")
_WORDS = (
    *((name, _TOPIC, "ROS topic name") for name in ("topic_name", "ros_topic_name")),
    ("gz_topic_name", _GZ_TOPIC, "gz topic name"),
    (
        "ros_type_name",
        re.compile(r"\w+(/msg)?/\w+", re.ASCII),
        "ROS type, for example geometry_msgs/msg/Twist",
    ),
    ("gz_type_name", re.compile(r"\w+(\.\w+)+", re.ASCII), "gz type, for example gz.msgs.Twist"),
)
_KEYS = (
    *("topic_name", "ros_topic_name", "gz_topic_name", "ros_type_name", "gz_type_name", "direction"),
    *("lazy", "subscriber_queue", "publisher_queue", "qos_profile"),
    *("service_name", "gz_req_type_name", "gz_rep_type_name"),
)
TYPES: Mapping[str, tuple[str, ...]] = {
    "std_msgs/msg/Bool": ("Boolean",),
    "std_msgs/msg/Float32": ("Float",),
    "std_msgs/msg/Float64": ("Double",),
    "std_msgs/msg/Header": ("Header",),
    "std_msgs/msg/Int32": ("Int32",),
    "std_msgs/msg/UInt32": ("UInt32",),
    "std_msgs/msg/String": ("StringMsg",),
    "std_msgs/msg/Empty": ("Empty",),
    "std_msgs/msg/ColorRGBA": ("Color",),
    "geometry_msgs/msg/Point": ("Vector3d",),
    "geometry_msgs/msg/Pose": ("Pose",),
    "geometry_msgs/msg/PoseArray": ("Pose_V",),
    "geometry_msgs/msg/PoseStamped": ("Pose",),
    "geometry_msgs/msg/PoseWithCovariance": ("PoseWithCovariance",),
    "geometry_msgs/msg/Quaternion": ("Quaternion",),
    "geometry_msgs/msg/Transform": ("Pose",),
    "geometry_msgs/msg/TransformStamped": ("Pose",),
    "geometry_msgs/msg/Twist": ("Twist",),
    "geometry_msgs/msg/TwistStamped": ("Twist",),
    "geometry_msgs/msg/Vector3": ("Vector3d",),
    "geometry_msgs/msg/Wrench": ("Wrench",),
    "geometry_msgs/msg/WrenchStamped": ("Wrench",),
    "nav_msgs/msg/Odometry": ("Odometry", "OdometryWithCovariance"),
    "rosgraph_msgs/msg/Clock": ("Clock",),
    "sensor_msgs/msg/BatteryState": ("BatteryState",),
    "sensor_msgs/msg/CameraInfo": ("CameraInfo",),
    "sensor_msgs/msg/FluidPressure": ("FluidPressure",),
    "sensor_msgs/msg/Image": ("Image",),
    "sensor_msgs/msg/Imu": ("IMU",),
    "sensor_msgs/msg/JointState": ("Model",),
    "sensor_msgs/msg/Joy": ("Joy",),
    "sensor_msgs/msg/LaserScan": ("LaserScan",),
    "sensor_msgs/msg/MagneticField": ("Magnetometer",),
    "sensor_msgs/msg/NavSatFix": ("NavSat",),
    "sensor_msgs/msg/PointCloud2": ("PointCloudPacked",),
    "tf2_msgs/msg/TFMessage": ("Pose_V",),
    "trajectory_msgs/msg/JointTrajectory": ("JointTrajectory",),
}
"""ROS types, and the types of gz.msgs that ros_gz_bridge converts each to."""


def read_bridged(plan: Plan, nodes: Iterable[PlannedNode]) -> tuple[tuple[Bridged, ...], list[Diagnostic]]:
    """The topics that the bridges of a launch convert, and findings about the bridges' settings."""
    reader = _Reader(plan)
    for node in nodes:
        reader.node(node)
    for included in plan.included:
        path = included.arguments.get("config_file")
        if path and included.package in ("ros_gz_bridge", "ros_gz_sim"):
            reader.file(path, included.origin, included.namespace, {})
    return tuple(reader.found), reader.notes


class _Reader:
    def __init__(self, plan: Plan) -> None:
        self._plan = plan
        self.found: list[Bridged] = []
        self.notes: list[Diagnostic] = []

    def node(self, node: PlannedNode) -> None:
        words, remaps = split(node), full_remaps(node)
        config = self._plan.params.get(f"{node.full_name}/config_file")
        if config is not None and config.value:
            self.file(str(config.value), config.origin, node.namespace, remaps)
        for word in words:
            if word == "--ros-args":
                break
            if ":=" not in word and not word.startswith("-"):
                self._argument(node, word, remaps)

    def _argument(self, node: PlannedNode, word: str, remaps: Mapping[str, str]) -> None:
        where = place_of(node, word)
        if node.type == "image_bridge":
            topic = _full(word, "/")
            image = "sensor_msgs/msg/Image"
            self.found.append(Bridged(topic, remaps.get(topic, topic), image, Direction.TO_ROS, where))
            return
        if _SERVICE.fullmatch(word):
            self._service(word.partition("@")[0], where)
            return
        match = _ARGUMENT.fullmatch(word)
        if match is None:
            message = f"'{word}' is not a bridge argument"
            hint = "use /topic@ros_type@gz_type, or [ (gz to ROS) or ] (ROS to gz) in place of the second @"
            self._note(message, where, hint)
            return
        gz = _full(match["topic"], "/")
        ros = _full(match["topic"], node.namespace)
        direction = _MARKS[match["mark"]]
        self._add(gz, remaps.get(ros, ros), match["ros"], match["gz"], direction, where, where)

    def file(self, path: str, origin: Origin, namespace: str, remaps: Mapping[str, str]) -> None:
        """Read a configuration file. If it does not exist, this is reported where the file is named."""
        call = Call("include", path, origin.span, origin.call)
        try:
            source = read_source(path)
            document = read_yaml(source, ROSPARAM)
        except DescriptionError as error:
            (found,) = error.diagnostics
            is_within = found.code == "F005" and found.origin is not None
            where = Origin(found.origin.span, call) if is_within and found.origin else origin
            self._note(found.message, where, found.hint)
            return
        except YamlError as error:
            self._note(f"the YAML cannot be read: {error}", Origin(error.span, call))
            return
        data = document.data
        if not isinstance(data, list):
            self._note(
                f"{path} must contain a list of topics",
                Origin(source.whole()),
                "- ros_topic_name: /cmd_vel …",
            )
            return
        all_places = _Places(document, call)
        for number, entry in enumerate(data):
            keys = (str(number),)
            if isinstance(entry, dict):
                self._entry(entry, keys, all_places, namespace, remaps)
            else:
                self._note(
                    f"{entry!r:.60} is not a bridge entry", all_places.of(*keys), "- ros_topic_name: …"
                )

    def _entry(
        self,
        entry: Mapping[Any, Any],  # Any: what YAML holds
        keys: Keys,
        places: _Places,
        namespace: str,
        remaps: Mapping[str, str],
    ) -> None:
        for key in entry:
            if str(key) not in _KEYS:
                hint = did_you_mean(str(key), _KEYS) or f"use one of: {', '.join(_KEYS)}"
                self._note(f"a bridge entry has no key '{key}'", places.of(*keys, str(key)), hint)
        if "service_name" in entry:
            self._service(entry["service_name"], places.of(*keys, "service_name"))
            return
        first = places.of(*keys, str(next(iter(entry), "")))
        either = entry.get("topic_name")
        gz, ros = entry.get("gz_topic_name", either), entry.get("ros_topic_name", either)
        gz, ros = gz or ros, ros or gz
        if not gz or not ros:
            self._note(
                "the bridge entry does not name a topic", first, "add gz_topic_name and ros_topic_name"
            )
            return
        for name, pattern, what in _WORDS:
            if entry.get(name) and not (isinstance(entry[name], str) and pattern.fullmatch(entry[name])):
                self._note(f"{entry[name]!r:.60} is not a {what}", places.of(*keys, name))
                return
        missing = [name for name in ("ros_type_name", "gz_type_name") if not entry.get(name)]
        if missing:
            self._note(f"the bridge entry of {ros} needs {' and '.join(missing)}", first)
            return
        wanted = str(entry.get("direction", Direction.BOTH))
        if wanted not in list(Direction):
            hint = did_you_mean(wanted, list(Direction)) or f"use one of: {', '.join(Direction)}"
            self._note(f"unknown direction '{wanted}'", places.of(*keys, "direction"), hint)
            return
        full = _full(str(ros), namespace)
        self._add(
            _full(str(gz), "/"),
            remaps.get(full, full),
            str(entry["ros_type_name"]),
            str(entry["gz_type_name"]),
            Direction(wanted),
            first,
            places.of(*keys, "ros_type_name"),
        )

    def _add(
        self,
        gz: str,
        ros: str,
        ros_type: str,
        gz_type: str,
        direction: Direction,
        where: Origin,
        typed: Origin,
    ) -> None:
        package, _, name = ros_type.partition("/")
        kind = f"{package}/msg/{name.removeprefix('msg/')}"
        fitting = TYPES.get(kind)
        if fitting is not None and PurePosixPath(gz_type.replace(".", "/")).name not in fitting:
            self._note(
                f"{kind} converts to gz.msgs.{fitting[0]}, not to {gz_type}: the topic is not bridged", typed
            )
            return
        self.found.append(Bridged(gz, ros, kind, direction, where))

    def _service(self, name: object, where: Origin) -> None:
        message = f"KBot does not provide the gz service {name!s:.60}"
        self.notes.append(
            Diagnostic("L063", Severity.WARNING, message, where, "use the services under /gazebo/ instead")
        )

    def _note(self, message: str, where: Origin, hint: str = "") -> None:
        self.notes.append(Diagnostic("L062", Severity.WARNING, message, where, hint))


@dataclass(frozen=True, slots=True)
class _Places:
    """The origins of the values in a configuration file."""

    document: YamlDocument
    call: Call

    def of(self, *keys: str) -> Origin:
        return Origin(self.document.span(*keys), self.call)


def _full(topic: str, namespace: str) -> str:
    return names.canonical(names.join(names.as_namespace(namespace), topic))
