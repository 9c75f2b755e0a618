"""What the topics of a `<sensor>` are called, as Gazebo's plugins for ROS and gz call them."""

from __future__ import annotations

from kbot.sensors.sdf_values import Values
from kbot.sim.naming import Naming
from kbot.sim.plugin_names import PluginNames, is_of_gazebo_ros

_ROS1_CAMERA = ("cameraName", "imageTopicName", "cameraInfoTopicName")
_NAMED = ("topicName", "topic_name", "bumperTopicName")


def sensor_topics(values: Values, naming: Naming, *, has_pictures: bool) -> dict[str, str]:
    """`topic`, and of a camera also `info_topic` and `depth_topic`, for its spec; what is not there is the
    spec's own. Those of a plugin of gazebo_ros are full names."""
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


def _pictures(values: Values, names: PluginNames) -> dict[str, str]:
    """Of ROS 2 they stand beneath `<camera_name>`, else the sensor's name; of ROS 1 beneath `<cameraName>`,
    else at the root of its namespace."""
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


def _of_gz(values: Values, *, has_pictures: bool) -> dict[str, str]:
    """`<topic>`: of a camera its pictures, of one for depths the depths, of one for both what both are
    beneath."""
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
