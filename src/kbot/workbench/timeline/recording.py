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
MOST_DOWNLOADED = 500_000_000
"""Bytes of a recording that a page can download. It is loaded into memory."""


class RunRecording:
    """One recording at a time, each in a new file in `folder`."""

    def __init__(self, folder: str = "") -> None:
        """An empty `folder` means the current folder."""
        self.folder = folder or str(Path.cwd())
        self._recorder: Recorder | None = None
        self._simulation: Simulation | None = None
        self._since = 0.0
        self._ended: list[str] = []
        self._made: dict[str, str] = {}

    def begin(self, simulation: Simulation, world: str) -> None:
        """Start recording. `world` is the name or file of the world.

        Raises:
            KbotError: the run is already being recorded, or the file cannot be created.
        """
        if simulation.journal.write is not None:
            what = f"to {self._recorder.path}" if self._recorder is not None else "by --record"
            raise KbotError(f"the run is already being recorded {what}")
        self.end()  # an earlier recording that failed
        feed = Feed(simulation.bus, lambda: simulation.clock.nanoseconds)
        self._recorder = Recorder(simulation, feed, self._new_name(simulation.robot.name), world=world)
        self._simulation, self._since = simulation, simulation.time

    def end(self) -> None:
        """Close the file, if one is open."""
        # first, because two threads can end it: that of a new reading, and that of the timeline
        recorder, self._recorder, self._simulation = self._recorder, None, None
        if recorder is None:
            return
        recorder.close()
        self._ended.append(recorder.path)
        self._made[Path(recorder.path).name] = recorder.path

    def take_ended(self) -> Recorded | None:
        """Return a recording that has ended, once."""
        if not self._ended:
            return None
        file = self._ended.pop(0)
        return Recorded(file, f"{ADDRESS}{quote(Path(file).name)}" if _size(file) <= MOST_DOWNLOADED else "")

    def content(self, name: str) -> bytes | None:
        """Return a finished recording by the last part of its address, or None if it is missing or too
        large."""
        file = self._made.get(unquote(name))
        if file is None or _size(file) > MOST_DOWNLOADED:
            return None
        try:
            return Path(file).read_bytes()
        except OSError:
            return None  # the file was deleted

    def take_failure(self) -> KbotError | None:
        """Return why the recording failed, once. The recording has then ended."""
        failure = self._recorder.failure if self._recorder is not None else None
        if failure is not None:
            self.end()
        return failure

    def view(self) -> RecordingView | None:
        """Return the progress of the recording."""
        recorder, simulation = self._recorder, self._simulation  # another thread may end the recording now
        if recorder is None or simulation is None:
            return None
        seconds = max(0.0, round(simulation.time - self._since, 1))
        return RecordingView(recorder.path, _size(recorder.path), seconds)

    def _new_name(self, robot: str) -> str:
        stem = f"{plain_file_name(robot)}-{datetime.now():%Y%m%d-%H%M%S}"
        names = [stem, *(f"{stem}-{number}" for number in range(2, 100))]
        return str(next(p for name in names if not (p := Path(self.folder, f"{name}.mcap")).exists()))


def _size(file: str) -> int:
    """Return the size in bytes, or 0 if the file was deleted."""
    try:
        return Path(file).stat().st_size
    except OSError:
        return 0
