#!/bin/sh
# Create the virtual environment .venv with the first Python >= 3.11 that is found ($PYTHON has precedence).
set -eu
for python in "${PYTHON:-}" python3 python3.14 python3.13 python3.12 python3.11 python; do
    [ -n "$python" ] && command -v "$python" >/dev/null || continue
    "$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && found=$python && break
done
if [ -z "${found:-}" ]; then
    echo "KBot needs Python 3.11 or later, but none was found. To name one: PYTHON=/path/to/python make …" >&2
    exit 1
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
