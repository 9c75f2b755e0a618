"""The joints that do not drive: controllers as ros_control and ros2_control have them, commands, servos."""
