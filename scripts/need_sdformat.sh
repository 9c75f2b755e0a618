#!/bin/sh
# Install libsdformat, Gazebo's parser, and a compiler for the peer tests of worlds.
set -eu
pkg-config --exists sdformat12 2>/dev/null && command -v g++ >/dev/null && exit 0
sh scripts/system_packages.sh libsdformat-dev g++ pkg-config && exit 0
echo "The peer tests of worlds need libsdformat (Debian package libsdformat-dev) and g++." >&2
exit 1
