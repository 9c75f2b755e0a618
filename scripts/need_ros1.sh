#!/bin/sh
# Install ROS 1 for the peer tests, from Debian's packages (about 200 on a fresh machine), and iproute2, with which the
# tests against ROS 2 make network namespaces.
set -eu
command -v roslaunch >/dev/null && command -v rosbag >/dev/null && [ -d /usr/lib/python3/dist-packages/nav_msgs ] && [ -d /usr/lib/python3/dist-packages/move_base_msgs ] && command -v catkin_make >/dev/null && command -v rviz >/dev/null && command -v Xvfb >/dev/null && command -v rosservice >/dev/null && command -v fastddsgen >/dev/null && [ -x /usr/lib/tf/tf_echo ] && command -v ip >/dev/null && exit 0
sh scripts/system_packages.sh \
    python3-roslaunch ros-robot-state-publisher joint-state-publisher python3-rosparam python3-rosnode \
    python3-rostopic python3-rosservice python3-std-srvs tf-tools libfastrtps-dev libfastcdr-dev fastddsgen python3-rosbag python3-nav-msgs python3-move-base-msgs python3-actionlib python3-tf2-ros catkin cmake make g++ rviz xvfb libgl1-mesa-dri iproute2 && exit 0
echo "The peer tests need ROS 1 on Debian or Ubuntu, with roslaunch, catkin and robot_state_publisher." >&2
exit 1
