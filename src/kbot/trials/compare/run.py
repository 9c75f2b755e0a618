"""Runs scenarios with two robots, and finds the edits that explain the differences."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from kbot.text import KbotError
from kbot.text.notes import note
from kbot.trials.compare.causes import Change, Effect, EffectKey, explain, relevant_changes
from kbot.trials.compare.comparison import Comparison
from kbot.trials.compare.declarations import Declarations, DeclaredDifference, declarations
from kbot.trials.compare.edits import Edit, Edits, Variant
from kbot.trials.compare.revisions import Description
from kbot.trials.compare.significance import differences
from kbot.trials.errors import sentence
from kbot.trials.pool import Pool, time_limit
from kbot.trials.results import TrialResult
from kbot.trials.scenario_file import FoundScenario
from kbot.trials.trial import run_trial


@dataclass(frozen=True)
class _Run:
    """One trial of one robot."""

    found: FoundScenario
    seed: int
    robot: Variant


def compare(
    before: Description,
    after: Description,
    edits: Edits,
    scenarios: Sequence[FoundScenario],
    pool: Pool,
    on_progress: Callable[[int, int], None] = lambda done, count: None,
) -> Comparison:
    """Compare two robots: what they declare, and their runs. The scenarios are made for the first and used
    for both.

    `edits` are those between the two. `on_progress` gets the number of trials that are done, and of all that
    are known so far.

    Raises:
        KbotError: A completed no scenario.
        KeyboardInterrupt: Ctrl-C ended the trials.
    """
    changes = relevant_changes(edits)
    if not changes:
        return Comparison(before.name, after.name)
    trials = _Trials(pool, on_progress)
    # different robots may have no valid mixture: A with the edits of B may include files that A does not have
    is_mixable = edits.behaves_like_after(edits.all)
    target = edits.variant(edits.all if is_mixable else (edits.whole,))
    original, edited = trials.run(scenarios, (edits.variant(()), target))
    _require_a_run(original, before.name)
    _require_a_run(edited, after.name, is_edited=True)
    found = [d for name in original for d in differences(original[name], edited[name])]
    declared_before = _declarations(edits.variant(()))

    def declared(variant: Variant) -> tuple[DeclaredDifference, ...]:
        after = _declarations(variant)
        return () if declared_before is None or after is None else declared_before.differences(after)

    settings = declared(target)
    known: dict[frozenset[Edit], Sequence[Effect]] = {
        frozenset(edit for change in changes for edit in change.edits): (*found, *settings)
    }
    affected = [s for s in scenarios if any(d.is_significant for d in found if d.scenario == s.scenario.name)]

    def effects(chosen: frozenset[Edit]) -> Mapping[EffectKey, Effect]:
        if chosen not in known:
            variant = edits.variant(chosen)
            (changed,) = trials.run(affected, (variant,))
            measured = [d for name in changed for d in differences(original[name], changed[name])]
            known[chosen] = (*measured, *declared(variant))
        return {d.key: d for d in known[chosen]}

    causes = explain(changes, effects) if affected or settings else ()
    explained = {change for cause in causes for change in cause.changes}
    without_effect = tuple(change for change in changes if change not in explained)

    def shown(some: Sequence[Change]) -> tuple[Change, ...]:
        return _with_shown_files(some, before, after)

    return Comparison(
        before.name,
        after.name,
        tuple(found),
        tuple(replace(cause, changes=shown(cause.changes)) for cause in causes),
        settings,
        shown(without_effect),
    )


def _declarations(variant: Variant) -> Declarations | None:
    """None for a robot that cannot be simulated: its scenarios report this."""
    try:
        with variant.opened() as robot:
            return declarations(robot)
    except KbotError:
        return None


def _require_a_run(
    results: Mapping[str, Sequence[TrialResult]], name: str, *, is_edited: bool = False
) -> None:
    """Report the scenarios that a robot did not complete. An edited robot may complete none: it changed.

    Raises:
        KbotError: the robot completed no scenario.
    """
    failed = {scenario: each.error for scenario, own in results.items() for each in own if each.error}
    texts = [f"{name} did not complete the scenario '{each}': {error}" for each, error in failed.items()]
    if len(failed) == len(results) and not is_edited:
        raise KbotError(texts[0])
    for text in texts:
        note(text)


def _with_shown_files(
    changes: Sequence[Change], before: Description, after: Description
) -> tuple[Change, ...]:
    """The changes with the names of files as reports show them. A deleted file is that of A."""

    def shown(edit: Edit) -> Edit:
        is_old = before.tree != "" and Path(edit.file).is_relative_to(before.tree)
        return replace(edit, file=(before if is_old else after).shown(edit.file))

    return tuple(replace(change, edits=tuple(map(shown, change.edits))) for change in changes)


class _Trials:
    """Runs trials in a pool, and counts them."""

    def __init__(self, pool: Pool, on_progress: Callable[[int, int], None]) -> None:
        self._pool, self._on_progress = pool, on_progress
        self._done = self._count = 0

    def run(
        self, scenarios: Sequence[FoundScenario], robots: Iterable[Variant]
    ) -> list[dict[str, list[TrialResult]]]:
        """The results of each robot by scenario, one for each seed."""
        robots = tuple(robots)
        runs = [_Run(s, seed, robot) for robot in robots for s in scenarios for seed in s.scenario.seeds]
        self._count += len(runs)

        def count(index: int, outcome: object) -> None:
            self._done += 1
            self._on_progress(self._done, self._count)

        outcomes = self._pool.map(_run, runs, lambda run: time_limit(run.found.scenario), count)
        if self._pool.interrupted:
            raise KeyboardInterrupt
        found: dict[int, dict[str, list[TrialResult]]] = {
            number: defaultdict(list) for number in range(len(robots))
        }
        for run, outcome in zip(runs, outcomes, strict=True):
            error = outcome.error if outcome is not None else None
            name = run.found.scenario.name
            failed = TrialResult(name, run.seed, error=sentence(error, "the trial"))
            result = outcome.value if outcome is not None else None
            found[robots.index(run.robot)][name].append(result or failed)
        return list(found.values())


def _run(run: _Run) -> TrialResult:
    with run.robot.opened() as robot:
        return run_trial(run.found.whole(), run.seed, robot, with_all_values=True, with_scans=True)
