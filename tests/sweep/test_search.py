"""The order of runs, the designs that are chosen, and what a resumed sweep runs."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import TracebackType

import numpy as np
import pytest

from kbot.sweep.designs import Designs, LatinHypercube, Method, Random
from kbot.sweep.executor import Finished
from kbot.sweep.journal import Journal, Row, _line
from kbot.sweep.objectives import Objective
from kbot.sweep.optimisation import WINDOW
from kbot.sweep.plan import Plan
from kbot.sweep.search import designs_of, search
from kbot.sweep.space import parse_space
from kbot.text import KbotError
from kbot.trials.pool import Task
from kbot.trials.results import TrialResult
from kbot.trials.scenario import RobotSource, Scenario

SPACE = parse_space(["a=0.0:1.0", "b=1,2,3", "c=left,right"])
ENERGY = (Objective("energy"),)


class InOrder:
    """An executor that ends runs in a random order. `stop_after` is when it is interrupted."""

    def __init__(self, capacity: int = 4, order: int = 0, stop_after: int | None = None) -> None:
        self.capacity, self.left = capacity, stop_after
        self.noise = random.Random(order)
        self.running: dict[int, Task] = {}
        self.executed: list[int] = []

    def submit(self, run: int, task: Task) -> None:
        assert len(self.running) < self.capacity
        self.running[run] = task

    def wait(self) -> Finished:
        if self.left == len(self.executed):
            raise KeyboardInterrupt
        run = self.noise.choice(sorted(self.running))
        task = self.running.pop(run)
        self.executed.append(run)
        return Finished(run, result(task))

    def __enter__(self) -> InOrder:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


def result(task: Task) -> TrialResult:
    """A parabola with its minimum at a = 0.3. It fails for a above 0.9, before it is measured."""
    robot = task.scenario.robot
    assert robot is not None
    a = float(robot.arguments["a"])
    if a > 0.9:
        return TrialResult(task.scenario.name, task.seed, error="too large")
    values = {"energy": (a - 0.3) ** 2 + float(robot.arguments["b"]), "slip": float("nan")}
    return TrialResult(task.scenario.name, task.seed, all_values=values, state_sha256=f"{a}")


def plan(method: Method, designs: int, seeds: int = 1) -> Plan:
    scenario = Scenario("straight", 1.0)
    trials = tuple(Task(scenario, seed) for seed in range(seeds))
    return Plan(RobotSource("robot.xacro"), SPACE, trials, ENERGY, method, designs)


def rows(path: Path, chosen: Plan, *executors: InOrder) -> list[Row]:
    """The rows after the sweep ran with each executor."""
    for executor in executors:
        with Journal(path, chosen) as journal:
            try:
                search(chosen, journal, executor)
            except KeyboardInterrupt:
                continue
    with Journal(path, chosen) as journal:
        return list(journal.rows())


@pytest.mark.parametrize("method", [Method.RANDOM, Method.LHS, Method.OPTIMIZE])
def test_rows_do_not_depend_on_the_order_the_processes_or_interruptions(
    method: Method, tmp_path: Path
) -> None:
    chosen = plan(method, 40, seeds=2)
    whole = rows(tmp_path / "whole", chosen, InOrder(1))
    assert [row.run for row in whole] == list(range(80))
    interrupted = [InOrder(2, 1, 5), InOrder(16, 2, 30), InOrder(3, 3, 0), InOrder(9, 4)]
    assert rows(tmp_path / "broken", chosen, *interrupted) == whole
    executed = [run for executor in interrupted for run in executor.executed]
    assert sorted(executed) == list(range(80)), "a run was executed twice"


@pytest.mark.parametrize("method", [Method.RANDOM, Method.OPTIMIZE])
def test_a_larger_sweep_keeps_the_runs_of_a_smaller_one(method: Method, tmp_path: Path) -> None:
    smaller = rows(tmp_path / "runs", plan(method, 25), InOrder(5))
    larger = rows(tmp_path / "runs", plan(method, 40), InOrder(5))
    assert larger[:25] == smaller
    assert larger == rows(tmp_path / "at once", plan(method, 40), InOrder(2))


@pytest.mark.parametrize("method", [Method.RANDOM, Method.LHS, Method.OPTIMIZE])
@pytest.mark.parametrize(("key", "value"), [("values", (0.5, 1, "left")), ("design", 7)])
def test_a_row_with_the_values_of_another_design_is_an_error(
    method: Method, key: str, value: object, tmp_path: Path
) -> None:
    path = tmp_path / "runs.jsonl"
    found = rows(path, plan(method, 20), InOrder(1))
    lines = path.read_bytes().splitlines(keepends=True)
    # a line of another sweep, which KBot wrote
    lines[3] = _line(replace(found[3], **{key: value}))
    path.write_bytes(b"".join(lines))
    column = lines[3].index(f'"{key}"'.encode()) + 1
    error = rf"runs\.jsonl:4:{column}: run 3 is recorded for design .* Delete this line to run it again, or"
    with pytest.raises(KbotError, match=error):
        rows(path, plan(method, 20), InOrder())


def test_runs_of_one_design_have_the_same_values_and_different_seeds(tmp_path: Path) -> None:
    found = rows(tmp_path / "runs", plan(Method.RANDOM, 3, seeds=2), InOrder())
    assert [(row.design, row.seed) for row in found] == [(0, 0), (0, 1), (1, 0), (1, 1), (2, 0), (2, 1)]
    assert found[0].values == found[1].values != found[2].values


def test_a_failed_run_is_a_row_with_its_reason(tmp_path: Path) -> None:
    found = rows(tmp_path / "runs", plan(Method.RANDOM, 60), InOrder())
    failed = [row for row in found if not row.passed]
    assert failed
    assert all(
        float(row.values[0]) > 0.9 and row.reason == "too large" and not row.measures for row in failed
    )


def test_an_optimisation_finds_the_minimum_and_avoids_what_fails(tmp_path: Path) -> None:
    found = rows(tmp_path / "runs", plan(Method.OPTIMIZE, 120), InOrder())
    best = min((row for row in found if row.passed), key=lambda row: row.measures["energy"] or 0.0)
    assert float(best.values[0]) == pytest.approx(0.3, abs=0.05)
    assert best.values[1] == 1
    late = found[60:]
    assert np.mean([float(row.values[0]) > 0.9 for row in late]) < 0.1, "random values fail in 10 %"


@pytest.mark.parametrize("method", [Method.RANDOM, Method.LHS, Method.OPTIMIZE])
def test_a_design_that_is_chosen_again_has_the_earlier_results(method: Method, tmp_path: Path) -> None:
    """Six combinations are at most six designs with two seeds each, however often one is chosen."""
    chosen = replace(plan(method, 40, seeds=2), space=parse_space(["a=0.1,0.3,0.95", "b=1,2"]))
    at_once = InOrder(5)
    whole = rows(tmp_path / "whole", chosen, at_once)
    assert [row.run for row in whole] == list(range(80))
    assert len(at_once.executed) == 2 * len({row.values for row in whole}) <= 12
    first: dict[object, Row] = {}
    for row in whole:
        same = first.setdefault((row.values, row.seed), row)
        assert row == replace(same, run=row.run, design=row.design)
    interrupted = [InOrder(2, 1, 3), InOrder(1, 2, 1), InOrder(3, 3)]
    assert rows(tmp_path / "broken", chosen, *interrupted) == whole
    executed = [run for executor in interrupted for run in executor.executed]
    assert sorted(executed) == sorted(at_once.executed)


def test_an_optimisation_uses_the_results_of_earlier_designs() -> None:
    def chosen(energy: Callable[[int], float]) -> list[object]:
        designs = designs_of(Method.OPTIMIZE, SPACE, 60, ENERGY)
        found = []
        for number in range(60):
            if number >= WINDOW:
                done = number - WINDOW
                designs.report(done, [energy(done)], passed=True)
            found.append(designs.values(number))
        return found

    assert chosen(lambda number: number) == chosen(lambda number: number)
    assert chosen(lambda number: number) != chosen(lambda number: -number)


def test_a_latin_hypercube_uses_each_share_of_each_dimension_once() -> None:
    space = parse_space(["a=0.0:1.0", "b=10.0:20.0"])
    designs: Designs = LatinHypercube(space, 50)
    found = np.array([designs.values(number) for number in range(50)], dtype=float)
    for column, low, span in ((0, 0.0, 1.0), (1, 10.0, 10.0)):
        shares = np.floor((found[:, column] - low) / span * 50).astype(int)
        assert sorted(shares.tolist()) == list(range(50))


def test_random_designs_are_uniform_and_known_by_their_number() -> None:
    designs = Random(parse_space(["a=0.0:1.0", "b=1,2,3,4"]))
    found = [designs.values(number) for number in range(4000)]
    assert np.mean([float(a) for a, _ in found]) == pytest.approx(0.5, abs=4 * 0.289 / 4000**0.5)
    counts = [sum(b == each for _, b in found) for each in (1, 2, 3, 4)]
    assert min(counts) > 1000 - 4 * 750**0.5  # four standard deviations of a binomial distribution
    assert designs.values(17) == found[17]
