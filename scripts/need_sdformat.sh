#!/bin/sh
# Install libsdformat and urdfdom, the parsers of Gazebo and ROS, and a compiler for the peer tests of descriptions.
set -eu
pkg-config --exists sdformat12 2>/dev/null && command -v g++ >/dev/null && command -v check_urdf >/dev/null && exit 0
sh scripts/system_packages.sh libsdformat-dev liburdfdom-tools g++ pkg-config && exit 0
echo "The peer tests of descriptions need libsdformat-dev, liburdfdom-tools (Debian packages) and g++." >&2
exit 1
