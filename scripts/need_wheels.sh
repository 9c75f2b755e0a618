#!/bin/sh
# Check that a Python has wheels for an extra, or for KBot alone (`base`). Exit status 1: pip would have to compile
# packages, which fails on most machines. Prints which Python has them.
#   sh scripts/need_wheels.sh EXTRA PYTHON
set -eu
# The table in pyproject.toml has the newest Python 3 of `base` and of the extras that differ.
newest() { sed -n "/^\[tool.kbot.newest-python\]/,/^\$/s/^$1 = \"3\.\([0-9]*\)\".*/\1/p" pyproject.toml; }
last=$(newest "$1")
last=${last:-$(newest base)}
minor=$("$2" -c 'import sys; print(sys.version_info[1])')
[ "$minor" -le "$last" ] && exit 0
[ "$1" = base ] && what="KBot" || what="the extra '$1'"
echo "Some packages that $what needs have no wheel for Python 3.$minor. Use Python 3.$last." >&2
exit 1
