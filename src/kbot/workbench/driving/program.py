"""The user's program that drives the simulation, as the server and its pages see it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, NoReturn, Protocol

from kbot.text import KbotError
from kbot.text.errors import Stopped
from kbot.workbench.driving.turns import WAITING_SECONDS, Turns
from kbot.workbench.protocol import ProgramPhase, ProgramView

if TYPE_CHECKING:
    from kbot.sim import Simulation
    from kbot.sim.stepping import Stepping
    from kbot.sim.user_code import UserCode

SLICE_SECONDS = 0.01
"""Simulated seconds that a program steps at once. Pages act on the simulation between two slices."""
BEHIND_SECONDS = 0.2
"""Seconds of wall-clock time that a program catches up. If it computes for longer, the simulation falls
behind."""
HELD_SECONDS = 0.03
"""Longest wall-clock time without lending when the simulation is slower than real time."""
NEVER = float("-inf")
"""When the first slice is due, before it is requested."""
SMOOTHING_SECONDS = 0.5
"""Time over which the real-time factor is averaged."""
BUSY_SECONDS = 1
"""Seconds without a step after which pages report that the program computes."""


class PagePace(Protocol):
    """What pages set: how fast time runs."""

    speed: float
    rate: float
    paused: bool


class Program:
    """A program drives the simulation on its own thread and lends it to the server between two slices.

    Between `begin` and `finish` its steps are paced to real time, and to the speed and pause of the page.
    """

    def __init__(self, code: UserCode, turns: Turns, pace: PagePace, can_start: bool = False) -> None:
        """`can_start` means that a page can start the program. The program's thread has the simulation."""
        self.code, self.turns, self._pace = code, turns, pace
        self.name = code.name
        self.can_start = can_start
        self.interrupt: Callable[[], None] = lambda: None
        """Called on any thread to interrupt the program after `stop` and `restart`."""
        self.files: Callable[[], tuple[str, ...]] = tuple
        """Returns the files of the program. When one is saved, the program starts again."""
        self.began = time.time_ns()
        """Wall-clock time in ns at which the program started last."""
        self.wants_start = False
        """Whether a page or a saved file asks to start the program again."""
        self.phase: ProgramPhase = "waiting"
        self._error = self._note = ""
        self._busy_text = (0.0, 0, "")
        """When the program made its last step, the seconds since then, and the line about that."""
        self._thread = 0
        self.is_lending = False
        """Whether the program waits in a step, and the server may use the simulation."""
        self._is_ending = False
        self.was_interrupted = False
        """Whether the program was started again while it ran. Its run stays paused if it was."""
        self._due = self._lent = self._stepped = self._waited = 0.0
        self._stepping: Stepping | None = None
        """The steps that the program makes."""
        self._left = self._slice = 0
        self._timestep = 1.0
        self._granted = 0.0

    # the server's side

    @property
    def is_running(self) -> bool:
        return self.phase == "running"

    @property
    def owns_time(self) -> bool:
        """Whether only the program may advance the simulation: it drives, or is about to."""
        return self.phase in ("waiting", "running")

    @property
    def is_stopping(self) -> bool:
        """Whether the running program was asked to end."""
        return self.is_running and self._is_ending

    def view(self) -> ProgramView:
        note = self._note_while_running() if self.is_running else self._note
        return ProgramView(self.name, self.phase, note, self.can_start, self._error)

    def _note_while_running(self) -> str:
        """The line about a program that has made no step for long. It changes once a second."""
        last = max(self._waited, self._lent)
        seconds = int(time.monotonic() - last)
        if seconds < BUSY_SECONDS:
            return ""
        if self._busy_text[:2] != (last, seconds):
            emptied = self._stepping.emptied if self._stepping is not None else NEVER
            self._busy_text = last, seconds, self.code.stands_still(self._thread, seconds, emptied)
        return self._busy_text[2]

    def stop(self) -> None:
        """End the program. May be called on any thread."""
        self.wants_start = False
        self._end()

    def restart(self) -> None:
        """Start the program again, and end it first if it runs. May be called on any thread."""
        self.wants_start = True
        self._end()

    def start(self) -> None:
        """Start the program again, as a page requests.

        Raises:
            KbotError: a page cannot start it.
        """
        if not self.can_start:
            raise KbotError(f"start {self.name} again where you started it")
        self.restart()

    def grant(self, seconds: float) -> None:
        """Let a paused program step for some simulated seconds."""
        self._granted += seconds

    def _end(self) -> None:
        if self.is_running:
            self._is_ending = True
            self.interrupt()

    # the program's side

    def begin(self, simulation: Simulation) -> None:
        """Pace the steps of a simulation from now on, on this thread."""
        now = time.monotonic()
        self._thread, self.began = threading.get_ident(), time.time_ns()
        self._is_ending = self.wants_start = False
        self._timestep = simulation.timestep
        self._slice = max(1, round(SLICE_SECONDS / simulation.timestep))
        self._left, self._granted = 0, 0.0
        self._due = NEVER
        self._lent = self._stepped = self._waited = now
        self._error, self.phase = "", "running"
        self._stepping = simulation.stepping
        self._stepping.pace = self

    def finish(self, simulation: Simulation, phase: ProgramPhase, error: str = "", note: str = "") -> None:
        """Stop pacing. `error` is that of a failed program, `note` what pages show about a finished one."""
        simulation.stepping.pace = None
        self.was_interrupted = self._is_ending and self.wants_start
        self._error, self._note, self.phase = error, note, phase

    def prepare(self) -> None:
        """Keep the server from advancing the simulation until `begin` or `fail`."""
        self._error, self._note, self.phase = "", "", "waiting"

    def fail(self, error: str) -> None:
        """Report that the program could not start."""
        self.wants_start = self.was_interrupted = False
        self._error, self.phase = error, "failed"

    def wait(self, steps: int) -> int:
        """Wait until the next slice is due. Returns how many of the steps may be made now."""
        if threading.get_ident() != self._thread:
            return steps
        if self._is_ending:
            self._stop()
        if steps == 0:
            return 0  # no step makes no slice due
        if self._left == 0:
            self._end_slice()
        allowed = min(steps, self._left)
        self._left -= allowed
        self._waited = time.monotonic()
        return allowed

    def _end_slice(self) -> None:
        seconds = self._slice * self._timestep
        if self._due == NEVER:  # the first step since `begin`
            self._due = time.monotonic()
        self._due += seconds / self._pace.speed
        while (ahead := self._due - time.monotonic()) > 0.0:
            self._lend(min(ahead, WAITING_SECONDS))  # the page may change the speed or pause
        if time.monotonic() - self._lent > HELD_SECONDS:
            self._lend(0.0)
        while self._pace.paused and self._granted <= 0.0:
            self._lend(WAITING_SECONDS)
            self._due = self._stepped = time.monotonic()
        self._granted = max(0.0, self._granted - seconds)
        now = time.monotonic()
        self._due = max(self._due, now - BEHIND_SECONDS)
        if now > self._stepped:
            wall = now - self._stepped
            self._pace.rate += (seconds / wall - self._pace.rate) * min(1.0, wall / SMOOTHING_SECONDS)
        self._stepped = now
        self._left = self._slice

    def _lend(self, seconds: float) -> None:
        self.is_lending = True
        try:
            self.turns.lend(seconds)
        finally:
            self.is_lending = False
        self._lent = time.monotonic()
        if self._is_ending:
            self._stop()

    def _stop(self) -> NoReturn:
        raise Stopped
