"""Records failed trials: it runs them again, bit for bit as before, so that passed trials cost no time."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from kbot.text.files import write_text
from kbot.text.notes import note
from kbot.trials.pool import Pool, Task, run_tasks
from kbot.trials.results import TrialResult

DEFAULT_FOLDER = Path(".kbot") / "trials"

_LONGEST_NAME = 100
"""Characters of a scenario's name in that of a file, which may have 255 bytes."""


def record_failures(
    pool: Pool,
    tasks: Sequence[Task],
    results: Sequence[TrialResult],
    folder: Path | None = None,
    on_result: Callable[[int, TrialResult], None] = lambda index, result: None,
    limit: float | None = None,
    *,
    with_film: bool = False,
) -> list[TrialResult]:
    """The results, with recordings of the failed trials in `folder`, by default `.kbot/trials`.

    `with_film` adds films of their ends.

    Trials that could not run, were stopped, or failed at the start have no recording.

    Raises:
        OSError: the folder is not writable.
    """
    failed = [index for index, result in enumerate(results) if result.failed_at]
    if not failed:
        return list(results)
    place = folder or DEFAULT_FOLDER
    place.mkdir(parents=True, exist_ok=True)
    if folder is None and not (place.parent / ".gitignore").exists():
        write_text(str(place.parent / ".gitignore"), "*\n")
    names = _file_names([tasks[index] for index in failed])
    again = [
        replace(tasks[index], record=str(place / name), with_film=with_film)
        for index, name in zip(failed, names, strict=True)
    ]
    for task in again:
        Path(task.record).unlink(missing_ok=True)  # of the run before
    kept = list(results)
    for index, task, result in zip(failed, again, run_tasks(pool, again, on_result, limit), strict=True):
        if result is None or not result.recording:  # Ctrl-C, or the disk is full
            Path(task.record).unlink(missing_ok=True)
            if result is not None:
                note(f"{task.record} could not be written completely, and was removed")
        else:
            kept[index] = replace(
                kept[index],
                recording=result.recording,
                film=result.film,
                film_problem=result.film_problem,
            )
    return kept


def _file_names(tasks: Sequence[Task]) -> list[str]:
    names: list[str] = []
    for task in tasks:
        robot = f"{task.robot}-" if len({each.robot for each in tasks}) > 1 else ""
        title = re.sub(r"[^\w.-]+", "_", f"{robot}{task.scenario.name}")[:_LONGEST_NAME]
        name = f"{title}-seed{task.seed}".strip("._")
        same = sum(other == name or other.startswith(f"{name}~") for other in names)
        names.append(f"{name}~{same + 1}" if same else name)
    return [f"{name}.mcap" for name in names]
