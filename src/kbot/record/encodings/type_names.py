"""The ROS type name of each message class."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from kbot.text import KbotError

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

NAMESAKES = {
    "std_msgs": (
        "Bool ColorRGBA Float32MultiArray Float64 Float64MultiArray Header MultiArrayDimension "
        "MultiArrayLayout String"
    ),
    "geometry_msgs": (
        "Point Point32 PointStamped Polygon PolygonStamped Pose PoseArray PoseStamped PoseWithCovariance "
        "PoseWithCovarianceStamped Quaternion Transform TransformStamped Twist TwistStamped "
        "TwistWithCovariance Vector3 Wrench WrenchStamped"
    ),
    "nav_msgs": "MapMetaData OccupancyGrid Odometry Path",
    "sensor_msgs": (
        "CameraInfo CompressedImage Image Imu JointState Joy LaserScan NavSatFix NavSatStatus PointCloud2 "
        "PointField Range RegionOfInterest"
    ),
    "trajectory_msgs": "JointTrajectory JointTrajectoryPoint",
    "tf2_msgs": "TFMessage",
    "rosgraph_msgs": "Clock",
    "rcl_interfaces": "Log",
    "actionlib_msgs": "GoalID GoalStatus GoalStatusArray",
    "visualization_msgs": "Marker MarkerArray MeshFile UVCoordinate",
    "builtin_interfaces": "Duration Time",
}
"""KBot's messages by ROS package. Listed here because the library that knows all ROS types takes longer to
load than a robot."""

OTHER_NAMES = {"ClockMessage": "Clock"}

PARTS = {
    "map_msgs": "OccupancyGridUpdate",
    "gazebo_msgs": "ModelState ModelStates LinkStates",
    "control_msgs": (
        "JointTolerance FollowJointTrajectoryGoal FollowJointTrajectoryResult FollowJointTrajectoryFeedback "
        "FollowJointTrajectoryActionGoal FollowJointTrajectoryActionResult "
        "FollowJointTrajectoryActionFeedback"
    ),
    "move_base_msgs": (
        "MoveBaseGoal MoveBaseResult MoveBaseFeedback MoveBaseActionGoal MoveBaseActionResult "
        "MoveBaseActionFeedback"
    ),
}
"""Messages that the rosbags library lacks. Services, actions and their topics use them."""


@cache
def shipped_types() -> Typestore:
    """The ROS 2 message types of the rosbags library."""
    from rosbags.typesys import Stores, get_typestore  # imported lazily: rosbags is slow to import

    return get_typestore(Stores.ROS2_JAZZY)


@cache
def ros_name(message_type: type) -> str:
    """The type name of a message as ROS 2 writes it: `nav_msgs/msg/Odometry`.

    Raises:
        KbotError: ROS has no such message.
    """
    name = OTHER_NAMES.get(message_type.__name__, message_type.__name__)
    package = _packages().get(name) or _package_by_library(name)
    if package is None:
        raise KbotError(f"{name} is not a ROS message, so it cannot be recorded or sent")
    return f"{package}/msg/{name}"


@cache
def _packages() -> dict[str, str]:
    return {name: package for package, names in (NAMESAKES | PARTS).items() for name in names.split()}


def _package_by_library(name: str) -> str | None:
    known = shipped_types().fielddefs
    return next((package for package in NAMESAKES if f"{package}/msg/{name}" in known), None)
