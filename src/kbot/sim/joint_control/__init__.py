"""The joints that are not part of the drive: controllers (ros_control, ros2_control), commands, servos."""
