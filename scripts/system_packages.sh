#!/bin/sh
# Install packages of a Debian or Ubuntu, where that is possible without asking: as root, or with a
# sudo that wants no password. Says what it does. Exit status 1: not possible here.
set -eu
command -v apt-get >/dev/null || exit 1
as=""
if [ "$(id -u)" != 0 ]; then
    command -v sudo >/dev/null && sudo -n true 2>/dev/null || exit 1
    as="sudo -n"
fi
echo "Installing from the system's packages: $*"
export DEBIAN_FRONTEND=noninteractive
# A fresh machine often updates itself: wait up to five minutes for the lock of the packages.
install() { $as apt-get -o DPkg::Lock::Timeout=300 install -y -qq --no-install-recommends "$@" >/dev/null; }
install "$@" 2>/dev/null || { $as apt-get -o DPkg::Lock::Timeout=300 update -qq && install "$@"; } || exit 1
