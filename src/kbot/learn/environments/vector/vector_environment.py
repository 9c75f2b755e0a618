"""The vector environment: many robots at once, in several processes.

Each of its environments is the same as a single one with its seed, bit for bit.
"""

from __future__ import annotations

import reprlib
from collections.abc import Sequence
from itertools import chain, pairwise
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from kbot.learn.environments.environment import spaces
from kbot.learn.environments.vector.group import Batch, Info
from kbot.learn.environments.vector.group_process import GroupProcess, LocalGroup
from kbot.learn.interface.policy_interface import PolicyInterface, Vector
from kbot.text import KbotError
from kbot.worker.cores import available_cores

Flags = NDArray[np.bool_]
_MOST = 100_000
"""Environments, processes and steps of an episode."""


class KbotVectorEnv(VectorEnv[Vector, Vector, Any]):
    """Many robots that learn the same task. `interface` names the numbers of observations and actions."""

    def __init__(
        self,
        task: str,
        num_envs: int = 1,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        processes: int | None = None,
        max_episode_steps: int | None = None,
        render_mode: str | None = None,
        **options: object,
    ) -> None:
        """Start the processes, and load the robot and the world in each.

        Args:
            task: what the robots learn: a key of `TASKS`.
            num_envs: number of environments.
            autoreset_mode: when an environment whose episode has ended is reset.
            processes: that step at the same time, by default one for each processor core. This process
                is the first of them.
            max_episode_steps: actions after which an episode is truncated, besides `time_limit`.
            render_mode: `rgb_array` or None.
            options: as those of a single environment.

        Raises:
            DescriptionError: the robot or the world cannot be used.
            KbotError: an option is unknown or not valid.
        """
        if render_mode not in (None, "rgb_array"):
            raise KbotError(
                "render_mode of a vector environment must be 'rgb_array' or None, "
                f"not {reprlib.repr(render_mode)}"
            )
        self.render_mode = render_mode
        count = self.num_envs = _count("num_envs", num_envs)
        wanted = available_cores() if processes is None else _count("processes", processes)
        try:
            self._mode = AutoresetMode(autoreset_mode)
        except ValueError:
            known = ", ".join(mode.value for mode in AutoresetMode)
            raise KbotError(
                f"autoreset_mode must be one of {known}, not {reprlib.repr(autoreset_mode)}"
            ) from None
        most = None if max_episode_steps is None else _count("max_episode_steps", max_episode_steps)
        ends = np.linspace(0, count, min(wanted, count) + 1).round().astype(int).tolist()
        self._parts = [slice(start, end) for start, end in pairwise(ends)]
        sizes = [part.stop - part.start for part in self._parts]
        self._groups: list[LocalGroup | GroupProcess] = []
        try:
            # the processes start at the same time, before the first group is built here
            for size in sizes[1:]:
                self._groups.append(GroupProcess(task, options, size, self._mode.value, most))
            self._groups.insert(0, LocalGroup(task, options, sizes[0], self._mode.value, most))
            self.interface: PolicyInterface = self._receive()[0]
        except BaseException:
            self.close_extras()
            raise
        self.single_observation_space, self.single_action_space = spaces(self.interface)
        self.observation_space = batch_space(self.single_observation_space, count)
        self.action_space = batch_space(self.single_action_space, count)
        self.metadata = {
            "render_modes": ["rgb_array"],
            "render_fps": self.interface.rate,
            "autoreset_mode": self._mode,
        }
        self._is_over: Flags = np.zeros(count, dtype=np.bool_)
        self._is_ready = False

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Vector, Info]:
        """Start an episode in each environment, or in those of the array `options["reset_mask"]`.

        Environment i gets the seed `seed + i`, or `seed[i]` of a list.
        """
        count = self.num_envs
        seeds: list[int | None]
        if seed is None:
            seeds = [None] * count
        elif isinstance(seed, int | np.integer):
            seeds = [int(seed) + index for index in range(count)]
        else:
            seeds = list(seed)
        if len(seeds) != count:
            raise KbotError(f"seed must be a number or {count} numbers, not {len(seeds)}")
        chosen = self._chosen(options)
        results = self._call("reset", [(seeds[part], chosen[part].tolist()) for part in self._parts])
        self._is_over = self._is_over & ~chosen
        self._is_ready = True
        infos = [info for _, part in results for info in part]
        return self.interface.bounded([row for seen, _ in results for row in seen]), self._merged(infos)

    def step(self, actions: ArrayLike) -> tuple[Vector, NDArray[np.float64], Flags, Flags, Info]:
        """Drive every robot for one action.

        Raises:
            KbotError: an action cannot be commanded, or an environment was not reset.
        """
        if not self._is_ready:
            raise KbotError("call reset before step")
        given = np.asarray(actions, dtype=np.float32)
        if given.shape != self.action_space.shape:
            raise KbotError(f"actions must have the shape {self.action_space.shape}, not {given.shape}")
        if not np.isfinite(given).all():
            raise KbotError("actions must be finite numbers")
        if self._mode is AutoresetMode.DISABLED and self._is_over.any():
            over = np.flatnonzero(self._is_over).tolist()
            raise KbotError(f"the episodes of the environments {over} are over: reset them with reset_mask")
        limited = np.minimum(np.maximum(given, -1.0), 1.0).tolist()
        batches: list[Batch] = self._call("step", [(limited[part],) for part in self._parts])
        seen, rewards, *ends, infos = (list(chain(*parts)) for parts in zip(*batches, strict=True))
        terminated, truncated = (np.array(flags, dtype=np.bool_) for flags in ends)
        self._is_over = terminated | truncated
        vectors = self.interface.bounded(seen)
        return vectors, np.array(rewards), terminated, truncated, self._merged(infos)

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """A picture (height, width, 3) of each environment in the mode `rgb_array`.

        Raises:
            KbotError: off-screen OpenGL is not available. The message names what to install.
        """
        if self.render_mode is None:
            return None
        results = self._call("render", [()] * len(self._groups))
        return tuple(picture for part in results for picture in part)

    def close_extras(self, **_: object) -> None:
        """End the processes."""
        for group in self._groups:
            group.close()

    def _call(self, method: str, arguments: Sequence[tuple[object, ...]]) -> list[Any]:
        """Call a method of all groups at once."""
        for group, values in zip(self._groups, arguments, strict=True):
            group.send(method, *values)
        return self._receive()

    def _receive(self) -> list[Any]:
        """The results of all groups. After an error, the results of the others are received too."""
        results, errors = [], []
        try:
            for group in self._groups:
                try:
                    results.append(group.receive())
                except KbotError as error:
                    errors.append(error)
        except BaseException:  # also Ctrl-C: a later result would be taken for that of the next call
            self.close()
            raise
        if errors:
            raise errors[0]
        return results

    def _chosen(self, options: dict[str, Any] | None) -> Flags:
        """Which environments to reset."""
        mask = (options or {}).get("reset_mask")
        if mask is None:
            return np.ones(self.num_envs, dtype=np.bool_)
        if not (isinstance(mask, np.ndarray) and mask.dtype == np.bool_ and mask.shape == (self.num_envs,)):
            raise KbotError(
                f"reset_mask must be an array of {self.num_envs} booleans, not {reprlib.repr(mask)}"
            )
        if not self._is_ready and not mask.all():
            raise KbotError("reset all environments before some of them")
        chosen: Flags = mask
        return chosen

    def _merged(self, infos: list[Info]) -> Info:
        """The infos as arrays, with a mask for each, as Gymnasium's vector environments return them."""
        merged: Info = {}
        terms = [info.pop("rewards", None) for info in infos]
        names = next((each for each in terms if each is not None), None)
        if names is not None:
            has_terms = np.array([each is not None for each in terms])
            none = [0.0] * len(names)
            columns = zip(*(none if each is None else each.values() for each in terms), strict=True)
            rewards: Info = {}
            for name, values in zip(names, np.array([*columns]), strict=True):
                rewards[name] = values
                rewards[f"_{name}"] = has_terms
            merged["rewards"], merged["_rewards"] = rewards, has_terms
        for index, info in enumerate(infos):
            if info:
                merged = self._add_info(merged, info, index)
        return merged


def _count(name: str, value: object) -> int:
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not 1 <= value <= _MOST:
        raise KbotError(f"{name} must be a whole number from 1 to {_MOST}, not {reprlib.repr(value)}")
    return int(value)
