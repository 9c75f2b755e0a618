"""Reads ROS 1 launch files (XML)."""

from kbot.ros.launch.ros1.reader import read_launch

__all__ = ["read_launch"]
