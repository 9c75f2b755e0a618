"""Starts, watches, restarts and ends the processes of a launch, as roslaunch does."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from kbot.text import Diagnostic, KbotError, Origin, Severity
from kbot.worker import children
from kbot.worker.children import Child

SIGINT_SECONDS = 15.0
SIGTERM_SECONDS = 2.0
"""Seconds that a process has to exit after each signal, as in roslaunch."""
_POLL_S = 0.05
"""Seconds between two checks whether a process has exited."""


@dataclass(frozen=True, slots=True)
class Process:
    """A process to run.

    name      the full name of the node
    folder    the working folder
    log       the file for its output; None for the terminal
    respawn   seconds from its exit to its restart; None if it is not restarted
    required  whether its exit ends the launch
    delay     seconds to its start, from the start of the launch or from `after`
    after     the event that its start waits for: `start` or `exit`, and the name of the other node
    origin    where the launch file names it
    """

    name: str
    command: Sequence[str]
    environment: Mapping[str, str]
    folder: str
    log: Path | None = None
    respawn: float | None = None
    required: bool = False
    delay: float = 0.0
    after: tuple[str, str] | None = None
    origin: Origin | None = None


class Processes:
    """Runs processes until `close`. A separate thread watches them."""

    def __init__(
        self,
        processes: Sequence[Process],
        report: Callable[[str], None],
        end: Callable[[], None],
        failed: Callable[[Diagnostic], None] = lambda finding: None,
    ) -> None:
        """`report` receives sentences for the user, and `failed` a finding about each process that fails.
        `end` is called when a required process exits. All are called on another thread."""
        self._report, self._end, self._failed = report, end, failed
        self._running: dict[str, tuple[Process, Child]] = {}
        self._failures: set[str] = set()
        self._due: list[tuple[float, Process]] = []
        self._waiting: list[Process] = []
        self.status = 0
        """The exit status of the launch: 1 if a required process failed, otherwise 0."""
        self._closed, self._lock = threading.Event(), threading.Lock()
        now = time.monotonic()
        known = {process.name for process in processes}
        for process in processes:
            if process.after is not None and process.after[1] in known:
                self._waiting.append(process)
            else:
                self._due.append((now + process.delay, process))
        self._thread = threading.Thread(target=self._watch, daemon=True, name="kbot-processes")
        self._thread.start()

    @property
    def have_ended(self) -> bool:
        """Whether no process is running or waiting to start."""
        with self._lock:
            return not (self._running or self._due or self._waiting)

    def close(self) -> None:
        """End all processes and the processes that they started: SIGINT, later SIGTERM, then SIGKILL. Another
        Ctrl-C sends SIGKILL at once."""
        self._closed.set()
        self._thread.join()
        try:
            self._end_all()
        finally:
            for _, running in self._running.values():
                running.kill_all()  # processes that are left, and their children

    def _end_all(self) -> None:
        left = [running for _, running in self._running.values() if running.poll() is None]
        for number, seconds in _ENDINGS:
            for running in left:
                running.signal_all(number)
            deadline = time.monotonic() + seconds
            while left and time.monotonic() < deadline:
                left = [running for running in left if running.poll() is None]
                time.sleep(0.01)

    def _watch(self) -> None:
        while not self._closed.wait(_POLL_S):
            with self._lock:
                self._poll()

    def _poll(self) -> None:
        now = time.monotonic()
        due = [process for at, process in self._due if at <= now]
        self._due = [entry for entry in self._due if entry[0] > now]
        for process in due:
            self._start(process)
        for name, (process, running) in list(self._running.items()):
            status = running.poll()
            if status is not None:
                del self._running[name]
                self._ended(process, status)

    def _start(self, process: Process) -> None:
        try:
            running = start(process)
        except KbotError as error:
            self._report(str(error))
            self._fail(process, str(error))
            self._ended(process, 127, silently=True)
            return
        self._running[process.name] = process, running
        self._follow("start", process)

    def _ended(self, process: Process, status: int, silently: bool = False) -> None:
        where = f"; its output is in {process.log}" if process.log and status else ""
        if status and not silently:
            self._fail(process, f"{process.name} exited with status {status}{where}")
        if process.respawn is not None:
            self._report(f"{process.name} exited with status {status} and is restarted{where}")
            self._due.append((time.monotonic() + process.respawn, process))
        elif process.required:
            self._report(
                f"{process.name} is required and exited with status {status}: the launch ends{where}"
            )
            self.status = 1 if status else 0
            self._end()
        elif not silently:
            how = "exited" if status == 0 else f"exited with status {status}"
            self._report(f"{process.name} {how}{where}")
        self._follow("exit", process)

    def _fail(self, process: Process, message: str) -> None:
        if process.name not in self._failures:  # one that is restarted may fail again and again
            self._failures.add(process.name)
            hint = "read the output of the node"
            self._failed(Diagnostic("L090", Severity.ERROR, message, process.origin, hint))

    def _follow(self, event: str, process: Process) -> None:
        now = time.monotonic()
        ready = [waiting for waiting in self._waiting if waiting.after == (event, process.name)]
        self._waiting = [waiting for waiting in self._waiting if waiting not in ready]
        self._due += [(now + waiting.delay, waiting) for waiting in ready]


def start(process: Process) -> Child:
    """Start a process in its own process group, so that only KBot passes Ctrl-C in the terminal to it.

    Raises:
        KbotError: it cannot be started.
    """
    try:
        log = process.log.open("ab") if process.log else None
        try:
            return children.start(
                process.command,
                environment=process.environment,
                folder=process.folder,
                stdout=log,
                stderr=children.STDOUT if log else None,
            )
        finally:
            if log:
                log.close()
    except OSError as error:
        raise KbotError(f"{process.name} cannot be started: {error.strerror or error}") from None


# Windows disables Ctrl-C in a new process group, but not Ctrl-Break
_INTERRUPT: int = getattr(signal, "CTRL_BREAK_EVENT", signal.SIGINT)
_KILL: int = getattr(signal, "SIGKILL", signal.SIGTERM)
_ENDINGS = ((_INTERRUPT, SIGINT_SECONDS), (signal.SIGTERM, SIGTERM_SECONDS), (_KILL, 5.0))
"""The signals that end a process, and the seconds to wait after each."""
