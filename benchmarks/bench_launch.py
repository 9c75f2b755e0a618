"""Time from `kbot launch` to the robot in the page, compared with roslaunch to the first frame of rviz.

Both run the launch file of a robot package from a book chapter, in a corrected version. The package is in the
folder `chapter` of KBOT_SHARED, or of `shared` beside the repository. Both start everything that a user waits
for: roslaunch starts its master, its nodes and rviz with its saved configuration, and KBot starts its server
and a Chromium that has a profile from an earlier start. Both render in software on one screen (Xvfb). Colours
on this screen mark the end of each measurement: the grey of rviz's view marks its first frame, and the colour
of the robot's plate marks the robot. `kbot launch` is also measured with a Chromium that is already open. The
package as printed in the book fails with both programs, so for this package the time to the error message is
compared. Processor time is that of all processes of a command until its measurement ends. The medians of
alternating rounds are compared, after one warm-up round. This needs ROS 1 (`make test-peers` installs it) and
Chromium.

    python benchmarks/bench_launch.py [--runs N]
"""

from __future__ import annotations

import argparse
import os
import resource
import shlex
import shutil
import statistics
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "tests")]

from browsing import ARGUMENTS, chromium, tree_seconds  # noqa: E402 - found by the path set above

from peers.conftest import PROGRAMS, Ros, stop, wait_until  # noqa: E402 - found by the path set above
from peers.test_kbot_description import picture  # noqa: E402 - found by the path set above

CHAPTER = Path(os.environ.get("KBOT_SHARED") or Path(__file__).parents[2] / "shared") / "chapter"
LAUNCH = "launch/kbot_base_rviz.launch"
OURS = "kbot launch, to the robot in the page"
OPEN = "kbot launch, in an open Chromium"
FRAME = "roslaunch, to rviz's first frame"
ROBOT = "roslaunch, to the robot in rviz"
SOFTWARE = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")
"""WebGL without a graphics card. rviz uses LIBGL_ALWAYS_SOFTWARE for the same."""
NEW_TAB, PAGE_PLATE, RVIZ_GREY, RVIZ_PLATE = (255, 255, 255), (176, 181, 192), (48, 48, 48), (180, 0, 0)
ENOUGH = 20_000
"""Pixels of a colour that must be on the screen. A robot's plate has twice as many."""
PERIOD = 0.03
"""Seconds between two checks of the screen."""
TIMEOUT = 180.0


class Cost(NamedTuple):
    """Wall-clock time and processor time until something is on the screen, in s."""

    wall: float
    work: float


class Desk:
    """A home folder with one package of the chapter, and the profiles of rviz and Chromium."""

    def __init__(self, home: Path, package: str) -> None:
        home.mkdir()
        self.ros = Ros(home)
        source = CHAPTER / package / "kbot_description"
        launch = str(shutil.copytree(source, self.ros.packages / source.name) / LAUNCH)
        self.roslaunch = ("roslaunch", launch)
        self.kbot_launch = (sys.executable, "-m", "kbot", "launch", launch, "--port", "0")
        (home / ".rviz").mkdir()
        shutil.copy(CHAPTER / "ros_reference" / "kbot.rviz", home / ".rviz" / "default.rviz")
        size = ("--window-position=0,0", "--window-size=1280,900")
        self._browser = (chromium(), *ARGUMENTS, *SOFTWARE, *size, f"--user-data-dir={home}/chromium")
        self.ros.environment["BROWSER"] = f"{shlex.join(self._browser)} %s"

    @contextmanager
    def screen(self) -> Iterator[Path]:
        """Start a screen; yields the file with its picture."""
        folder, number = self.ros.home / "screen", f":{90 + os.getpid() % 900}"
        folder.mkdir()
        server = self.ros.start("Xvfb", number, "-screen", "0", "1280x900x24", "-fbdir", str(folder))
        try:
            wait_until((folder / "Xvfb_screen0").exists, "a screen")
            self.ros.environment["DISPLAY"] = number
            yield folder / "Xvfb_screen0"
        finally:
            stop(server)

    @contextmanager
    def open_browser(self, screen: Path) -> Iterator[int]:
        """Start a Chromium with an empty page and wait until it is idle; yields its process id."""
        process = self.ros.start(*self._browser, "about:blank")
        try:
            wait_until(lambda: shows(screen, NEW_TAB), "a browser")
            time.sleep(5.0)
            yield process.pid
        finally:
            stop(process)
            wait_until_empty(screen)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--runs", type=int, default=5)
    runs = parser.parse_args().runs
    missing = [name for name in PROGRAMS if shutil.which(name) is None]
    if missing:
        sys.exit(f"ROS 1 is not installed: {', '.join(missing)} missing")
    if not CHAPTER.is_dir():
        sys.exit(f"the robot packages are not found at {CHAPTER} (set KBOT_SHARED)")
    rounds: dict[str, list[Cost]] = defaultdict(list)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        printed = Desk(Path(folder) / "printed", "printed")
        desk = Desk(Path(folder) / "corrected", "corrected")
        with desk.screen() as screen:
            for number in range(runs + 1):
                for name, cost in one_round(desk, screen, printed):
                    if number:
                        rounds[name].append(cost)
    for name, costs in rounds.items():
        wall, work = (statistics.median(values) for values in zip(*costs, strict=True))
        print(f"{name:40} {wall:6.2f} s, {work:5.2f} s of processor time")
    for name, other in ((OURS, FRAME), (OURS, ROBOT), (OPEN, FRAME)):
        print(f"{name}, compared with {other}: {compared(rounds[name], rounds[other])}")


