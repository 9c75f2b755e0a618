"""A node of ROS 2 over Zenoh, by the extra `zenoh`."""

from kbot.ros.bridges.zenoh.bridge import ZenohBridge

__all__ = ["ZenohBridge"]
