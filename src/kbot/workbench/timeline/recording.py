"""A recording that a page begins and ends."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from kbot.record import Recorder
from kbot.text import KbotError
from kbot.wire import Feed
from kbot.workbench.protocol import RecordingView

if TYPE_CHECKING:
    from kbot.sim import Simulation


class RunRecording:
    """One recording at a time, in `folder`, each in a file of its own."""

    def __init__(self, folder: str = ".") -> None:
        self.folder = folder
        self._recorder: Recorder | None = None
        self._simulation: Simulation | None = None
        self._since = 0.0

    def begin(self, simulation: Simulation, world: str) -> None:
        """Record from now on; `world` is the text that named the world.

        Raises:
            KbotError: the run is recorded already, or the file cannot be made.
        """
        if simulation.journal is not None:
            what = f"to {self._recorder.path}" if self._recorder is not None else "by --record"
            raise KbotError(f"the run is recorded already, {what}")
        self.end()  # an earlier one that broke off
        feed = Feed(simulation.bus, lambda: simulation.clock.nanoseconds)
        self._recorder = Recorder(simulation, feed, self._new_name(simulation.robot.name), world=world)
        self._simulation, self._since = simulation, simulation.time

    def end(self) -> None:
        """Close the file, if one is open."""
        try:
            if self._recorder is not None:
                self._recorder.close()
        finally:
            self._recorder = self._simulation = None

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
        try:
            size = Path(self._recorder.path).stat().st_size
        except OSError:
            size = 0  # somebody took the file away while it is written
        seconds = max(0.0, round(self._simulation.time - self._since, 1))
        return RecordingView(self._recorder.path, size, seconds)

    def _new_name(self, robot: str) -> str:
        stem = f"{robot}-{datetime.now():%Y%m%d-%H%M%S}"
        names = [stem, *(f"{stem}-{number}" for number in range(2, 100))]
        return str(next(p for name in names if not (p := Path(self.folder, f"{name}.mcap")).exists()))
