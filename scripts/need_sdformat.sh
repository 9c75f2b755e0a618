#!/bin/sh
# libsdformat, the reader of Gazebo, for the peer tests of worlds, and a compiler to call it with.
set -eu
pkg-config --exists sdformat12 2>/dev/null && command -v g++ >/dev/null && exit 0
sh scripts/system_packages.sh libsdformat-dev g++ pkg-config && exit 0
echo "The peer tests of worlds need libsdformat: Debian's libsdformat-dev, and g++." >&2
exit 1
