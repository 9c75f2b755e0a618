#!/bin/sh
# Install Debian or Ubuntu packages if this needs no password: as root, or with passwordless sudo. Prints the
# packages. Exit status 1: not possible.
set -eu
command -v apt-get >/dev/null || exit 1
as=""
if [ "$(id -u)" != 0 ]; then
    command -v sudo >/dev/null && sudo -n true 2>/dev/null || exit 1
    as="sudo -n"
fi
echo "Installing system packages: $*"
export DEBIAN_FRONTEND=noninteractive
# A fresh machine often updates itself: wait up to five minutes for the package lock.
install() { $as apt-get -o DPkg::Lock::Timeout=300 install -y -qq --no-install-recommends "$@" >/dev/null; }
install "$@" 2>/dev/null || { $as apt-get -o DPkg::Lock::Timeout=300 update -qq && install "$@"; } || exit 1
