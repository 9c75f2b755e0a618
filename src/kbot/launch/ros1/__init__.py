"""ROS 1 launch files: XML."""

from kbot.launch.ros1.reader import read_launch

__all__ = ["read_launch"]
