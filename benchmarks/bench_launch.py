"""From `kbot launch` to the robot in the page, beside roslaunch to rviz's first frame.

Both carry out the chapter's corrected launch file (KBOT_SHARED, or `shared` beside the repository) and start
all that a user waits for: roslaunch its master, its nodes and rviz, which opens what was saved in it last;
KBot its server and Chromium, with a profile that has been used before. Both draw in software on one screen
(Xvfb), which tells when they are there: rviz's first frame by the grey of its picture, a robot by its plate.
In a second row Chromium is open already. The printed package makes no robot with either: it is compared how
soon that is said. Processor time is that of all processes of a command until then. The medians of
alternating rounds are compared; one before them does not count. It needs a ROS 1 (`make test-peers` installs
it) and Chromium.

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
OPEN = "the same, in a Chromium that is open"
FRAME = "roslaunch, to rviz's first frame"
ROBOT = "roslaunch, to the robot in rviz"
SOFTWARE = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")
"""WebGL without a graphics card, as rviz has OpenGL by LIBGL_ALWAYS_SOFTWARE."""
NEW_TAB, PAGE_PLATE, RVIZ_GREY, RVIZ_PLATE = (255, 255, 255), (176, 181, 192), (48, 48, 48), (180, 0, 0)
ENOUGH = 20_000
"""Pixels of a colour; a plate has twice as many."""
PERIOD = 0.03
"""Seconds between looks at the screen."""
PATIENCE = 180.0


class Cost(NamedTuple):
    """Until something is there: seconds that passed, and of processor time."""

    wall: float
    work: float


class Desk:
    """A home with one of the chapter's packages, where rviz and Chromium have been used before."""

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
        """The file that holds its picture."""
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
        """The process of a Chromium with nothing in it, that has come to rest."""
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
        sys.exit(f"there is no ROS 1 here: {', '.join(missing)} missing")
    if not CHAPTER.is_dir():
        sys.exit(f"the chapter is not at {CHAPTER} (set KBOT_SHARED)")
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
        print(f"{name}, beside {other}: {compared(rounds[name], rounds[other])}")


def one_round(desk: Desk, screen: Path, printed: Desk) -> Iterator[tuple[str, Cost]]:
    """What each costs, once."""
    page = until(desk.ros, desk.kbot_launch, screen, PAGE_PLATE)
    yield OURS, page[0]
    rviz = until(desk.ros, desk.roslaunch, screen, RVIZ_GREY, RVIZ_PLATE)
    yield from zip((FRAME, ROBOT), rviz, strict=True)
    with desk.open_browser(screen) as browser:
        yield OPEN, until(desk.ros, desk.kbot_launch, screen, PAGE_PLATE, beside=browser)[0]
    yield "kbot launch, printed: to its error", until_refused(printed.ros, printed.kbot_launch)
    yield "roslaunch, printed: to its error", until_refused(printed.ros, printed.roslaunch)


def until(
    ros: Ros,
    command: tuple[str, ...],
    screen: Path,
    *colours: tuple[int, int, int],
    beside: int | None = None,
) -> list[Cost]:
    """From a command to each of these colours on the screen; with the work of a process `beside` it."""
    costs = []
    others = tree_seconds(beside) if beside else 0.0
    start = time.perf_counter()
    process = ros.start(*command)
    try:
        for colour in colours:
            while not shows(screen, colour):
                if process.poll() is not None:
                    sys.exit(f"{' '.join(command)}: it ended with status {process.returncode}")
                if time.perf_counter() - start > PATIENCE:
                    sys.exit(f"{' '.join(command)}: no {colour} on the screen after {PATIENCE:g} s")
                time.sleep(PERIOD)
            wall = time.perf_counter() - start
            work = tree_seconds(process.pid) + (tree_seconds(beside) if beside else 0.0) - others
            costs.append(Cost(wall, work))
    finally:
        stop(process)
        if not beside:  # a browser that was open before keeps its tab, with the last picture in it
            wait_until_empty(screen)
    return costs


def until_refused(ros: Ros, command: tuple[str, ...]) -> Cost:
    """To the end of a command that fails."""
    before, start = _children_seconds(), time.perf_counter()
    if ros.start(*command).wait(PATIENCE) == 0:
        sys.exit(f"{' '.join(command)} did not fail")
    return Cost(time.perf_counter() - start, _children_seconds() - before)


def _children_seconds() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def wait_until_empty(screen: Path) -> None:
    """Until what was shown last is gone."""
    colours = (PAGE_PLATE, RVIZ_GREY, RVIZ_PLATE)
    wait_until(lambda: not any(shows(screen, colour) for colour in colours), "an empty screen")


def shows(screen: Path, colour: tuple[int, int, int]) -> bool:
    """Whether enough of a screen is of a colour, as drivers round it; every fourth pixel is looked at."""
    seen = picture(screen)[::2, ::2].astype(np.int16)
    return 4 * int((np.abs(seen - colour).max(axis=2) <= 2).sum()) > ENOUGH


def compared(ours: list[Cost], theirs: list[Cost]) -> str:
    """The medians of the rounds' ratios."""
    pairs = list(zip(ours, theirs, strict=True))
    wall = statistics.median(one.wall / other.wall for one, other in pairs)
    work = statistics.median(one.work / other.work for one, other in pairs)
    return f"{wall:.2f} (bound 1), in processor time {work:.2f}"


if __name__ == "__main__":
    main()
