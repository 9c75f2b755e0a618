"""A sweep that is ready to run: its designs and the runs of each."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from kbot.sweep.designs import Method
from kbot.sweep.journal import Row
from kbot.sweep.objectives import Objective
from kbot.sweep.space import Space, Target, Values
from kbot.text.render import encodable, printable
from kbot.trials.pool import Task
from kbot.trials.results import TrialResult
from kbot.trials.scenario import RobotSource

SCHEMA = 2
"""Version of the files `sweep.json` and `runs.jsonl`."""


@dataclass(frozen=True)
class Plan:
    """What a sweep runs.

    robot           the file as the user named it, with the arguments and properties that do not vary
    space           what varies
    trials          the runs of one design: each scenario with each of its seeds
    objectives      what is minimised or maximised
    method          how designs are chosen
    designs         the number of designs
    files           digests of the files on which the results depend, by name
    optional_parts  the names of links and joints that only some of the designs have
    versions        of the programs on which the results depend, by name
    """

    robot: RobotSource
    space: Space
    trials: tuple[Task, ...]
    objectives: tuple[Objective, ...]
    method: Method
    designs: int
    files: Mapping[str, str] = field(default_factory=dict)
    optional_parts: frozenset[str] = frozenset()
    versions: Mapping[str, str] = field(default_factory=dict)

    @property
    def inputs(self) -> str:
        """A digest of the scenarios and of the files on which the results depend."""
        scenarios = {id(task.scenario): task.scenario for task in self.trials}  # many seeds have the same one
        texts = [*map(repr, scenarios.values()), *self.files.values()]
        return hashlib.sha256("\n".join(texts).encode()).hexdigest()

    @property
    def runs(self) -> int:
        """The number of runs."""
        return self.designs * len(self.trials)

    def task(self, run: int, values: Values) -> Task:
        """What a run executes, with the values of its design."""
        task = self.trials[run % len(self.trials)]
        scenario, seed = task.scenario, task.seed
        world, keys = scenario.world, dict(task.keys)
        varied = list(zip(self.space.dimensions, values, strict=True))
        # the world is chosen before its parameters are set
        for dimension, value in sorted(varied, key=lambda each: each[0].target is not Target.WORLD):
            part = dimension.name.partition(".")[2]
            if dimension.target is Target.WORLD:
                world = str(value)
            elif dimension.target is Target.WORLD_PARAMETER:
                world = world_with_parameter(world, part, value)
            elif dimension.target is Target.SEED:
                seed = int(value)
            elif dimension.target is Target.SCENARIO:
                keys[part] = value
        robot = design_robot(self.robot, self.space, values)
        return replace(task, scenario=replace(scenario, robot=robot, world=world), seed=seed, keys=keys)

    def row(self, run: int, values: Values, result: TrialResult) -> Row:
        """The row of a finished run."""
        return Row(
            run,
            run // len(self.trials),
            values,
            result.name,
            result.seed,
            result.passed,
            result.reason,
            result.state_sha256,
            result.all_values,
        )

    def difference(self, row: Row) -> tuple[str, ...] | None:
        """How a row differs from what its run executes, with the path of the value that differs. None if it
        does not. The values of a design are compared where it is chosen: they may depend on earlier results.
        """
        task, name = self.trials[row.run % len(self.trials)], f"run {row.run} is recorded"
        design = row.run // len(self.trials)
        if row.design != design:
            return f"{name} for design {row.design}, but it is of design {design}", "design"
        if len(row.values) != len(self.space.dimensions):
            count = len(self.space.dimensions)
            return f"{name} with {len(row.values)} values, but {count} vary", "values"
        seed = task.seed
        for index, (dimension, value) in enumerate(zip(self.space.dimensions, row.values, strict=True)):
            if not dimension.has(value):
                shown = printable(str(value))[:50]
                problem = f"{name} with {dimension.name} = '{shown}', which is not one of its values"
                return problem, "values", str(index)
            if dimension.target is Target.SEED:
                seed = int(value)
        if row.seed != seed:
            return f"{name} with the seed {row.seed}, but it has the seed {seed}", "seed"
        if row.scenario != encodable(task.scenario.name):
            return f"{name} with another scenario, but it is of '{task.scenario.name}'", "scenario"
        return None

    def repeated_row(self, run: int, row: Row) -> Row:
        """The row of a run with the result of another one, whose design has the same values."""
        return replace(row, run=run, design=run // len(self.trials))

    def objective_values(self, rows: Sequence[Row]) -> tuple[float, ...]:
        """The objectives of a design: the mean over its runs that have a value. NaN if none has one."""
        return tuple(self._mean(objective.name, rows) for objective in self.objectives)

    def _mean(self, name: str, rows: Sequence[Row]) -> float:
        number = next((i for i, each in enumerate(self.space.dimensions) if each.name == name), None)
        found = [row.measures.get(name) if number is None else row.values[number] for row in rows]
        values = [float(value) for value in found if value is not None]
        return math.fsum(values) / len(values) if values else math.nan

    def to_json(self) -> dict[str, Any]:
        """The object of the file `sweep.json`."""
        fixed = {**self.robot.arguments, **self.robot.properties}
        return {
            "schema": SCHEMA,
            "robot": [self.robot.file, *(f"{name}:={value}" for name, value in fixed.items())],
            "dimensions": [str(each) for each in self.space.dimensions],
            "scenarios": [f"{task.scenario.name}, seed {task.seed}" for task in self.trials],
            "method": str(self.method),
            "objectives": [str(each) for each in self.objectives],
            "designs": self.designs,
            "inputs": self.inputs,
            "versions": dict(self.versions),
        }


def design_robot(robot: RobotSource, space: Space, values: Values) -> RobotSource:
    """The robot with the values of a design."""
    arguments, properties = dict(robot.arguments), dict(robot.properties)
    for dimension, value in zip(space.dimensions, values, strict=True):
        if dimension.target is Target.ARGUMENT:
            arguments[dimension.name] = str(value)
        elif dimension.target is Target.PROPERTY:
            properties[dimension.name] = str(value)
    return replace(robot, arguments=arguments, properties=properties)


def world_with_parameter(world: str, name: str, value: int | float | str) -> str:
    """The text of a world with another value of a parameter."""
    base, _, rest = world.partition(":")
    words = [word for word in rest.split(",") if word and word.partition("=")[0].strip() != name]
    return f"{base}:{','.join([*words, f'{name}={value}'])}"
