"""Encodes messages: CDR, ROS 1's format, JSON, and the definitions that recordings contain."""
