"""A group of environments that one process steps, one after the other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from gymnasium.utils.seeding import np_random
from numpy.typing import NDArray

from kbot.learn.environments.episode_picture import Picture
from kbot.learn.environments.episodes import Episodes, make_episodes

Info = dict[str, Any]  # values of many types
NEXT_STEP, SAME_STEP = "NextStep", "SameStep"
"""Values of Gymnasium's `AutoresetMode`."""


class Batch(NamedTuple):
    """The results of a step of several environments, as in a `Step`, with one entry for each environment.

    They are not arrays, because numpy takes as long for a single number as for those of all groups.
    """

    seen: list[list[float]]
    rewards: list[float]
    terminated: list[bool]
    truncated: list[bool]
    infos: list[Info]


class Group:
    """Environments with the same options. They share the robot and the places, and nothing else."""

    def __init__(
        self, task: str, options: dict[str, object], count: int, autoreset: str, most_steps: int | None
    ) -> None:
        """`autoreset` is a value of `AutoresetMode`. `most_steps` truncates an episode, if it is given.

        Raises:
            DescriptionError: the robot or the world cannot be used.
            KbotError: an option is unknown or not valid.
        """
        first = make_episodes(task, options)
        self.episodes: tuple[Episodes, ...] = (
            first,
            *(make_episodes(task, options, first.library) for _ in range(count - 1)),
        )
        self.interface = first.interface
        self._autoreset, self._most_steps = autoreset, most_steps
        self._randoms: list[np.random.Generator] = [np_random()[0] for _ in range(count)]
        self._steps = [0] * count
        self._is_over = [False] * count
        self._seen: list[list[float]] = [[0.0] * len(first.interface.inputs) for _ in range(count)]
        self._pictures: dict[int, Picture] = {}

    def reset(
        self, seeds: Sequence[int | None], chosen: Sequence[bool]
    ) -> tuple[list[list[float]], list[Info]]:
        """Start an episode in the chosen environments. Those without a seed continue their random numbers.

        Returns what every environment sees, as in a `Batch`, and its info.
        """
        infos: list[Info] = [{} for _ in self.episodes]
        for index, (seed, is_chosen) in enumerate(zip(seeds, chosen, strict=True)):
            if is_chosen:
                if seed is not None:
                    self._randoms[index] = np_random(seed)[0]
                infos[index] = self._start(index)
        return self._seen, infos

    def step(self, actions: list[list[float]]) -> Batch:
        """Drive every robot for one action, of numbers from -1 to 1."""
        count = len(self.episodes)
        rewards, terminated, truncated = [0.0] * count, [False] * count, [False] * count
        infos: list[Info] = []
        for index, episodes in enumerate(self.episodes):
            if self._is_over[index] and self._autoreset == NEXT_STEP:
                infos.append(self._start(index))
                continue
            step = episodes.step(actions[index])
            self._steps[index] += 1
            too_long = self._most_steps is not None and self._steps[index] >= self._most_steps
            self._seen[index], rewards[index] = step.seen, step.reward
            terminated[index] = step.terminated
            truncated[index] = step.truncated or (too_long and not step.terminated)
            is_over = self._is_over[index] = step.terminated or truncated[index]
            info = step.info
            if is_over and self._autoreset == SAME_STEP:
                info = {
                    "final_obs": self.interface.bounded(step.seen),
                    "final_info": info,
                    **self._start(index),
                }
            infos.append(info)
        return Batch(self._seen, rewards, terminated, truncated, infos)

    def render(self) -> list[NDArray[np.uint8]]:
        """A picture (height, width, 3) of each environment.

        Raises:
            KbotError: OpenGL is not available.
        """
        for index, episodes in enumerate(self.episodes):
            simulation = episodes.stage.simulation
            if index not in self._pictures or self._pictures[index].simulation is not simulation:
                self._pictures[index] = Picture(simulation)
        return [self._pictures[index].draw(each.goal) for index, each in enumerate(self.episodes)]

    def _start(self, index: int) -> Info:
        self._seen[index], info = self.episodes[index].reset(self._randoms[index])
        self._steps[index], self._is_over[index] = 0, False
        return info
