"""Writes a sweep as one HTML file, which needs no network and no JavaScript.

Names and texts come from files of strangers: all text passes `escaped`, or the charts' own escape.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import TYPE_CHECKING

from kbot.sweep.designs import Method
from kbot.sweep.report.charts import Axis, Mark, axis, parallel_svg, scatter_svg, share_svg
from kbot.sweep.report.sensitivity import Effect, effect
from kbot.sweep.space import Value
from kbot.text.files import write_text
from kbot.trials.measures import find_measure
from kbot.trials.pool import Pool, run_tasks
from kbot.trials.reports.html import Room, escaped, events, film_and_path, page
from kbot.trials.results import TrialResult, with_unit

if TYPE_CHECKING:
    from kbot.sweep.plan import Plan
    from kbot.sweep.results import Design, Results
    from kbot.sweep.space import Dimension

MOST_LINES = 500
"""Designs in a chart. More lines hide each other."""
MOST_ROWS = 1000
"""Rows of the table of designs."""
MOST_REASONS = 20
"""Reasons of failures that are listed, the most frequent first."""
MOST_LABELS = 20
"""Designs of the Pareto front that have a label."""
MOST_PAIRS = 6
"""Pairs of objectives that are drawn."""
MOST_EFFECTS = 36
"""Charts of an objective against a dimension."""


def film_of(plan: Plan, design: Design, pool: Pool, limit: float | None = None) -> TrialResult | None:
    """Execute the first run of a design again, with a film. None after Ctrl-C.

    `limit` is the processor time in seconds that the run may take.
    """
    run = design.number * len(plan.trials)
    task = replace(plan.task(run, tuple(design.values.values())), with_film=True, robot=plan.robot.file)
    (result,) = run_tasks(pool, [task], limit=limit)
    return result


def write_report(
    path: str, results: Results, chosen: Design | None = None, film: TrialResult | None = None
) -> None:
    """Write the report of a sweep. `chosen` is the design of the film.

    Raises:
        KbotError: the file cannot be written.
    """
    write_text(path, _Report(results, chosen, film).html())


@dataclass(frozen=True)
class _Column:
    """A dimension or an objective."""

    name: str
    unit: str
    hint: str = ""
    dimension: Dimension | None = None
    """None if the objective is a measure."""

    @property
    def label(self) -> str:
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    def text(self, value: Value) -> str:
        if isinstance(value, str):
            return value
        return "no value" if math.isnan(value) else with_unit(value, self.unit)


class _Report:
    """The parts of a report."""

    def __init__(self, results: Results, chosen: Design | None, film: TrialResult | None) -> None:
        self._results, self._chosen, self._film = results, chosen, film
        plan = self._plan = results.plan
        self._designs = results.designs
        self._best = {design.number: index for index, design in enumerate(results.best)}
        hints = {e.name: "higher is better" if e.is_maximum else "lower is better" for e in plan.objectives}
        self._dimensions = [
            # a dimension may be an objective
            _Column(each.name, each.unit, hints.get(each.name, ""), each)
            for each in plan.space.dimensions
        ]
        varied = {each.name: each for each in self._dimensions}
        self._objectives = [
            varied.get(each.name) or _Column(each.name, find_measure(each.name).unit, hints[each.name])
            for each in plan.objectives
        ]
        self._columns = [*self._dimensions, *(each for each in self._objectives if each.name not in varied)]
        self._measured = [
            design for design in self._designs if not any(map(math.isnan, design.objectives.values()))
        ]
        self._shown = _spread(self._measured, MOST_LINES, self._best)

    def html(self) -> str:
        title = f"Sweep of {self._plan.robot.file}"
        parts = [
            f'<header><h1>{escaped(title)}</h1><p class="verdict">{self._verdict()}</p></header>',
            "<main>",
            self._best_designs(),
            self._film_of_best(),
            self._parallel(),
            self._fronts(),
            self._effects(),
            self._failures(),
            self._table(),
            "</main>",
            f"<footer>{self._about()}</footer>",
        ]
        return page(title, "\n".join(filter(None, parts)))

    def _verdict(self) -> str:
        results = self._results
        text = f"{results.passed} of {results.done} runs passed"
        if results.missing:
            text += f", and {results.missing} are missing"
        names = [f"{each.name} ({each.hint})" for each in self._objectives]
        return escaped(
            f"{text}. " + (f"Objectives: {', '.join(names)}." if names else "No objective is given.")
        )

    def _best_designs(self) -> str:
        best = self._results.best
        if not self._objectives:
            return ""
        if not best:
            return _panel("Best designs", "<p>No design passed with a value of each objective.</p>")
        title, note = "Best design", ""
        if len(best) > 1 and len(self._objectives) == 1:
            title = f"Best designs: {len(best)} are equally good"
        elif len(best) > 1:
            title = f"Pareto front: {len(best)} designs"
            note = "<p class='quiet'>No other design is as good in all objectives and better in one.</p>"
        return _panel(
            title, note + self._rows(best[:MOST_LABELS]) + _omitted(len(best), MOST_LABELS, "designs")
        )

    def _film_of_best(self) -> str:
        if self._film is None or self._chosen is None:
            return ""
        trace = self._film.trace
        shown = film_and_path(self._film, Room()) + (events(trace) if trace is not None else "")
        note = f'<p class="quiet">{escaped(self._title(self._chosen))}</p>'
        run = f"{self._film.name}, seed {self._film.seed}"
        return _panel(f"Run of design {self._chosen.number}: {run}", note + shown)

    def _parallel(self) -> str:
        if not self._shown or len(self._columns) < 2:
            return ""
        axes = [self._axis(each) for each in self._columns]
        lines = [self._mark(design, self._columns) for design in self._shown]
        legend = "A line is a design."
        if self._objectives:
            legend += (
                f" Its colour is {self._objectives[0].name}: blue is best, orange is worst. "
                "Black, or white on a dark page: the best designs. Red: designs with a failed run."
            )
        caption = f"<figcaption>{escaped(legend + self._sampled())}</figcaption>"
        figure = f"<figure>{parallel_svg(axes, lines)}{caption}</figure>"
        return _panel("Parallel coordinates", f'<div class="table">{figure}</div>')

    def _fronts(self) -> str:
        if len(self._objectives) < 2 or not self._shown:
            return ""
        figures = []
        for pair in list(combinations(self._objectives, 2))[:MOST_PAIRS]:
            x, y = map(self._axis, pair)
            points = [self._mark(design, pair, labelled=True) for design in self._shown]
            best = [point.values for point in points if point.kind == "best"]
            # with more objectives, the front is a surface
            front = [(float(a), float(b)) for a, b in best] if len(self._objectives) == 2 else []
            figures.append(f"<figure>{scatter_svg(x, y, points, front)}</figure>")
        hints = "; ".join(f"{each.name}: {each.hint}" for each in self._objectives)
        note = f"<p class='quiet'>{escaped(hints)}. The large points are the Pareto front.</p>"
        return _panel("Pareto front", f'{note}<div class="charts large">{"".join(figures)}</div>')

    def _effects(self) -> str:
        designs = [design for design in self._measured if design.passed]
        if not self._objectives or not designs:
            return ""
        rows, figures = [], []
        for objective in self._objectives:
            y = self._axis(objective)
            found = [
                (dimension, effect(self._values(designs, dimension), self._floats(designs, objective)))
                for dimension in self._dimensions
                if dimension.name != objective.name
            ]
            found.sort(key=lambda each: -1.0 if math.isnan(each[1].share) else each[1].share, reverse=True)
            for dimension, of_dimension in found:
                rows.append(_effect_row(objective, dimension, of_dimension))
                points = [self._mark(design, (dimension, objective)) for design in self._shown]
                figures.append(f"<figure>{scatter_svg(self._axis(dimension), y, points)}</figure>")
        if not rows:  # the only dimension is the objective itself
            return ""
        note = (
            "The share of the objective's variance that a dimension alone explains: the first-order "
            "sensitivity index (Saltelli et al. 2008). It is estimated from the designs that passed, by the "
            "correlation ratio with Kelley's correction (1935). The shares do not include effects that two "
            "dimensions have only together."
        )
        if self._plan.method is Method.OPTIMIZE:
            note += " An optimisation tries more designs where results are good. The shares are about them."
        head = (
            '<th scope="col">Objective</th><th scope="col">Dimension</th>'
            '<th scope="col" colspan="2">Share</th><th scope="col">Trend</th>'
        )
        table = f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table>"
        table = f'<div class="table">{table}</div>'
        drawn = "".join(figures[:MOST_EFFECTS]) + _omitted(len(figures), MOST_EFFECTS, "charts")
        return _panel(
            "Sensitivity", f'<p class="quiet">{escaped(note)}</p>{table}<div class="charts">{drawn}</div>'
        )

    def _failures(self) -> str:
        reasons = self._results.reasons
        if not reasons:
            return ""
        rows = "".join(
            f'<tr><td class="number">{count}</td><td>{escaped(reason)}</td></tr>'
            for reason, count in reasons.most_common(MOST_REASONS)
        )
        head = '<thead><tr><th scope="col">Runs</th><th scope="col">Reason</th></tr></thead>'
        table = f"<table>{head}<tbody>{rows}</tbody></table>"
        return _panel("Failed runs", table + _omitted(len(reasons), MOST_REASONS, "reasons"))

    def _table(self) -> str:
        order = len(self._best)
        ranked = sorted(
            self._designs, key=lambda each: (self._best.get(each.number, order), not each.passed, each.number)
        )
        return _panel("Designs", self._rows(ranked[:MOST_ROWS]) + _omitted(len(ranked), MOST_ROWS, "designs"))

    def _rows(self, designs: Sequence[Design]) -> str:
        has_failed = any(not design.passed for design in designs)
        runs = len(self._plan.trials)
        names = ["Design", *(each.label for each in self._columns), "Runs passed", *["Reason"] * has_failed]
        head = "".join(f'<th scope="col">{escaped(name)}</th>' for name in names)
        rows = []
        for design in designs:
            passed = runs - len(design.failures)
            reason = next(iter(design.failures), "")
            number = f"{design.number} ★" if design.number in self._best else str(design.number)
            cells = "".join(
                f'<td class="number">{escaped(_plain(self._value(design, each)))}</td>'
                for each in self._columns
            )
            status = "passed" if design.passed else "failed"
            rows.append(
                f'<tr><th scope="row">{number}</th>{cells}'
                f'<td><span class="badge {status}">{passed} of {runs}</span></td>'
                f"{f'<td>{escaped(reason)}</td>' if has_failed else ''}</tr>"
            )
        table = f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table>"
        return f'<div class="table">{table}</div>'

    def _about(self) -> str:
        plan = self._plan
        scenarios = sorted({task.scenario.name for task in plan.trials})
        lines = [
            f"Method: {plan.method}, {len(self._designs)} designs, {len(plan.trials)} "
            f"run{'s' if len(plan.trials) > 1 else ''} of each. Scenarios: {', '.join(scenarios)}.",
            "Varied: " + "; ".join(map(str, plan.space.dimensions)) + ".",
            f"All runs: {self._results.table}",
            "Written by " + ", ".join(f"{name} {number}" for name, number in plan.versions.items()) + ".",
        ]
        return "".join(f"<p>{escaped(line)}</p>" for line in lines)

    def _axis(self, column: _Column) -> Axis:
        return axis(column.label, self._values(self._measured, column), column.dimension, column.hint)

    def _sampled(self) -> str:
        more = len(self._measured) - len(self._shown)
        return f" {len(self._shown)} of {len(self._measured)} designs are drawn." if more else ""

    def _value(self, design: Design, column: _Column) -> Value:
        return design.values[column.name] if column.name in design.values else design.objectives[column.name]

    def _values(self, designs: Sequence[Design], column: _Column) -> list[Value]:
        return [self._value(design, column) for design in designs]

    def _floats(self, designs: Sequence[Design], column: _Column) -> list[float]:
        return [design.objectives[column.name] for design in designs]

    def _title(self, design: Design) -> str:
        values = ", ".join(f"{each.name} {each.text(self._value(design, each))}" for each in self._columns)
        return f"Design {design.number}: {values}"

    def _mark(self, design: Design, columns: Sequence[_Column], *, labelled: bool = False) -> Mark:
        is_best = design.number in self._best
        return Mark(
            tuple(self._value(design, each) for each in columns),
            self._title(design),
            self._shade(design),
            "best" if is_best else "passed" if design.passed else "failed",
            str(design.number) if labelled and is_best and self._best[design.number] < MOST_LABELS else "",
        )

    def _shade(self, design: Design) -> float:
        """The place of a design between the best and the worst value of the first objective."""
        if not self._objectives:
            return 0.0
        name = self._objectives[0].name
        low, high = self._range
        share = (design.objectives[name] - low) / (high - low) if high > low else 0.0
        return 1.0 - share if self._plan.objectives[0].is_maximum else share

    @cached_property
    def _range(self) -> tuple[float, float]:
        """The lowest and highest value of the first objective."""
        values = self._floats(self._measured, self._objectives[0])
        return min(values), max(values)


def _spread(designs: Sequence[Design], most: int, kept: Mapping[int, int]) -> list[Design]:
    """At most so many designs, evenly spread, and all that are kept."""
    step = max(1, math.ceil(len(designs) / most))
    return [design for index, design in enumerate(designs) if index % step == 0 or design.number in kept]


def _effect_row(objective: _Column, dimension: _Column, found: Effect) -> str:
    share = "too few designs" if math.isnan(found.share) else f"{100 * found.share:.0f} %"
    trend = {1: "grows with it", -1: "falls with it", 0: ""}[found.direction]
    bar = "" if math.isnan(found.share) else share_svg(found.share)
    return (
        f'<tr><td>{escaped(objective.name)}</td><th scope="row">{escaped(dimension.name)}</th>'
        f'<td class="number">{share}</td><td class="bar">{bar}</td><td>{trend}</td></tr>'
    )


def _plain(value: Value) -> str:
    if isinstance(value, float):
        return "no value" if math.isnan(value) else f"{value:.6g}"
    return str(value)


def _panel(title: str, body: str) -> str:
    return f"<article><h2>{escaped(title)}</h2>{body}</article>"


def _omitted(count: int, most: int, what: str) -> str:
    return f'<p class="quiet">The first {most} of {count} {what} are shown.</p>' if count > most else ""
