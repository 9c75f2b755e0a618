"""Tests the HTML report of a sweep."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

from kbot.sweep.designs import Method
from kbot.sweep.journal import Journal, Row
from kbot.sweep.objectives import Objective
from kbot.sweep.plan import Plan
from kbot.sweep.report.html import write_report
from kbot.sweep.runner import Sweep
from kbot.sweep.space import Choices, Dimension, Interval, Space, Target
from kbot.trials.pool import Task
from kbot.trials.results import TrialResult
from kbot.trials.scenario import RobotSource, Scenario

HOSTILE = '<script>alert("x")</script>'
SPACE = Space(
    (
        Dimension("wheel_radius", "0.02:0.05", Interval(0.02, 0.05), unit="m"),
        Dimension("world", f"empty,{HOSTILE}", Choices(("empty", HOSTILE)), Target.WORLD),
    )
)
TASK = Task(Scenario(name="straight", duration=1.0, robot=RobotSource("kbot")))


@contextmanager
def sweep(folder: Path, *objectives: Objective, count: int = 12, space: Space = SPACE) -> Iterator[Sweep]:
    """A sweep in which energy grows with the radius, and time falls with it. The first run failed."""
    plan = Plan(RobotSource("kbot"), space, (TASK,), objectives, Method.LHS, count)
    with Journal(folder / "runs.jsonl", plan) as journal:
        for run in range(count):
            radius = 0.02 + 0.0025 * run
            values = (radius, HOSTILE if run % 2 else "empty")[: len(space.dimensions)]
            measures = {"energy": 10 * radius, "goal_time": 1 / radius if run else None}
            reason = None if run else f"it fell {HOSTILE}"
            journal.append(Row(run, run, values, "straight", 0, run > 0, reason, "", measures))
        yield Sweep(plan, journal, folder)


def report(folder: Path, *objectives: Objective, count: int = 12, space: Space = SPACE) -> str:
    with sweep(folder, *objectives, count=count, space=space) as made:
        write_report(str(folder / "report.html"), made.results())
    return (folder / "report.html").read_text("utf-8")


def headings(text: str) -> list[str]:
    return re.findall(r"<h2>(.*?)</h2>", text)


def test_a_report_with_two_objectives(tmp_path: Path) -> None:
    text = report(tmp_path, Objective("energy"), Objective("goal_time"))
    assert headings(text)[:4] == [
        "Pareto front: 11 designs",
        "Parallel coordinates",
        "Pareto front",
        "Sensitivity",
    ]
    assert headings(text)[4:] == ["Failed runs", "Designs"]
    assert "11 of 12 runs passed. Objectives: energy (lower is better), goal_time (lower is better)." in text
    for label in ("wheel_radius [m]", "energy [J]", "goal_time [s]"):
        assert f">{label}</text>" in text
    assert "<title>Design 11: wheel_radius 0.0475 m, world " in text
    # the design that failed has no time, and is not drawn
    assert text.count('stroke-linejoin="round"') == 11
    assert text.count("<svg") == 1 + 1 + 4 + 4  # parallel coordinates, front, charts and bars of shares


def test_an_objective_that_is_the_only_dimension_has_no_sensitivity(tmp_path: Path) -> None:
    text = report(tmp_path, Objective("wheel_radius"), space=Space(SPACE.dimensions[:1]))
    assert "Sensitivity" not in headings(text)


def test_a_dimension_that_is_an_objective_names_its_better_end(tmp_path: Path) -> None:
    text = report(tmp_path, Objective("wheel_radius", is_maximum=True), Objective("energy"))
    for hint in ("higher is better", "lower is better"):
        assert f">{hint}</text>" in text


def test_a_report_with_one_objective(tmp_path: Path) -> None:
    text = report(tmp_path, Objective("energy", is_maximum=True))
    assert headings(text) == ["Best design", "Parallel coordinates", "Sensitivity", "Failed runs", "Designs"]
    best = text[text.index("Best design") : text.index("Parallel")]
    assert "11 ★" in best
    assert ">higher is better</text>" in text
    assert re.search(r'wheel_radius</th><td class="number">\d+ %', text)


def test_a_report_without_an_objective(tmp_path: Path) -> None:
    text = report(tmp_path)
    assert "No objective is given." in text
    assert headings(text) == ["Parallel coordinates", "Failed runs", "Designs"]


def test_designs_that_are_equally_good_are_not_a_pareto_front(tmp_path: Path) -> None:
    plan = Plan(RobotSource("kbot"), SPACE, (TASK,), (Objective("energy"),), Method.LHS, 3)
    with Journal(tmp_path / "runs.jsonl", plan) as journal:
        for run, energy in enumerate((1.0, 1.0, 2.0)):
            values = (0.02 + 0.01 * run, "empty")
            journal.append(Row(run, run, values, "straight", 0, True, None, "", {"energy": energy}))
        write_report(str(tmp_path / "report.html"), Sweep(plan, journal, tmp_path).results())
    text = (tmp_path / "report.html").read_text("utf-8")
    assert headings(text)[0] == "Best designs: 2 are equally good"


def test_a_report_of_nothing(tmp_path: Path) -> None:
    text = report(tmp_path, Objective("energy"), count=0)
    assert "No design passed with a value of each objective." in text


def test_the_run_of_the_chosen_design_is_shown(tmp_path: Path) -> None:
    with sweep(tmp_path, Objective("energy")) as made:
        results = made.results()
        film = TrialResult("straight", 0, film_problem="off-screen OpenGL is missing")
        write_report(str(tmp_path / "report.html"), results, results.best[0], film)
    text = (tmp_path / "report.html").read_text("utf-8")
    assert "Run of design 1: straight, seed 0" in text
    assert "There is no film: off-screen OpenGL is missing." in text


def test_many_designs_are_a_sample_with_all_best_ones(tmp_path: Path) -> None:
    text = report(tmp_path, Objective("energy"), count=1300)
    assert "434 of 1300 designs are drawn." in text or "435 of 1300 designs are drawn." in text
    assert "The first 1000 of 1300 designs are shown." in text


def test_texts_of_strangers_are_only_text(tmp_path: Path) -> None:
    text = report(tmp_path, Objective("energy"), Objective("goal_time"))
    assert HOSTILE not in text
    tags: list[str] = []
    addresses: list[str] = []

    class Reader(HTMLParser):
        def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
            tags.append(tag)
            addresses.extend(value or "" for name, value in attributes if name in ("src", "href", "style"))

    Reader().feed(text)
    assert "script" not in tags
    assert addresses == []
    assert "default-src 'none'" in text


def test_the_report_of_an_optimisation_says_where_it_looked(tmp_path: Path) -> None:
    with sweep(tmp_path, Objective("energy")) as made:
        made.plan = replace(made.plan, method=Method.OPTIMIZE)
        write_report(str(tmp_path / "report.html"), made.results())
    assert (
        "An optimisation tries more designs where results are good." in (tmp_path / "report.html").read_text()
    )
