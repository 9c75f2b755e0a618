"""Recordings as bags of ROS 1 and as folders of rosbag2."""
