"""ROS launch files: a plan of what would run, with which parameters, and from which line."""

from kbot.launch.plan import Argument, Description, Included, Machine, Node, Param, Plan
from kbot.launch.reader import read_launch
from kbot.launch.ros2 import read_launch_2
from kbot.launch.which import is_ros_2

__all__ = [
    "Argument",
    "Description",
    "Included",
    "Machine",
    "Node",
    "Param",
    "Plan",
    "is_ros_2",
    "read_launch",
    "read_launch_2",
]
