"""Executes runs in processes of this machine."""

from __future__ import annotations

from types import TracebackType
from typing import Self

from kbot.sweep.executor import Finished
from kbot.trials.pool import LimitedTask, Pool, Task, result_of, run_task, seconds_of
from kbot.worker import ProcessEnded

ATTEMPTS = 3
"""How often a run may end its process. It may be killed for something else, such as the memory that other
programs use. A run that always crashes is a failed run after so many attempts."""
AHEAD = 2
"""Runs that are submitted per process: the next one begins as soon as a process is free."""


class Processes:
    """The processes of a pool."""

    def __init__(self, pool: Pool, limit: float | None = None) -> None:
        """`limit` replaces the processor time in seconds that each run may take."""
        self._pool, self._limit = pool, limit
        self._calls = pool.calls(run_task)
        self._running: dict[int, LimitedTask] = {}
        self._ended: dict[int, int] = {}
        """How often each of these runs ended its process."""

    @property
    def capacity(self) -> int:
        return AHEAD * self._pool.jobs

    def submit(self, run: int, task: Task) -> None:
        item = self._running[run] = (task, self._limit or task.limit)
        self._calls.submit(run, item, seconds_of(item))

    def wait(self) -> Finished:
        while True:
            run, outcome = self._calls.wait()
            item = self._running[run]
            if isinstance(outcome.error, ProcessEnded):
                self._ended[run] = self._ended.get(run, 0) + 1
                if self._ended[run] < ATTEMPTS:
                    self._calls.submit(run, item, seconds_of(item))
                    continue
            del self._running[run]
            self._ended.pop(run, None)
            return Finished(run, result_of(item, outcome))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._calls.__exit__(kind, error, trace)
