"""A scenario: a robot, a world, what happens, and what is expected."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from kbot.brief import Brief
from kbot.kinematics.planar_pose import PlanarPose
from kbot.sim.numbers import FURTHEST, LONGEST, positive, vector
from kbot.text import KbotError
from kbot.trials.actions import Action
from kbot.trials.expectations import Expectation
from kbot.trials.quantities import require_quantity

LONGEST_TRIAL = 86_400.0
"""Seconds of one trial: a day. Its trace has four million samples."""
MOST_SEEDS = 10_000
"""Seeds of one scenario."""
LARGEST_SEED = 2**63 - 1
"""The integers of tables and files of results have 64 bits."""


@dataclass(frozen=True, slots=True)
class RobotSource:
    """A robot.

    file        its xacro or URDF file, a package with one robot, or `kbot`
    arguments   values of xacro arguments by name
    properties  values of top-level properties by name
    packages    folders in which packages are searched first
    """

    file: str
    arguments: Mapping[str, str] = field(default_factory=dict)
    properties: Mapping[str, str] = field(default_factory=dict)
    packages: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Range:
    """The bounds of a quantity in a condition.

    min  lowest value
    max  highest value
    """

    min: float = -math.inf
    max: float = math.inf

    def __post_init__(self) -> None:
        if self.min > self.max:
            raise KbotError(f"the condition can never hold: min {self.min:g} is above max {self.max:g}")


Condition = Mapping[str, Range]
"""Bounds by quantity. It holds when all quantities are within their bounds."""


@dataclass(frozen=True, slots=True)
class Step:
    """An action and its time. A step waits until the previous step has begun.

    action  what happens
    at      earliest time in s
    when    condition for which the step waits, from `at` on
    place   file, line and column of the step, for its errors; empty in Python
    """

    action: Action
    at: float = 0.0
    when: Condition = field(default_factory=dict)
    place: str = field(default="", compare=False)

    def __post_init__(self) -> None:
        if not 0.0 <= self.at <= LONGEST:
            raise KbotError(f"the time of a step must be from 0 to {LONGEST:g} s, not {self.at}")
        _require_quantities(self.when)


@dataclass(frozen=True, slots=True)
class Program:
    """A controller in its own process.

    file        a Python file or an executable
    arguments   arguments of its command line, such as `_speed:=0.2`
    transport   how a `kbot.Node` connects: `local`, `ros1` or `ros2`
    lockstep    whether time waits for it. Only a `kbot.Node` answers. Without it, the run keeps real time and
                is not deterministic
    time_limit  longest time in s until it answers (wall-clock time)
    """

    file: str
    arguments: tuple[str, ...] = ()
    transport: str = "local"
    lockstep: bool = True
    time_limit: float = 10.0


@dataclass(frozen=True, repr=False)
class Scenario(Brief):
    """What is tried.

    name         name of the scenario
    duration     length of the run in s (simulated time)
    steps        what happens
    expect       what is expected
    robot        by default it is given when the scenario is run
    world        a built-in world, an SDF file or a map; `{seed}` is replaced by the seed
    start        pose of the base in the world; by default the origin, or the nearest free place
    seeds        the scenario runs once with each
    until        condition that ends the run before `duration`, once all steps have begun
    programs     controllers that run as their own processes, in order
    """

    name: str
    duration: float
    steps: Sequence[Step] = ()
    expect: Sequence[Expectation] = ()
    robot: RobotSource | None = None
    world: str = "empty"
    start: PlanarPose | None = None
    seeds: Sequence[int] = (0,)
    until: Condition = field(default_factory=dict)
    programs: Sequence[Program] = ()

    def __post_init__(self) -> None:
        positive("the duration in seconds", self.duration, LONGEST_TRIAL)
        if not self.seeds or len(self.seeds) > MOST_SEEDS:
            raise KbotError(f"a scenario needs 1 to {MOST_SEEDS} seeds, not {len(self.seeds)}")
        wrong = [seed for seed in self.seeds if not 0 <= seed <= LARGEST_SEED]
        if wrong:
            raise KbotError(f"seeds are integers from 0 to {LARGEST_SEED}, not {wrong[0]}")
        late = [step for step in self.steps if step.at > self.duration]
        if late:
            raise KbotError(
                f"one of the steps is at {late[0].at:g} s, after the scenario ends at {self.duration:g} s"
            )
        if self.start is not None:
            vector("start", (self.start.x, self.start.y, self.start.yaw), FURTHEST)
        for before, after in pairwise(step.at for step in self.steps if step.at):
            if after < before:
                raise KbotError(
                    f"the steps are not in the order of time: {after:g} s follows {before:g} s, "
                    "but a step waits for the previous one"
                )
        _require_quantities(self.until)

    def world_of(self, seed: int) -> str:
        """The world of the run with a seed."""
        return self.world.replace("{seed}", str(seed))


def _require_quantities(condition: Condition) -> None:
    for name in condition:
        require_quantity(name)


def holds(condition: Condition, values: Mapping[str, float]) -> bool:
    """Whether a condition holds. A value that is NaN is outside every range."""
    return all(bounds.min <= values[name] <= bounds.max for name, bounds in condition.items())