def one_round(desk: Desk, screen: Path, printed: Desk) -> Iterator[tuple[str, Cost]]:
    """Measure each variant once."""
    page = until(desk.ros, desk.kbot_launch, screen, PAGE_PLATE)
    yield OURS, page[0]
    rviz = until(desk.ros, desk.roslaunch, screen, RVIZ_GREY, RVIZ_PLATE)
    yield from zip((FRAME, ROBOT), rviz, strict=True)
    with desk.open_browser(screen) as browser:
        yield OPEN, until(desk.ros, desk.kbot_launch, screen, PAGE_PLATE, beside=browser)[0]
    yield "kbot launch, as printed: to its error", until_refused(printed.ros, printed.kbot_launch)
    yield "roslaunch, as printed: to its error", until_refused(printed.ros, printed.roslaunch)


def until(
    ros: Ros,
    command: tuple[str, ...],
    screen: Path,
    *colours: tuple[int, int, int],
    beside: int | None = None,
) -> list[Cost]:
    """The cost from a command to each colour on the screen, including the work of the process `beside`."""
    costs = []
    others = tree_seconds(beside) if beside else 0.0
    start = time.perf_counter()
    process = ros.start(*command)
    try:
        for colour in colours:
            while not shows(screen, colour):
                if process.poll() is not None:
                    sys.exit(f"{' '.join(command)} ended with status {process.returncode}")
                if time.perf_counter() - start > TIMEOUT:
                    sys.exit(f"{' '.join(command)}: no {colour} on the screen after {TIMEOUT:g} s")
                time.sleep(PERIOD)
            wall = time.perf_counter() - start
            work = tree_seconds(process.pid) + (tree_seconds(beside) if beside else 0.0) - others
            costs.append(Cost(wall, work))
    finally:
        stop(process)
        if not beside:  # a browser that was already open keeps its tab with the last picture
            wait_until_empty(screen)
    return costs


def until_refused(ros: Ros, command: tuple[str, ...]) -> Cost:
    """The cost until a command fails."""
    before, start = _children_seconds(), time.perf_counter()
    if ros.start(*command).wait(TIMEOUT) == 0:
        sys.exit(f"{' '.join(command)} did not fail")
    return Cost(time.perf_counter() - start, _children_seconds() - before)


def _children_seconds() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def wait_until_empty(screen: Path) -> None:
    """Wait until the last picture has disappeared."""
    colours = (PAGE_PLATE, RVIZ_GREY, RVIZ_PLATE)
    wait_until(lambda: not any(shows(screen, colour) for colour in colours), "an empty screen")


def shows(screen: Path, colour: tuple[int, int, int]) -> bool:
    """Whether a colour is on enough of the screen, with a tolerance for rounding. Checks every fourth
    pixel."""
    seen = picture(screen)[::2, ::2].astype(np.int16)
    return 4 * int((np.abs(seen - colour).max(axis=2) <= 2).sum()) > ENOUGH


def compared(ours: list[Cost], theirs: list[Cost]) -> str:
    """The medians of the rounds' ratios."""
    pairs = list(zip(ours, theirs, strict=True))
    wall = statistics.median(own.wall / other.wall for own, other in pairs)
    work = statistics.median(own.work / other.work for own, other in pairs)
    return f"{wall:.2f} (limit 1), in processor time {work:.2f}"


if __name__ == "__main__":
    main()
