"""A node of ROS 1, and a master where there is none: the standard library's XML-RPC and sockets."""

from kbot.ros.bridges.ros1.bridge import Ros1Bridge

__all__ = ["Ros1Bridge"]
