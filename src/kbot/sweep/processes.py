"""Executes runs in processes of this machine."""

from __future__ import annotations

from types import TracebackType
from typing import Self

from kbot.sweep.executor import Finished
from kbot.trials.pool import LimitedTask, Pool, Task, result_of, run_task, seconds_of

AHEAD = 2
"""Runs that are submitted per process: the next one begins as soon as a process is free."""


class Processes:
    """The processes of a pool."""

    def __init__(self, pool: Pool, limit: float | None = None) -> None:
        """`limit` replaces the processor time in seconds that each run may take."""
        self._pool, self._limit = pool, limit
        self._calls = pool.calls(run_task)
        self._running: dict[int, LimitedTask] = {}

    @property
    def capacity(self) -> int:
        return AHEAD * self._pool.jobs

    def submit(self, run: int, task: Task) -> None:
        item = self._running[run] = (task, task.limit(self._limit))
        self._calls.submit(run, item, seconds_of(item))

    def wait(self) -> Finished:
        run, outcome = self._calls.wait()
        return Finished(run, result_of(self._running.pop(run), outcome))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._calls.__exit__(kind, error, trace)
