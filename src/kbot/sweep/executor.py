"""Where the runs of a sweep are executed."""

from __future__ import annotations

from types import TracebackType
from typing import NamedTuple, Protocol, Self

from kbot.trials.pool import Task
from kbot.trials.results import TrialResult


class Finished(NamedTuple):
    """A run that ended, and its result. A run that could not be executed has a result with an error."""

    run: int
    result: TrialResult


class Executor(Protocol):
    """Executes runs in other processes. Results do not depend on where, or in which order, they run.

    A run whose process or machine is lost, without being the run's own fault, is executed again.
    `capacity` is the number of runs that are submitted at the same time: enough to keep all processes busy,
    and few, so that neither tasks nor results pile up.
    """

    @property
    def capacity(self) -> int: ...

    def submit(self, run: int, task: Task) -> None:
        """Begin a run as soon as a process is free. Does not wait."""
        ...

    def wait(self) -> Finished:
        """Wait for the end of a submitted run, whichever is first.

        Raises KeyboardInterrupt after Ctrl-C.
        """
        ...

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End all processes, also in the middle of a run."""
        ...
