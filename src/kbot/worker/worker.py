"""Calls functions in another process, and ends it when a call exceeds its limits."""

from __future__ import annotations

import atexit
import os
import pickle
import queue
import signal
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from subprocess import TimeoutExpired
from typing import TYPE_CHECKING, TypeVar, TypeVarTuple

from kbot.text import KbotError
from kbot.worker.child import Answer, Request, Surroundings
from kbot.worker.children import Child
from kbot.worker.process import start

if TYPE_CHECKING:
    import psutil

T = TypeVar("T")
Ts = TypeVarTuple("Ts")

CLOCK = 10
"""By the clock, a call may take this many times its processor time: the machine may be busy."""
LOOK_SECONDS = 0.05
"""Seconds between two checks of the process. In that time it may take about 100 MB more."""
CLOSING_SECONDS = 5.0
"""A process that ends closes its pipes a moment before."""
CORES = os.cpu_count() or 1
"""A process takes at most this many seconds of processor time in each second."""
_KILLED = (-signal.SIGTERM, -getattr(signal, "SIGKILL", signal.SIGTERM))


@dataclass(frozen=True, slots=True)
class WorkerLimits:
    """The most that one call may take: seconds of processor time, and bytes of memory of its process."""

    seconds: float = 30.0
    memory: int = 3_000_000_000


class LimitExceeded(KbotError):
    """A call was stopped. The text begins with a verb, for a sentence about what was called.

    `is_late` means that a higher limit of time may help.
    """

    def __init__(self, text: str, *, is_late: bool = False) -> None:
        super().__init__(text)
        self.is_late = is_late


class ProcessEnded(LimitExceeded):
    """The process ended during a call.

    `was_killed`: by someone else, such as the system when memory runs out. The call may succeed if repeated.
    """

    def __init__(self, status: int) -> None:
        super().__init__(f"ended its process, with status {status}")
        self.status = status

    @property
    def was_killed(self) -> bool:
        return self.status in _KILLED


class Worker:
    """A process that starts with the first call, and stays for the next ones.

    What takes long there delays nothing in the process that calls, and can be ended.
    """

    def __init__(self) -> None:
        self.limits = WorkerLimits()
        self.surroundings: Surroundings | None = None
        """Where calls work. None: where this process is at each call, which is slow to read."""
        self._spent: float | None = None
        """The processor time in s that the process took before the call. None if it has not been read."""
        self._process: Child | None = None
        self._observed: psutil.Process | None = None
        self._line = _Line()
        self._turn = threading.Lock()

    def call(self, work: Callable[[*Ts], T], *arguments: *Ts) -> T:
        """Return the result of a module's function. It is pickled, and so are the arguments.

        Calls of several threads take turns.

        Raises:
            LimitExceeded: the call exceeded a limit, or ended its process.
            Exception: what the function raised.
        """
        surroundings = self.surroundings or Surroundings.of_this_process()
        request = pickle.dumps(Request(surroundings, work, arguments), pickle.HIGHEST_PROTOCOL)
        with self._turn:
            process = self._started()
            self._line.requests.put(request)
            try:
                result, error, self._spent = self._wait(process, self._line.answers)
            except BaseException:  # also Ctrl-C: a later answer would be taken for that of the next call
                self.end()
                raise
        if error is not None:
            raise error
        return result  # type: ignore[no-any-return]  # what `work` returns

    def _started(self) -> Child:
        if self._process is None or self._process.poll() is not None:
            self._process = start("kbot.worker.child")
            self._spent = None
            atexit.register(self.end)
            self._line.requests.put(None)  # of a process that ended between two calls
            self._line = _Line()
            threading.Thread(target=_exchange, args=(self._process, self._line), daemon=True).start()
        return self._process

    def _wait(self, process: Child, answers: queue.SimpleQueue[Answer | None]) -> Answer:
        limits, began = self.limits, time.monotonic()
        while True:
            with suppress(queue.Empty):
                answer = answers.get(timeout=LOOK_SECONDS)
                if answer is None:
                    raise ProcessEnded(_status(process))
                return answer
            elapsed = time.monotonic() - began
            self._require_limits(process, limits, elapsed)
            if elapsed > CLOCK * limits.seconds:
                waited = f"{CLOCK * limits.seconds:g} s"
                raise LimitExceeded(f"waited longer than {waited} and was stopped", is_late=True)

    def _require_limits(self, process: Child, limits: WorkerLimits, elapsed: float) -> None:
        """Raises LimitExceeded: a call that began `elapsed` seconds ago took too much."""
        import psutil  # imported lazily: only servers use it

        with suppress(psutil.NoSuchProcess):  # it has ended, which the answer shows
            if self._observed is None or self._observed.pid != process.pid:
                self._observed = psutil.Process(process.pid)
            if self._observed.memory_info().rss > limits.memory:
                most = f"{limits.memory / 1e9:g} GB"
                raise LimitExceeded(f"took more than {most} of memory and was stopped")
            if self._spent is None:
                self._spent = _processor_seconds(self._observed)
            may_be_late = elapsed * CORES > limits.seconds  # reading the processor time is slow
            if may_be_late and _processor_seconds(self._observed) - self._spent > limits.seconds:
                raise LimitExceeded(f"took longer than {limits.seconds:g} s and was stopped", is_late=True)

    def end(self) -> None:
        """End the process. The next call starts another one."""
        process, self._process = self._process, None
        self._observed = None
        atexit.unregister(self.end)
        self._line.requests.put(None)
        if process is not None:
            process.end()


def _processor_seconds(process: psutil.Process) -> float:
    times = process.cpu_times()
    return times.user + times.system


def _status(process: Child) -> int:
    """The exit status of a process that closed the pipe of the answers. It may still run."""
    with suppress(TimeoutExpired):
        return process.wait(CLOSING_SECONDS)
    process.kill_all()
    return process.wait()


class _Line:
    """Requests to a process, and its answers. None ends the requests, and is the answer of a lost process."""

    def __init__(self) -> None:
        self.requests: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        self.answers: queue.SimpleQueue[Answer | None] = queue.SimpleQueue()


def _exchange(process: Child, line: _Line) -> None:
    """Send requests, and queue their answers, until the process ends."""
    answer: Answer | None
    while (request := line.requests.get()) is not None:
        answer = None
        with suppress(OSError, EOFError, pickle.UnpicklingError, ValueError):  # ValueError: a closed pipe
            if process.stdin is not None and process.stdout is not None:
                process.stdin.write(len(request).to_bytes(8, "little") + request)
                process.stdin.flush()
                answer = pickle.load(process.stdout)  # from KBot's own code
        line.answers.put(answer)


READING = Worker()
"""Reads changed files, and the unsaved texts of pages."""
PEER_READING = Worker()
"""Reads what peers send. Many slow models of a peer do not delay the user's files."""
