"""Scenario files as tests: one item for each scenario and seed."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import pytest

from kbot.pytest_plugin.runs import reasons, run_scenario
from kbot.pytest_plugin.settings import default_robot, without_traceback

if TYPE_CHECKING:
    from kbot.trials.scenario import Scenario

ENDINGS = (".scenario.yaml", ".scenario.yml", ".scenario.py")
"""As `FOUND` in `kbot.trials.scenario_file`, which is slow to import."""


class ScenarioFile(pytest.File):
    """A file of scenarios."""

    def collect(self) -> Iterator[ScenarioItem]:
        from kbot.trials.scenario_file import read_scenarios

        with without_traceback():
            scenarios = read_scenarios(str(self.path))
        for scenario in scenarios:
            for seed in scenario.seeds:
                name = scenario.name if len(scenario.seeds) == 1 else f"{scenario.name}[seed{seed}]"
                yield ScenarioItem.from_parent(self, name=name, scenario=scenario, seed=seed)


class ScenarioItem(pytest.Item):
    """A scenario with one seed."""

    def __init__(self, *, scenario: Scenario, seed: int, **others: Any) -> None:  # noqa: ANN401 - pytest's own
        super().__init__(**others)
        self._scenario, self._seed = scenario, seed

    def runtest(self) -> None:
        from kbot.trials.scenario import RobotSource
        from kbot.trials.trial import load_source

        with without_traceback():
            robot = load_source(self._scenario.robot or RobotSource(default_robot(self)))
        result = run_scenario(self, self._scenario, self._seed, robot)
        if not result.passed:
            pytest.fail(reasons(result), False)

    def reportinfo(self) -> tuple[os.PathLike[str], None, str]:
        return self.path, None, self.name
