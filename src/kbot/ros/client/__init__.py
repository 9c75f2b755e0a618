"""`kbot.Node`: the node of a user's program, which runs with KBot alone, on ROS 1 and on ROS 2."""

from kbot.ros.client.node import Node
from kbot.ros.client.transports import wanted_transport

__all__ = ["Node", "wanted_transport"]
