"""Which topics of a simulation exist in one version of ROS only."""

from __future__ import annotations

_ROS1_NAMES = ("/move_base/", "/move_base_simple/", "/gazebo/")
"""Names of move_base, rviz and gazebo_ros. ROS 2 has no move_base, and its rviz and Gazebo use other
names."""
_ACTION_TYPES = ("ActionGoal", "ActionFeedback", "ActionResult")
_ROS2_NAMES = frozenset({"/goal_pose", "/plan", "/local_costmap/costmap"})
"""Names of rviz2 and Nav2. KBot also publishes or receives each topic under its ROS 1 name."""


def version_of(topic: str, type_name: str) -> int | None:
    """The only ROS version, 1 or 2, whose peers know a topic of a simulation. None if both know it.

    The topics of an action are those of actionlib, which only ROS 1 has: in ROS 2, an action has services.
    """
    is_action = type_name.startswith("actionlib_msgs/") or type_name.endswith(_ACTION_TYPES)
    if is_action or topic.startswith(_ROS1_NAMES):
        return 1
    return 2 if topic in _ROS2_NAMES else None
