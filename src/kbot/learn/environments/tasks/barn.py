"""Drive through the worlds of the BARN challenge: `kbot/Barn-v0`."""

from __future__ import annotations

import os
import reprlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from math import hypot
from typing import ClassVar

import numpy as np

from kbot.kinematics.planar_pose import PlanarPose
from kbot.learn.environments.option_checks import require_length
from kbot.learn.environments.stage import Scene, Stage
from kbot.learn.environments.tasks.barn_worlds import (
    ARRIVE,
    GOAL,
    MAX_SPEED,
    START,
    TIME_LIMIT,
    BarnWorld,
    barn_robot,
    metric,
    read_barn_worlds,
)
from kbot.learn.environments.tasks.goal import PROGRESS
from kbot.learn.environments.tasks.remaining_way import RemainingWay
from kbot.learn.environments.tasks.task import ARRIVED, Reward, Start, Task, require_started
from kbot.learn.interface.targets import GoalTarget
from kbot.text import KbotError
from kbot.text.suggest import suggest_or_list

CLOCK_STARTS_AFTER = 0.1
"""m. The challenge's clock starts when the robot has moved this far."""


@dataclass(kw_only=True)
class BarnTask(Task):
    """Drive 10 m ahead through a world of the BARN challenge, a random one in each episode.

    The robot is by default the challenge's, with its speeds.

    folder  with `worlds.json`, and the challenge's robot in `jackal_description`
    worlds  numbers of the worlds; by default all
    arrive  distance in m from the goal at which the robot has arrived
    """

    target: ClassVar[str] = "goal"
    rewards: ClassVar[Mapping[str, Reward]] = {"progress": PROGRESS}
    folder: str | os.PathLike[str] = ""
    worlds: Iterable[int | str] | None = None
    arrive: float = ARRIVE
    _chosen: list[BarnWorld] = field(init=False, default_factory=list)
    _world: BarnWorld | None = field(init=False, default=None)
    _way: RemainingWay | None = field(init=False, default=None)
    _begun: float | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        self.arrive = require_length("arrive", self.arrive)
        if not self.folder:
            raise KbotError("kbot/Barn-v0 needs the option folder: the folder with worlds.json")
        if not isinstance(self.folder, str | os.PathLike):
            raise KbotError(f"folder must be the path of a folder, not {reprlib.repr(self.folder)}")
        known = read_barn_worlds(os.fspath(self.folder))
        if isinstance(self.worlds, str) or not isinstance(self.worlds, Iterable | None):
            raise KbotError(f"worlds must be a list of numbers, not {reprlib.repr(self.worlds)}")
        names = list(known) if self.worlds is None else [str(number) for number in self.worlds]
        for name in names:
            if name not in known:
                raise KbotError(f"{self.folder} has no world {name!r}: {suggest_or_list(name, known)}")
        if not names:
            raise KbotError("worlds must name at least one world")
        self._chosen = [known[name] for name in names]

    @classmethod
    def defaults(cls, options: Mapping[str, object]) -> dict[str, object]:
        if "world" in options:
            raise KbotError("world has no effect: choose worlds of the challenge with worlds")
        found: dict[str, object] = {"time_limit": TIME_LIMIT}
        folder = options.get("folder")
        if isinstance(folder, str | os.PathLike) and "robot" not in options:
            robot, package = barn_robot(folder)
            found |= {"robot": robot, "packages": (package,), "max_speed": MAX_SPEED}
        return found

    @property
    def reach(self) -> float:
        return 1.0

    def scene(self, scene: Scene, random: np.random.Generator) -> Scene:
        self._world = self._chosen[int(random.integers(len(self._chosen)))]
        return replace(scene, world=self._world.world)

    def start(self, stage: Stage, random: np.random.Generator) -> Start:
        goal = GoalTarget(GOAL.x, GOAL.y)
        self._begun = None
        way = self._way = RemainingWay(goal, stage.places.ways_to(goal.x, goal.y), START)
        facts = {"goal": np.array([goal.x, goal.y]), "way": way.length, "world": self.world.name}
        return Start(START, goal, facts)

    def judge(self, pose: PlanarPose, seconds: float) -> tuple[dict[str, float], str]:
        way = require_started(self._way)
        if self._begun is not None:
            self._begun += seconds
        elif hypot(pose.x - START.x, pose.y - START.y) > CLOCK_STARTS_AFTER:
            self._begun = 0.0
        progress = way.advance(pose)
        return {"progress": progress}, ARRIVED if way.straight <= self.arrive else ""

    def facts(self, time: float, outcome: str) -> dict[str, object]:
        """The challenge's metric of the episode."""
        return {"metric": metric(self.world.optimal_time, self._begun if outcome == ARRIVED else None)}

    @property
    def world(self) -> BarnWorld:
        """The world of the episode."""
        return self._chosen[0] if self._world is None else self._world
