#!/bin/sh
# Find Chromium for the browser tests, or install the system's package.
set -eu
for name in "${KBOT_CHROMIUM:-}" chromium-headless-shell chromium chromium-browser google-chrome google-chrome-stable; do
    [ -n "$name" ] && command -v "$name" >/dev/null && exit 0
done
[ -x "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome" ] && exit 0
# Ubuntu does not have this package.
sh scripts/system_packages.sh chromium-headless-shell 2>/dev/null && exit 0
sh scripts/system_packages.sh chromium && command -v chromium >/dev/null && exit 0
echo "Chromium is not found, so the browser tests are skipped. Install it, or set KBOT_CHROMIUM to its path."
