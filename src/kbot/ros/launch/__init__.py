"""Reads and runs ROS launch files: nodes, their parameters, and the line that each comes from."""

from kbot.lazy_names import lazy_names
from kbot.ros.launch.plan import Argument, Included, Machine, Param, Plan, PlannedNode, RobotDescription

TYPE_CHECKING = False
if TYPE_CHECKING:
    from kbot.ros.launch.ros1 import read_launch
    from kbot.ros.launch.ros2 import read_launch_2
    from kbot.ros.launch.ros_version import is_ros_2

# imported lazily: nodes and bridges use plans but do not read launch files
_READERS = {"is_ros_2": "ros_version", "read_launch": "ros1", "read_launch_2": "ros2"}

__all__ = [
    "Argument",
    "Included",
    "Machine",
    "Param",
    "Plan",
    "PlannedNode",
    "RobotDescription",
    "is_ros_2",
    "read_launch",
    "read_launch_2",
]

__getattr__ = lazy_names(__name__, _READERS)
