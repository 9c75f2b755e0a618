"""Drive to a random goal: `kbot/Goal-v0`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from kbot.kinematics.planar_pose import PlanarPose
from kbot.learn.environments.option_checks import LONGEST, require_farther, require_length, require_range
from kbot.learn.environments.stage import Stage
from kbot.learn.environments.tasks.remaining_way import RemainingWay
from kbot.learn.environments.tasks.task import ARRIVED, Reward, Start, Task, require_started
from kbot.learn.interface.targets import GoalTarget

PROGRESS = Reward(1.0, "m by which the shortest way to the goal around obstacles became shorter")


@dataclass(kw_only=True)
class GoalTask(Task):
    """Drive to a random goal.

    distance  shortest and longest way from the start to the goal in m
    arrive    distance in m from the goal at which the robot has arrived
    """

    target: ClassVar[str] = "goal"
    rewards: ClassVar[Mapping[str, Reward]] = {"progress": PROGRESS}
    distance: tuple[float, float] = (1.0, 5.0)
    arrive: float = 0.15
    _way: RemainingWay | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        self.distance = require_range("distance", self.distance, 0.0, LONGEST)
        self.arrive = require_length("arrive", self.arrive)
        require_farther(self.distance, self.arrive)

    @property
    def reach(self) -> float:
        return self.distance[1]

    def start(self, stage: Stage, random: np.random.Generator) -> Start:
        places = stage.places
        (x, y), ways, cells = places.random_goal(random, *self.distance)
        at_x, at_y = places.random_place(random, cells)
        pose = PlanarPose(at_x, at_y, float(random.uniform(-math.pi, math.pi)))
        goal = GoalTarget(x, y)
        way = self._way = RemainingWay(goal, ways, pose)
        return Start(pose, goal, {"goal": np.array([x, y]), "way": way.length})

    def judge(self, pose: PlanarPose, seconds: float) -> tuple[dict[str, float], str]:
        way = require_started(self._way)
        progress = way.advance(pose)
        return {"progress": progress}, ARRIVED if way.straight <= self.arrive else ""
