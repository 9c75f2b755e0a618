"""A node of ROS 2 over Zenoh, by the extra `zenoh`."""

from kbot.bridges.zenoh.bridge import ZenohBridge

__all__ = ["ZenohBridge"]
