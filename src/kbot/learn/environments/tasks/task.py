"""The interface of tasks: where an episode starts, what is rewarded, and when the episode ends."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar, TypeVar

import numpy as np

from kbot.kinematics.planar_pose import PlanarPose
from kbot.learn.environments.stage import Scene, Stage
from kbot.learn.interface.targets import Target
from kbot.text import KbotError

T = TypeVar("T")

ARRIVED, COLLIDED, FELL, DIVERGED = "arrived", "collided", "fell", "diverged"
TIME_LIMIT = "time limit"
OUTCOMES: Mapping[str, str] = {
    ARRIVED: "the robot arrived: terminated",
    COLLIDED: "the robot touched something other than the ground: terminated",
    FELL: "the robot lies on its side or back: terminated",
    DIVERGED: "the physics failed: terminated",
    TIME_LIMIT: "the time limit passed: truncated",
}
"""How an episode of any task ends."""


@dataclass(frozen=True, slots=True)
class Reward:
    """A term of the reward: its value is multiplied by `weight`, which a user can replace."""

    weight: float
    meaning: str


COMMON_REWARDS: Mapping[str, Reward] = {
    "arrival": Reward(10.0, "1 in the step in which the robot arrives"),
    "failure": Reward(-10.0, "1 in the step in which the episode fails"),
    "time": Reward(-0.1, "seconds that passed"),
    "change": Reward(-0.01, "sum of the changes of the action's numbers since the last step"),
}
"""The terms of every task."""


@dataclass(frozen=True, slots=True)
class Start:
    """How an episode starts: the robot's pose in the world, and where it drives.

    `target` is in the world's frame. `facts` are added to the `info` of the episode's start.
    """

    pose: PlanarPose
    target: Target
    facts: Mapping[str, object] = field(default_factory=dict)


def require_started(value: T | None) -> T:
    """A value that the start of an episode sets.

    Raises:
        KbotError: no episode has started.
    """
    if value is None:
        raise KbotError("the episode has not started: call reset first")
    return value


class Task(ABC):
    """A task. Its fields are options of the environment, with units in the docstring."""

    target: ClassVar[str]
    """The kind of the target: a key of `TARGET_FIELDS`."""
    rewards: ClassVar[Mapping[str, Reward]]
    """The terms of the reward besides the common ones."""
    outcomes: ClassVar[Mapping[str, str]] = {}
    """The outcomes that end an episode of this task only, with their meaning."""

    @property
    @abstractmethod
    def reach(self) -> float:
        """m. How far the grid of places extends beyond the world's objects."""

    @classmethod
    def defaults(cls, options: Mapping[str, object]) -> dict[str, object]:
        """Options of the environment that have other defaults for this task.

        Raises:
            KbotError: an option has no effect on this task, or with another option.
        """
        return {}

    def scene(self, scene: Scene, random: np.random.Generator) -> Scene:
        """The scene of an episode, from the one that the options give."""
        return scene

    @abstractmethod
    def start(self, stage: Stage, random: np.random.Generator) -> Start:
        """Choose the start of an episode.

        Raises:
            KbotError: the world has no place for a start and a target.
        """

    @abstractmethod
    def judge(self, pose: PlanarPose, seconds: float) -> tuple[dict[str, float], str]:
        """The values of this task's terms in the step of some seconds that ended at a true pose, and the
        outcome.

        The outcome is empty while the episode goes on.
        """

    def facts(self, time: float, outcome: str) -> dict[str, object]:
        """What is added to the `info` at the end of an episode that took `time` seconds."""
        return {}
