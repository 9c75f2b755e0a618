"""The options of every environment, and how they are read."""

from __future__ import annotations

import os
import reprlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import TypeVar

import numpy as np

from kbot.learn.environments.option_checks import require_range
from kbot.learn.environments.stage import SEED
from kbot.learn.interface.robot_interface import REACH
from kbot.model import RobotModel
from kbot.navigation.simulated.pilot import PoseSource, require_pose_source
from kbot.robot import Value
from kbot.sim import recipe
from kbot.sim.numbers import LONGEST, is_finite, positive
from kbot.text import KbotError
from kbot.text.suggest import suggest_or_list
from kbot.world import World

MOST_SEEDS = 2**31
_LONGEST_STEP = 1.0
"""s. Physics diverges with far shorter steps."""
T = TypeVar("T")


@dataclass(kw_only=True)
class Options:
    """The options of every environment.

    robot        file of the robot, or the result of `kbot.load`; `kbot` is the robot that ships with KBot
    world        as in `kbot.Simulation`; `{seed}` in it is replaced by a number for each episode
    world_seeds  lowest and highest number for `{seed}`
    properties   values of xacro arguments and properties
    packages     folders in which packages are searched first
    lidar        number of directions in which the policy sees obstacles; by default 36 for a robot that
                 declares a level lidar, and 0 for others
    reach        m; the furthest obstacle that the policy sees
    max_speed    highest forward speed in m/s and turning speed in rad/s; None for the limits that the robot
                 declares, or 0.3 and 2 if it declares none
    reverse      whether the policy can drive backwards
    rate         actions per second
    time_limit   s after which an episode is truncated
    pose         `ground_truth` or `odometry`: the pose that the policy sees
    rewards      weights that replace the default weights of the reward's terms
    randomise    ranges from which each episode draws: see `Randomisation`
    timestep     s of a step of physics
    """

    robot: str | os.PathLike[str] | RobotModel = "kbot"
    world: str | World = "empty"
    world_seeds: tuple[int, int] = (1, 1000)
    properties: Mapping[str, Value] = field(default_factory=dict)
    packages: tuple[str, ...] = ()
    lidar: int | None = None
    reach: float = REACH
    max_speed: tuple[float, float] | None = None
    reverse: bool = False
    rate: float = 10.0
    time_limit: float = 60.0
    pose: PoseSource = "ground_truth"
    rewards: Mapping[str, float] = field(default_factory=dict)
    randomise: Mapping[str, object] = field(default_factory=dict)
    timestep: float = recipe.TIMESTEP
    steps_per_action: int = field(init=False)

    def __post_init__(self) -> None:
        """Raises KbotError: an option is not valid."""
        _require_kinds(self)
        self.packages = _folders(self.packages)
        self.world_seeds = _require_seeds(self)
        positive("reach in m", self.reach, LONGEST)
        positive("timestep in s", self.timestep, _LONGEST_STEP)
        positive("time_limit in s", self.time_limit, LONGEST)
        self.steps_per_action = _require_rate(self.rate, self.timestep)
        require_pose_source(self.pose)


def read_options(kind: type[T], given: Mapping[str, object], others: tuple[type, ...] = ()) -> T:
    """The options of a dataclass from keywords. Names of the `others` are left out.

    Raises:
        KbotError: a keyword is not an option of any of them.
    """
    names = [each.name for each in fields(kind) if each.init]  # type: ignore[arg-type]  # all kinds of options are dataclasses
    known = [*names, *(each.name for other in others for each in fields(other) if each.init)]
    for name in given:
        if name not in known:
            raise KbotError(f"unknown option '{name}' of the environment: {suggest_or_list(name, known)}")
    return kind(**{name: value for name, value in given.items() if name in names})


def _require_kinds(options: Options) -> None:
    """Raises KbotError: an option is not of its type."""
    if not isinstance(options.robot, str | os.PathLike | RobotModel):
        raise KbotError(
            f"robot must be one file or one result of kbot.load, not {reprlib.repr(options.robot)}"
        )
    if not isinstance(options.world, str | os.PathLike | World):
        raise KbotError(
            f"world must be the name of a world, a file or a World, not {reprlib.repr(options.world)}"
        )
    if not isinstance(options.reverse, bool | np.bool_):
        raise KbotError(f"reverse must be True or False, not {reprlib.repr(options.reverse)}")
    is_count = isinstance(options.lidar, int | np.integer) and not isinstance(options.lidar, bool)
    if options.lidar is not None and not is_count:
        raise KbotError(f"lidar must be a whole number of directions, not {reprlib.repr(options.lidar)}")
    if not isinstance(options.properties, Mapping):
        raise KbotError(
            f"properties must be a dict of values by name, not {reprlib.repr(options.properties)}"
        )


def _folders(packages: object) -> tuple[str, ...]:
    """The option `packages`, which may also be one folder.

    Raises:
        KbotError: it is something else.
    """
    listed = (packages,) if isinstance(packages, str | os.PathLike) else packages
    if not isinstance(listed, Sequence) or not all(isinstance(each, str | os.PathLike) for each in listed):
        raise KbotError(f"packages must be folders, not {reprlib.repr(packages)}")
    return tuple(os.fspath(each) for each in listed)


def _require_seeds(options: Options) -> tuple[int, int]:
    seeds = options.world_seeds
    low, high = require_range("world_seeds", seeds, 0, MOST_SEEDS)
    if low != int(low) or high != int(high):
        raise KbotError(f"world_seeds must be two whole numbers, not {reprlib.repr(seeds)}")
    has_seed = isinstance(options.world, str) and SEED in options.world
    if seeds != Options.world_seeds and not has_seed:
        raise KbotError(f"world_seeds has no effect: write {SEED} in world, as in 'rooms:seed={SEED}'")
    return int(low), int(high)


def _require_rate(rate: float, timestep: float) -> int:
    """Steps of physics for each action.

    Raises:
        KbotError: the rate is not valid, or does not fit the time step.
    """
    if not (is_finite(rate) and rate > 0.0):
        raise KbotError(
            f"rate must be a finite number of actions per second above 0, not {reprlib.repr(rate)}"
        )
    steps = round(1.0 / (rate * timestep))
    if not steps or abs(steps * rate * timestep - 1.0) > 1e-6:
        raise KbotError(
            f"an action at rate {rate:g} takes {1.0 / rate:g} s, which is not a whole number of time steps "
            f"of timestep {timestep:g} s: change rate or timestep"
        )
    return steps
