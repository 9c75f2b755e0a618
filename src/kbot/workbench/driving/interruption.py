"""Interrupts the user's program on the main thread, where it can be interrupted without harm."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from types import FrameType
from typing import Any

from kbot.sim.script import Script
from kbot.text.errors import Stopped
from kbot.workbench.driving.program import Program

RETRY_SECONDS = 0.05
"""Seconds between two attempts while KBot's own code runs for the program."""
CAUGHT_SECONDS = 0.5
"""Seconds after which the program probably catches `Stopped`, in a loop with `except:`."""
PATIENCE_SECONDS = 2.0
"""Seconds after which the program is interrupted in KBot's own code too, such as a long search for a path."""

ENDING = ("SIGINT", "SIGTERM", "SIGHUP")
"""Signals that end the run: Ctrl-C, `kill`, and a closed terminal. Windows lacks the last one."""


class Interruption:
    """Ends the program of `kbot sim --script` when a page or the terminal asks for it.

    `Stopped` is raised where the user's code runs, so that KBot's own state stays whole. The steps of a
    simulation raise it themselves. A program that catches it is interrupted again.
    """

    def __init__(self, program: Program) -> None:
        self._program = program
        self._is_own = False
        """Whether the next signal comes from `interrupt`, and not from the terminal."""
        self._asked = 0.0
        self._traces = False
        self._thread: threading.Thread | None = None
        self.is_over = False
        """Whether a signal ended the whole run."""
        program.interrupt = self.interrupt

    def __enter__(self) -> Interruption:
        numbers = [getattr(signal, name) for name in ENDING if hasattr(signal, name)]
        self._before = {number: signal.signal(number, self._on_signal) for number in numbers}
        return self

    def __exit__(self, *_: object) -> None:
        self._program.interrupt = lambda: None
        if self._thread is not None:
            self._thread.join()
        for number, handler in self._before.items():
            signal.signal(number, handler)

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
        else:
            self.is_over = True
            self._program.stop()
        if not self._program.is_stopping:
            return
        since = time.monotonic() - self._asked
        if since > CAUGHT_SECONDS:
            self._traces = True
            _stop_at_next_line(frame)
        if _is_in_script(frame, is_late=since > PATIENCE_SECONDS):
            raise Stopped


def signal_main_thread() -> None:
    """Send SIGINT to the main thread, so that it also wakes up from a sleep."""
    if os.name == "nt":
        signal.raise_signal(signal.SIGINT)  # Windows wakes up the main thread from any thread
    else:
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)


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
