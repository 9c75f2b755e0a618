"""Bridges to ROS 1, ROS 2, Foxglove and rosbridge. Each has its own folder."""
