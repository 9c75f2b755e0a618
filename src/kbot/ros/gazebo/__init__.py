"""Gazebo's services and state topics, under their names in ROS 1."""
