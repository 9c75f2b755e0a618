"""Gazebo's services and states, under the names that ROS 1, ROS 2 and gz know them by."""
