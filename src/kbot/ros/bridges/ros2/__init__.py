"""A node of ROS 2 over DDS, by the extra `ros2`."""

from kbot.ros.bridges.ros2.bridge import Ros2Bridge

__all__ = ["Ros2Bridge"]
