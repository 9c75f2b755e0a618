"""Chooses designs by the results of earlier ones, with Optuna's tree-structured Parzen estimator."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from kbot.sweep.designs import SEED
from kbot.sweep.objectives import Objective
from kbot.sweep.space import Choices, Dimension, Interval, Levels, Space, Value, Values

if TYPE_CHECKING:
    from optuna.distributions import BaseDistribution
    from optuna.trial import Trial

WINDOW = 16
"""Designs that are chosen before the results of the first of them are used.

The sequence of choices and reports must not depend on the number of processes, so this is a constant. More
processes run at the same time, fewer make each choice better informed: 16 keeps 16 processes busy.
"""
_FAILED, _NOT_MEASURED = 1.0, 2.0
"""How far a design is from acceptable: a run failed, or failed before it could be measured."""


class Optimisation:
    """Designs of a study. A design whose runs fail counts as worse than all that pass."""

    window: int | None = WINDOW

    def __init__(self, space: Space, objectives: Sequence[Objective]) -> None:
        import optuna  # slow to import

        optuna.logging.set_verbosity(optuna.logging.ERROR)  # it reports each trial
        self._dimensions = space.dimensions
        self._distributions = {each.name: _distribution(each) for each in space.dimensions}
        self._none = (0.0,) * len(objectives)
        self._study = optuna.create_study(
            sampler=optuna.samplers.TPESampler(seed=SEED, constant_liar=True),
            directions=[each.direction for each in objectives],
        )
        self._waiting: dict[int, Trial] = {}

    def values(self, number: int) -> Values:
        trial = self._waiting[number] = self._study.ask(self._distributions)
        return tuple(_value(each, trial.params[each.name]) for each in self._dimensions)

    def report(self, number: int, objectives: Sequence[float] | None, *, passed: bool) -> None:
        trial = self._waiting.pop(number)
        distance = 0.0 if passed else _FAILED
        trial.set_constraint("failed", distance if objectives is not None else _NOT_MEASURED)
        # the sampler does not use the objectives of a design that breaks a constraint
        self._study.tell(trial, objectives if objectives is not None else self._none)


def _distribution(dimension: Dimension) -> BaseDistribution:
    from optuna.distributions import CategoricalDistribution, FloatDistribution, IntDistribution

    domain = dimension.domain
    if isinstance(domain, Interval):
        return FloatDistribution(domain.low, domain.high)
    if domain.is_ordered:
        return IntDistribution(0, domain.count - 1)
    return CategoricalDistribution(list(range(domain.count)))


def _value(dimension: Dimension, chosen: float | int) -> Value:
    """The value of a dimension: an interval's number, or the index into a list."""
    domain: Choices | Levels | Interval = dimension.domain
    return domain.nearest(chosen) if isinstance(domain, Interval) else domain.nth(int(chosen))
