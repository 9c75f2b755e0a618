"""A recording that a page starts and stops."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote, unquote

from kbot.record import Recorder
from kbot.record.feed import Feed
from kbot.text import KbotError
from kbot.text.file_names import plain_file_name
from kbot.workbench.protocol import Recorded, RecordingView

if TYPE_CHECKING:
    from kbot.sim import Simulation

ADDRESS = "/recording/"
MOST_GIVEN = 500_000_000
"""Bytes of a recording that a page is given: it goes through memory."""


class RunRecording:
    """One recording at a time, in `folder`, each in a file of its own."""

    def __init__(self, folder: str = "") -> None:
        """`folder` empty is the one that KBot was started in."""
        self.folder = folder or str(Path.cwd())
        self._recorder: Recorder | None = None
        self._simulation: Simulation | None = None
        self._since = 0.0
        self._ended: list[str] = []
        self._made: dict[str, str] = {}

    def begin(self, simulation: Simulation, world: str) -> None:
        """Record from now on; `world` is the text that named the world.

        Raises:
            KbotError: the run is recorded already, or the file cannot be made.
        """
        if simulation.journal.write is not None:
            what = f"to {self._recorder.path}" if self._recorder is not None else "by --record"
            raise KbotError(f"the run is recorded already, {what}")
        self.end()  # an earlier one that broke off
        feed = Feed(simulation.bus, lambda: simulation.clock.nanoseconds)
        self._recorder = Recorder(simulation, feed, self._new_name(simulation.robot.name), world=world)
        self._simulation, self._since = simulation, simulation.time

    def end(self) -> None:
        """Close the file, if one is open."""
        if self._recorder is None:
            return
        try:
            self._recorder.close()
            self._ended.append(self._recorder.path)
            self._made[Path(self._recorder.path).name] = self._recorder.path
        finally:
            self._recorder = self._simulation = None

    def take_ended(self) -> Recorded | None:
        """A recording that has ended, told once."""
        if not self._ended:
            return None
        file = self._ended.pop(0)
        return Recorded(file, f"{ADDRESS}{quote(Path(file).name)}" if _size(file) <= MOST_GIVEN else "")

    def content(self, name: str) -> bytes | None:
        """A recording that was made, by the last part of its address; None where it is not there, or too
        large."""
        file = self._made.get(unquote(name))
        if file is None or _size(file) > MOST_GIVEN:
            return None
        try:
            return Path(file).read_bytes()
        except OSError:
            return None  # somebody took it away

    def take_failure(self) -> KbotError | None:
        """Why the recording broke off, told once; it has ended then."""
        failure = self._recorder.failure if self._recorder is not None else None
        if failure is not None:
            self.end()
        return failure

    def view(self) -> RecordingView | None:
        """How far it is."""
        if self._recorder is None or self._simulation is None:
            return None
        seconds = max(0.0, round(self._simulation.time - self._since, 1))
        return RecordingView(self._recorder.path, _size(self._recorder.path), seconds)

    def _new_name(self, robot: str) -> str:
        stem = f"{plain_file_name(robot)}-{datetime.now():%Y%m%d-%H%M%S}"
        names = [stem, *(f"{stem}-{number}" for number in range(2, 100))]
        return str(next(p for name in names if not (p := Path(self.folder, f"{name}.mcap")).exists()))


def _size(file: str) -> int:
    """In bytes; 0 where somebody took the file away."""
    try:
        return Path(file).stat().st_size
    except OSError:
        return 0
