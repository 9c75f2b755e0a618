"""Runs a sweep in a folder."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from kbot.sweep.executor import Executor
from kbot.sweep.folder import TABLE, opened_folder
from kbot.sweep.inputs import changed_files
from kbot.sweep.journal import Journal
from kbot.sweep.plan import Plan
from kbot.sweep.results import Results, results_of
from kbot.sweep.search import search
from kbot.sweep.table import write_table
from kbot.text import KbotError
from kbot.text.notes import note


class Sweep:
    """A sweep in a folder that is open."""

    def __init__(self, plan: Plan, journal: Journal, folder: Path) -> None:
        self.plan, self.journal, self.folder = plan, journal, folder

    @property
    def table(self) -> Path:
        """The file of the table."""
        return self.folder / TABLE

    @property
    def missing(self) -> int:
        """The number of runs that are not finished."""
        return self.plan.runs - self.journal.count

    def run(self, executor: Executor, on_done: Callable[[], object] = lambda: None) -> None:
        """Execute the missing runs, and write the table. `on_done` is called after each run.

        Raises:
            KeyboardInterrupt: Ctrl-C. The table has the finished runs.
            KbotError: the disk is full, or the folder is not writable. The journal has the finished runs.
        """
        try:
            search(self.plan, self.journal, executor, on_done)
        except BaseException:
            with suppress(KbotError):  # the first error is reported
                self.write_finished()
            raise
        self.write_finished()

    def write_finished(self) -> None:
        """Write the table of the finished runs, and report files that changed since the plan read them."""
        changed = changed_files(self.plan.files)
        if changed:
            more = f" and {len(changed) - 1} more" if len(changed) > 1 else ""
            note(
                f"{changed[0]}{more} changed while the sweep ran: its rows may mix both versions. "
                "Run it again in another folder"
            )
        write_table(self.table, self.plan, self.journal)

    def results(self) -> Results:
        """What the finished runs show."""
        return results_of(self.plan, self.journal, self.table)


@contextmanager
def opened_sweep(plan: Plan, out: str) -> Iterator[Sweep]:
    """Begin a sweep in the folder `out`, or continue it. Within the block, the folder is locked.

    Raises:
        KbotError: the folder has another sweep, another process uses it, or it cannot be written.
    """
    with opened_folder(out, plan) as journal:
        yield Sweep(plan, journal, Path(out))
