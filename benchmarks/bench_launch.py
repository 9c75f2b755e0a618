"""From `kbot launch` to the robot in the page, beside roslaunch to the robot in rviz.

Both carry out KBot's own kbot_base_rviz.launch: one in headless Chromium, one in rviz under Xvfb, both
without a graphics card. The browser is open already; roslaunch starts its own master, as it does for a
user. It needs a ROS 1 (`make test-peers` installs it).

    python benchmarks/bench_launch.py [--runs N]
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "tests")]

from bench_first_picture import first_picture  # noqa: E402 - found by the path set above
from browsing import opened_browser  # noqa: E402 - found by the path set above

from peers.conftest import PROGRAMS, Ros, stop, wait_until  # noqa: E402 - found by the path set above
from peers.test_kbot_description import PACKAGE, shows_robot  # noqa: E402 - found by the path set above

if TYPE_CHECKING:
    from playwright.sync_api import Browser

LAUNCH = PACKAGE / "launch" / "kbot_base_rviz.launch"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--runs", type=int, default=3)
    runs = parser.parse_args().runs
    from shutil import which

    missing = [name for name in PROGRAMS if which(name) is None]
    if missing:
        sys.exit(f"there is no ROS 1 here: {', '.join(missing)} missing")
    ours, theirs = [], []
    with opened_browser() as browser:
        for _ in range(runs):
            ours.append(kbot_launch(browser))
            theirs.append(roslaunch())
    a, b = statistics.median(ours), statistics.median(theirs)
    print(f"kbot launch, to the robot in the page:   {a:.2f} s")
    print(f"roslaunch, to the robot in rviz:         {b:.2f} s")
    print(f"kbot / roslaunch:                        {a / b:.2f}   limit 1")


def kbot_launch(browser: Browser) -> float:
    """Seconds from the command to the page's first picture of the robot."""
    start = time.perf_counter()
    command = [sys.executable, "-m", "kbot", "launch", str(LAUNCH), "--no-browser", "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as running:
        assert running.stdout is not None
        address = ""
        while "http://" not in address:
            address = running.stdout.readline()
        address = address[address.index("http://") :].split()[0]
        first_picture(browser, address, "!!window.kbot && kbot.frames > 0 && kbot.revision > 0")
        taken = time.perf_counter() - start
        running.terminate()
    return taken


def roslaunch() -> float:
    """Seconds from the command to a blue plate and black wheels on rviz's screen."""
    with tempfile.TemporaryDirectory() as folder:
        ros = Ros(Path(folder))
        (ros.packages / "kbot_description").symlink_to(PACKAGE)
        screen = Path(folder) / "screen"
        screen.mkdir()
        server = ros.start("Xvfb", ":87", "-screen", "0", "1280x900x24", "-fbdir", str(screen))
        ros.environment["DISPLAY"] = ":87"
        picture = screen / "Xvfb_screen0"
        wait_until(picture.exists, "a screen")
        start = time.perf_counter()
        process = ros.start("roslaunch", str(LAUNCH))
        try:
            wait_until(lambda: shows_robot(picture), "the robot in rviz", 120)
            return time.perf_counter() - start
        finally:
            stop(process)
            stop(server)


if __name__ == "__main__":
    main()
