"""Tests the counts, the designs and the best designs of a sweep."""

from __future__ import annotations

import math
from pathlib import Path

from kbot.sweep.designs import Method
from kbot.sweep.journal import Journal, Row
from kbot.sweep.objectives import Objective
from kbot.sweep.plan import Plan
from kbot.sweep.results import Results, results_of
from kbot.sweep.space import parse_space
from kbot.sweep.summary import summary
from kbot.trials.pool import Task
from kbot.trials.scenario import RobotSource, Scenario

SPACE = parse_space(["radius=0.03,0.04,0.05,0.06"])
TRIALS = tuple(Task(Scenario("drive", 1.0), seed) for seed in (0, 1))
RUNS = (
    # energy in J, or the reason of the failure
    (1.0, 3.0),
    (2.0, None),
    ("it fell at 1.5 s", "it fell at 2.5 s"),
    (1.0,),
)
"""The runs of four designs. The second run of the last one is missing."""


def results(folder: Path, *objectives: Objective) -> Results:
    plan = Plan(RobotSource("kbot"), SPACE, TRIALS, objectives, Method.GRID, 4)
    with Journal(folder / "runs.jsonl", plan) as journal:
        for design, runs in enumerate(RUNS):
            for seed, found in enumerate(runs):
                reason = found if isinstance(found, str) else None
                energy = None if isinstance(found, str) else found
                values = (0.03 + 0.01 * design,)
                run = 2 * design + seed
                journal.append(
                    Row(run, design, values, "drive", seed, not reason, reason, "", {"energy": energy})
                )
        return results_of(plan, journal, folder / "results.parquet")


def test_counts_designs_and_reasons(tmp_path: Path) -> None:
    found = results(tmp_path, Objective("energy"))
    assert (found.done, found.passed, found.failed, found.missing) == (7, 5, 2, 1)
    assert found.reasons == {"it fell at 1.5 s": 1, "it fell at 2.5 s": 1}
    assert [each.number for each in found.designs] == [0, 1, 2]
    assert [each.passed for each in found.designs] == [True, True, False]
    assert [each.objectives["energy"] for each in found.designs[:2]] == [2.0, 2.0], "a mean of its runs"
    assert math.isnan(found.designs[2].objectives["energy"])
    assert [each.number for each in found.best] == [0, 1]


def test_the_direction_decides_which_design_is_best(tmp_path: Path) -> None:
    found = results(tmp_path, Objective("radius", is_maximum=True))
    assert [(each.number, each.values, each.objectives) for each in found.best] == [
        (1, {"radius": 0.04}, {"radius": 0.04})
    ]
    assert found.to_json()["best"] == [
        {"design": 1, "values": {"radius": 0.04}, "objectives": {"radius": 0.04}}
    ]


def test_a_design_that_was_chosen_twice_is_best_once(tmp_path: Path) -> None:
    plan = Plan(RobotSource("kbot"), SPACE, TRIALS[:1], (Objective("energy"),), Method.OPTIMIZE, 3)
    with Journal(tmp_path / "runs.jsonl", plan) as journal:
        for run, radius in enumerate((0.05, 0.04, 0.05)):
            journal.append(Row(run, run, (radius,), "drive", 0, True, None, "", {"energy": 1.0}))
        found = results_of(plan, journal, tmp_path / "results.parquet")
    assert [each.number for each in found.best] == [0, 1]


def test_without_an_objective_none_is_best(tmp_path: Path) -> None:
    assert results(tmp_path).best == ()


def test_reasons_that_differ_in_numbers_are_one_line(tmp_path: Path) -> None:
    assert summary(results(tmp_path), 3.25).splitlines() == [
        "2 failed: it fell at 1.5 s (and similar)",
        f"5 passed, 2 failed, 1 missing in 3.2 s: {tmp_path / 'results.parquet'}",
    ]
