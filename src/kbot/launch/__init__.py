"""ROS launch files: a plan of what would run, with which parameters, and from which line."""

from kbot.launch.plan import Argument, Description, Included, Machine, Node, Param, Plan
from kbot.launch.reader import read_launch

__all__ = ["Argument", "Description", "Included", "Machine", "Node", "Param", "Plan", "read_launch"]
