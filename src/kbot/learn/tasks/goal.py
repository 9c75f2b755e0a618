"""Drive to a random goal: `kbot/Goal-v0`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from kbot.kinematics.planar_pose import PlanarPose
from kbot.learn.stage import Stage
from kbot.learn.targets import GoalTarget
from kbot.learn.tasks.task import ARRIVED, Reward, Start, Task
from kbot.learn.values import LONGEST, require_length, require_range
from kbot.navigation.local.cost_to_go import CostToGo
from kbot.text import KbotError


@dataclass(kw_only=True)
class GoalTask(Task):
    """Drive to a random goal.

    distance  shortest and longest way from the start to the goal in m
    arrive    distance in m from the goal at which the robot has arrived
    """

    target: ClassVar[str] = "goal"
    rewards: ClassVar[Mapping[str, Reward]] = {
        "progress": Reward(1.0, "m by which the shortest way to the goal around obstacles became shorter"),
    }
    distance: tuple[float, float] = (1.0, 5.0)
    arrive: float = 0.15
    _goal: GoalTarget = field(init=False, default_factory=lambda: GoalTarget(0.0, 0.0))
    _ways: CostToGo | None = field(init=False, default=None)
    _left: float = field(init=False, default=0.0)

    def __post_init__(self) -> None:
        self.distance = require_range("distance", self.distance, 0.0, LONGEST)
        self.arrive = require_length("arrive", self.arrive)
        if self.distance[0] <= self.arrive:
            raise KbotError(
                f"a goal {self.distance[0]:g} m away is reached at once, because arrive is {self.arrive:g} m:"
                " increase distance"
            )

    @property
    def reach(self) -> float:
        return self.distance[1]

    def start(self, stage: Stage, random: np.random.Generator) -> Start:
        low, high = self.distance
        places = stage.map
        for _ in range(_TRIES):
            x, y = places.random_place(random)
            ways = places.ways_to(x, y)
            lengths = ways.raw[places.free[:, 0], places.free[:, 1]]
            cells = places.free[(lengths >= low) & (lengths <= high)]
            if len(cells):
                break
        else:
            raise KbotError(
                f"world '{stage.simulation.world.name}' has no two places {low:g} to {high:g} m apart: change"
                " distance"
            )
        at_x, at_y = places.random_place(random, cells)
        pose = PlanarPose(at_x, at_y, float(random.uniform(-math.pi, math.pi)))
        return self.begin(pose, GoalTarget(x, y), ways)

    def begin(self, pose: PlanarPose, goal: GoalTarget, ways: CostToGo) -> Start:
        """The start at a pose, with the lengths of the ways to the goal."""
        self._goal, self._ways = goal, ways
        self._left = self._way(pose)
        facts = {"goal": np.array([goal.x, goal.y]), "way": self._left}
        return Start(pose, goal, facts)

    def judge(self, pose: PlanarPose) -> tuple[dict[str, float], str]:
        left = self._way(pose)
        progress, self._left = self._left - left, left
        return {"progress": progress}, ARRIVED if self._goal.distance(pose) <= self.arrive else ""

    def _way(self, pose: PlanarPose) -> float:
        """The length in m of the shortest way to the goal; near the goal, of the straight line."""
        straight = self._goal.distance(pose)
        if self._ways is None or straight <= 2.0 * self._ways.resolution:
            return straight
        return max(straight, self._ways.at_point(pose.x, pose.y))


_TRIES = 20
"""Goals that are drawn before a world counts as too small. In a world of rooms the first one suffices."""
