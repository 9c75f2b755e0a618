"""Interrupts the user's program on the main thread, where it can be interrupted without harm."""

from __future__ import annotations

import signal
import sys
import threading
import time
from collections.abc import Callable
from types import FrameType
from typing import Any, Protocol

from kbot.sim.script import Script
from kbot.text.errors import Stopped
from kbot.text.signals import ending_signals, signal_main_thread

RETRY_SECONDS = 0.05
"""Seconds between two attempts while KBot's own code runs for the program."""
CAUGHT_SECONDS = 0.5
"""Seconds after which the program probably catches `Stopped`, in a loop with `except:`."""
PATIENCE_SECONDS = 2.0
"""Seconds that KBot's own code gets to end, so that a page's simulation stays whole."""


class Interruptible(Protocol):
    """A program that can be asked to end. It then calls `interrupt`."""

    interrupt: Callable[[], None]

    @property
    def is_stopping(self) -> bool:
        """Whether the program was asked to end, and still runs."""
        ...

    def stop(self) -> None: ...


class Interruption:
    """Ends the program of `kbot sim --script` when a page or the terminal asks for it.

    `Stopped` is raised where the user's code runs, so that KBot's own state stays whole. The steps of a
    simulation raise it themselves. A program that catches it is interrupted again.
    """

    def __init__(
        self,
        program: Interruptible,
        raise_error: Callable[[BaseException], None],
        patience: float = PATIENCE_SECONDS,
    ) -> None:
        """`raise_error` raises an error where it does no harm, as `RunOutputs.interrupt`.

        After `patience` seconds the program is interrupted in KBot's own code too, such as a long search for
        a path.
        """
        self._program, self._raise, self._patience = program, raise_error, patience
        self._is_own = False
        """Whether the next signal comes from `interrupt`, and not from the terminal."""
        self._asked = 0.0
        self._traces = False
        self._thread: threading.Thread | None = None
        self.ended_by: int | None = None
        """The signal that ended the whole run."""
        program.interrupt = self.interrupt

    def __enter__(self) -> Interruption:
        # `_insist` sends SIGINT, even if the caller ignores it
        numbers: set[int] = {*ending_signals(), signal.SIGINT}
        self._before = {number: signal.signal(number, self._on_signal) for number in numbers}
        return self

    def __exit__(self, *_: object) -> None:
        self._program.interrupt = lambda: None
        if self._thread is not None:
            self._thread.join()
        for number, handler in self._before.items():
            signal.signal(number, handler)

    @property
    def is_over(self) -> bool:
        return self.ended_by is not None

    def listen(self) -> None:
        """Handle the signals again after a program that may have replaced the handlers."""
        for number in self._before:
            signal.signal(number, self._on_signal)

    def interrupt(self) -> None:
        """Interrupt the program until it has ended. May be called on any thread."""
        if self._thread is None or not self._thread.is_alive():
            self._asked = time.monotonic()
            self._thread = threading.Thread(target=self._insist, daemon=True, name="kbot-stop")
            self._thread.start()

    def stop_tracing(self) -> None:
        """Undo what ends a program that catches `Stopped`."""
        if self._traces:
            self._traces = False
            sys.settrace(None)

    def _insist(self) -> None:
        while self._program.is_stopping:
            self._is_own = True
            signal_main_thread()
            time.sleep(RETRY_SECONDS)

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        if self._is_own and number == signal.SIGINT:
            self._is_own = False
        elif self._before[number] != signal.SIG_IGN:
            self.ended_by = number
            self._program.stop()
        if not self._program.is_stopping:
            return
        since = time.monotonic() - self._asked
        if since > CAUGHT_SECONDS:
            self._traces = True
            _stop_at_next_line(frame)
        if _is_in_script(frame, is_late=since >= self._patience):
            self._raise(Stopped())


def _stop_at_next_line(frame: FrameType | None) -> None:
    """Raise `Stopped` at the next line of the script's own code, which may be that of an `except:`."""

    # Any: as sys.settrace requires
    def trace(at: FrameType, event: str, _: Any) -> Callable[..., Any] | None:  # noqa: ANN401
        if str(at.f_globals.get("__name__")).partition(".")[0] == "kbot":
            return None
        if event == "line":
            raise Stopped  # this also ends the tracing
        return trace

    while frame is not None and frame.f_code is not Script.call.__code__:
        if str(frame.f_globals.get("__name__")).partition(".")[0] != "kbot":
            frame.f_trace = trace
        frame = frame.f_back
    if frame is not None:
        sys.settrace(trace)


def _is_in_script(frame: FrameType | None, *, is_late: bool) -> bool:
    """Whether the script's own code runs, or with `is_late` also KBot's on its behalf."""
    while frame is not None:
        if frame.f_code is Script.call.__code__:
            return True
        if not is_late and str(frame.f_globals.get("__name__")).partition(".")[0] == "kbot":
            return False
        frame = frame.f_back
    return False
