#!/bin/sh
# Create the virtual environment .venv. It gets the first Python >= 3.11 that has wheels for the tests, or else the
# first that has wheels for KBot alone. $PYTHON has precedence.
set -eu
# Set `found` to the first interpreter after $1 that has wheels for the extra $1. If there is none, set `refused` to the
# message about the last one.
find_python() {
    extra=$1
    shift
    for python in "$@"; do
        "$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || continue
        if refused=$(sh scripts/need_wheels.sh "$extra" "$python" 2>&1); then
            found=$python
            return
        fi
    done
}
if [ -n "${PYTHON:-}" ]; then
    set -- "$PYTHON"
else
    set -- python3 python3.14 python3.13 python3.12 python3.11 python
fi
found="" refused=""
find_python test "$@"
if [ -z "$found" ]; then
    for_tests=$refused
    find_python base "$@"
    if [ -z "$found" ]; then
        echo "${refused:-KBot needs Python 3.11 or later, but none was found.} To choose an interpreter: PYTHON=/path/to/python make …" >&2
        exit 1
    fi
    echo "$for_tests KBot runs without this extra, but make test needs it."
fi
echo "Creating .venv with $("$found" --version)"
rm -rf .venv
if ! "$found" -c 'import ensurepip, venv' 2>/dev/null; then
    package=$("$found" -c 'import sys; print("python%d.%d-venv" % sys.version_info[:2])')
    if ! sh scripts/system_packages.sh "$package"; then
        echo "This Python has no venv module. Install it first: sudo apt install $package" >&2
        exit 1
    fi
fi
"$found" -m venv .venv
