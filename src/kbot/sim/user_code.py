"""Which code is the user's program, which line of it runs, and whether it lets time pass."""

from __future__ import annotations

import sys
import time
from pathlib import Path

EMPTY_SECONDS = 1.0
"""A call for 0 steps is the reason that time stands still if the last one is at most this old."""


class UserCode:
    """The program at `path`, and the modules in its folder except installed packages."""

    def __init__(self, path: str) -> None:
        self.path, self.name = path, Path(path).name or "Python"  # at Python's prompt, the path is empty
        self.folder = Path(path).resolve().parent

    def has(self, file: str) -> bool:
        path = Path(file)
        return file == self.path or (self.folder in path.parents and "site-packages" not in path.parts)

    def stands_still(self, thread: int, seconds: float, emptied: float) -> str:
        """Return one line: which line the program's thread runs, and for how long it has made no step.

        `emptied` is when it last called `sim.run` or `sim.step` for 0 steps, by `time.monotonic`.
        """
        frame = sys._current_frames().get(thread)
        while frame is not None and not self.has(frame.f_code.co_filename):
            frame = frame.f_back
        place = f"{shown_path(frame.f_code.co_filename)}:{frame.f_lineno}" if frame is not None else self.name
        if time.monotonic() - emptied < EMPTY_SECONDS:
            return f"{place} calls sim.run for 0 steps: simulated time has stood still for {int(seconds)} s"
        still = f"has not called sim.run for {int(seconds)} s: simulated time stands still"
        return f"{place} is running, but {still}"

    @property
    def made_no_step(self) -> str:
        """One line about a program that has ended without a step."""
        return f"{self.name} ended at 0 s: it never called sim.run(seconds), so no time passed"


def shown_path(path: str) -> str:
    """The path relative to the current folder, if it is below."""
    try:
        here = Path.cwd()
    except FileNotFoundError:  # a script may delete it
        return path
    return str(Path(path).relative_to(here)) if here in Path(path).parents else path
