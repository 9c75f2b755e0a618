"""The Gymnasium environments, one robot each: `gymnasium.make("kbot/Goal-v0", robot="robot.xacro")`."""

from __future__ import annotations

import reprlib
from collections.abc import Callable
from functools import partial
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from numpy.typing import ArrayLike, NDArray

from kbot.extensions import LivePage
from kbot.learn.environments.episode_picture import Picture
from kbot.learn.environments.episodes import make_episodes
from kbot.learn.interface.policy_interface import PolicyInterface, Vector
from kbot.sim import Simulation
from kbot.text import KbotError

RENDER_MODES = ("rgb_array", "human")
Space = gymnasium.Space[NDArray[np.float32]]


def spaces(interface: PolicyInterface) -> tuple[Space, Space]:
    """The spaces of what a policy sees and of its actions."""
    seen: Any = Box(interface.low, interface.high, dtype=np.float32)  # a Box is typed by any number
    actions: Any = Box(-1.0, 1.0, (len(interface.actions),), dtype=np.float32)
    return seen, actions


class KbotEnv(gymnasium.Env[NDArray[np.float32], NDArray[np.float32]]):
    """A robot that learns a task. `interface` names the numbers of observations and actions."""

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": 10}  # noqa: RUF012 - as Env

    def __init__(self, task: str, render_mode: str | None = None, **options: object) -> None:
        """`task` is a key of `TASKS`. `options` are the fields of `Options` and of the task.

        Raises:
            DescriptionError: the robot or the world cannot be used.
            KbotError: an option is unknown or not valid.
        """
        if render_mode is not None and render_mode not in RENDER_MODES:
            raise KbotError(
                f"render_mode must be one of {', '.join(RENDER_MODES)} or None, "
                f"not {reprlib.repr(render_mode)}"
            )
        self._make = partial(type(self), task, render_mode, **options)
        self.render_mode = render_mode
        self._episodes = make_episodes(task, options)
        self.interface = self._episodes.interface
        self.observation_space, self.action_space = spaces(self.interface)
        self.metadata = {**self.metadata, "render_fps": self.interface.rate}
        self._picture: Picture | None = None
        self._page: LivePage | None = None
        self._served: Simulation | None = None

    def __reduce__(self) -> tuple[Callable[[], KbotEnv], tuple[()]]:
        """A copy has the same options, and no episode: a simulation is neither pickled nor copied."""
        return self._make, ()

    @property
    def simulation(self) -> Simulation:
        """The simulation of the current episode. Another episode may have another one."""
        return self._episodes.stage.simulation

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Vector, dict[str, Any]]:
        """Start an episode. With a seed, it depends on nothing but the seed and the actions."""
        super().reset(seed=seed)
        numbers, info = self._episodes.reset(self.np_random)
        if self.render_mode == "human":
            self._serve()
        return self.interface.bounded(numbers), info

    def step(self, action: ArrayLike) -> tuple[Vector, float, bool, bool, dict[str, Any]]:
        """Drive for one action.

        Raises:
            KbotError: the action cannot be commanded, or the episode is over.
        """
        step = self._episodes.step(self.interface.limited(action))
        return self.interface.bounded(step.seen), *step[1:]

    def render(self) -> NDArray[np.uint8] | None:
        """A picture (height, width, 3) in the mode `rgb_array`. In the mode `human`, the page shows the run.

        Raises:
            KbotError: off-screen OpenGL is not available. The message names what to install.
        """
        if self.render_mode != "rgb_array":
            return None
        if self._picture is None or self._picture.simulation is not self.simulation:
            self._picture = Picture(self.simulation)
        return self._picture.draw(self._episodes.goal)

    def close(self) -> None:
        """Close the page, if there is one."""
        if self._page is not None:
            self._page.close()
            self._page = None

    def _serve(self) -> None:
        """Show the simulation of this episode in a page."""
        if self._served is self.simulation and self._page is not None:
            return
        opens_browser = self._page is None
        self.close()
        self._served = self.simulation
        self.simulation.paused = False  # a page that was closed before has paused it
        self._page = self.simulation.serve(browser=opens_browser)
