"""The objectives of a sweep: measures or numbers that vary, to minimise or to maximise."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from kbot.text import KbotError
from kbot.text.suggest import suggest_or_list
from kbot.trials.measures import is_measure, measure_names


@dataclass(frozen=True, slots=True)
class Objective:
    """A number of each run that a sweep minimises or maximises.

    name        a measure, or a dimension whose values are numbers
    is_maximum  whether more is better
    """

    name: str
    is_maximum: bool = False

    @property
    def direction(self) -> Literal["minimize", "maximize"]:
        """`minimize` or `maximize`, as Optuna and JSON have it."""
        return "maximize" if self.is_maximum else "minimize"

    def __str__(self) -> str:
        return f"{self.name}:{'max' if self.is_maximum else 'min'}"


def parse_objective(text: str, dimensions: Sequence[str] = ()) -> Objective:
    """The objective of `MEASURE`, which is minimised, `MEASURE:min` or `MEASURE:max`.

    `dimensions` are the names of those whose values are numbers.

    Raises:
        KbotError: the measure or the direction is unknown.
    """
    name, colon, direction = text.strip().partition(":")
    if colon and direction not in ("min", "max"):
        raise KbotError(f"--objective {text}: the direction is min or max, not '{direction}'")
    if name.startswith("-") and is_measure(name[1:]):
        raise KbotError(f"--objective {text}: to maximise {name[1:]}, write {name[1:]}:max")
    if name not in dimensions and not is_measure(name):
        hint = suggest_or_list(name, [*dimensions, *measure_names()])
        raise KbotError(f"--objective {text}: unknown measure '{name}': {hint}")
    return Objective(name, direction == "max")


def parse_objectives(texts: Iterable[str], dimensions: Sequence[str] = ()) -> tuple[Objective, ...]:
    """Several objectives. Raises KbotError: as `parse_objective`, or one is given twice."""
    found = [parse_objective(text, dimensions) for text in texts]
    names = [each.name for each in found]
    for name in names:
        if names.count(name) > 1:
            raise KbotError(f"--objective {name} is given twice")
    return tuple(found)


def front(objectives: Sequence[Objective], candidates: Mapping[int, Sequence[float]]) -> list[int]:
    """The candidates that no other one dominates, which is as good in all objectives and better in one.

    A candidate with an objective that is NaN is left out. With one objective, these are the best, in order.
    """
    signs = [-1.0 if each.is_maximum else 1.0 for each in objectives]
    costs = {
        key: tuple(sign * value for sign, value in zip(signs, values, strict=True))
        for key, values in candidates.items()
        if not any(map(math.isnan, values))
    }
    kept: list[tuple[int, tuple[float, ...]]] = []
    # in the order of costs, only an earlier one can dominate a later one
    for key, cost in sorted(costs.items(), key=lambda item: (item[1], item[0])):
        if not any(_dominates(other, cost) for _, other in kept):
            kept.append((key, cost))
    return [key for key, _ in kept]


def _dominates(one: tuple[float, ...], other: tuple[float, ...]) -> bool:
    return one != other and all(a <= b for a, b in zip(one, other, strict=True))
