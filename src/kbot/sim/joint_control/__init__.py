"""Joints that do not drive: their controllers (ros_control, ros2_control), commands and servos."""
