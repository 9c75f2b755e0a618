"""Follow a path: `kbot/Follow-v0`."""

from __future__ import annotations

import reprlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from kbot.kinematics.planar_pose import PlanarPose
from kbot.learn.environments.option_checks import LONGEST, require_farther, require_length, require_range
from kbot.learn.environments.stage import Stage
from kbot.learn.environments.tasks.task import ARRIVED, Reward, Start, Task, require_started
from kbot.learn.interface.targets import PathTarget
from kbot.navigation.path import Path
from kbot.text import KbotError

LEFT_PATH = "left the path"
_MOST_CORNERS = 100
"""The way to each takes up to 0.1 s at the start of an episode."""


@dataclass(kw_only=True)
class FollowTask(Task):
    """Follow a path to its end.

    path      points (x, y) in m in the world; by default, each episode has a random path around obstacles
    corners   number of random places that a random path leads to
    distance  shortest and longest way between two of these places in m
    arrive    distance in m from the end of the path at which the robot has arrived
    offset    distance in m from the path at which the robot has left it
    """

    target: ClassVar[str] = "path"
    rewards: ClassVar[Mapping[str, Reward]] = {
        "progress": Reward(1.0, "m by which the robot advanced along the path"),
        "offset": Reward(-1.0, "distance in m from the path, times the seconds that passed"),
    }
    outcomes: ClassVar[Mapping[str, str]] = {LEFT_PATH: "the robot is too far from the path: terminated"}
    path: Sequence[tuple[float, float]] | None = None
    corners: int = 3
    distance: tuple[float, float] = (0.5, 2.0)
    arrive: float = 0.1
    offset: float = 0.5
    _follower: PathTarget | None = field(init=False, default=None)
    _along: float = field(init=False, default=0.0)

    def __post_init__(self) -> None:
        self.distance = require_range("distance", self.distance, 0.0, LONGEST)
        self.arrive = require_length("arrive", self.arrive)
        self.offset = require_length("offset", self.offset)
        if isinstance(self.corners, bool) or not isinstance(self.corners, int | np.integer):
            raise KbotError(f"corners must be a whole number, not {reprlib.repr(self.corners)}")
        if not 1 <= self.corners <= _MOST_CORNERS:
            raise KbotError(f"corners must be from 1 to {_MOST_CORNERS}, not {self.corners}")
        if self.path is None:
            require_farther(self.distance, self.arrive)
        else:
            PathTarget(Path.through(self.path))

    @classmethod
    def defaults(cls, options: Mapping[str, object]) -> dict[str, object]:
        if options.get("path") is not None:
            for name in ("corners", "distance"):
                if name in options:
                    raise KbotError(f"{name} has no effect with a given path: remove {name} or path")
        return {}

    @property
    def reach(self) -> float:
        return self.distance[1]

    def start(self, stage: Stage, random: np.random.Generator) -> Start:
        path = self._random_path(stage, random) if self.path is None else Path.through(self.path)
        # one that observes, and one that judges: noise on what the policy sees does not change the reward
        follower = self._follower = PathTarget(path)
        self._along = 0.0
        return Start(follower.start, PathTarget(path), {"path": path.points, "way": path.length})

    def judge(self, pose: PlanarPose, seconds: float) -> tuple[dict[str, float], str]:
        follower = require_started(self._follower)
        follower.advance(pose)
        progress, self._along = follower.along - self._along, follower.along
        outcome = ""
        if follower.offset > self.offset:
            outcome = LEFT_PATH
        elif follower.length - follower.along <= self.arrive and follower.offset <= self.arrive:
            outcome = ARRIVED
        return {"progress": progress, "offset": follower.offset * seconds}, outcome

    def _random_path(self, stage: Stage, random: np.random.Generator) -> Path:
        """A path through random places, on the shortest ways around obstacles."""
        places = stage.places
        last, _, cells = places.random_goal(random, *self.distance)
        points, before = [last], last
        for _ in range(self.corners):
            # the way back is as long, but for rounding errors
            at = places.random_place(random, cells) if len(cells) else before
            points += places.way(last, at)[1:]
            before, last = last, at
            cells = places.between(places.ways_to(*last), *self.distance)
        return Path.through(points)
