"""Reads ROS 2 launch files (Python, XML and YAML)."""

from kbot.ros.launch.ros2.reader import read_launch_2

__all__ = ["read_launch_2"]
