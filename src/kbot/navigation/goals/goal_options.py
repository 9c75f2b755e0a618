"""How the goals of a run are driven to, as `kbot sim` gives it."""

from __future__ import annotations

from dataclasses import dataclass, replace

from kbot.navigation.controller import GENTLE
from kbot.navigation.goals.goals import Goals
from kbot.navigation.goals.goals_with_map import WithMap
from kbot.navigation.goals.goals_without_map import WithoutMap
from kbot.navigation.simulated.motion_limits import motion_limits
from kbot.navigation.with_map.navigator import DEFAULTS, NavigatorSettings
from kbot.sim import Simulation


@dataclass(frozen=True, slots=True)
class GoalOptions:
    """Options of all goals of a run.

    no_map     the robot gets no map, and only its start pose
    arrive     radius in m within which a goal is reached, None for the default
    max_speed  m/s and rad/s, None for the default
    """

    no_map: bool = False
    arrive: float | None = None
    max_speed: tuple[float, float] | None = None

    @property
    def radius(self) -> float:
        """The radius in m within which a goal is reached."""
        return GENTLE.distance if self.arrive is None else self.arrive

    def settings(self, simulation: Simulation) -> NavigatorSettings:
        """The settings of goals with a map for a simulation's first robot."""
        limits = replace(DEFAULTS.limits, distance=self.radius)
        if self.max_speed is not None:
            declared = motion_limits(simulation.robots.first, self.max_speed)
            limits = replace(limits, linear=declared.linear, angular=declared.angular)
        return NavigatorSettings(limits=limits)

    def goals(self, simulation: Simulation) -> Goals:
        """The goals of a running simulation. A map is made on another thread."""
        if self.no_map:
            return Goals(simulation, WithoutMap(simulation, arrive=self.radius, max_speed=self.max_speed))
        return Goals(simulation, WithMap(simulation, settings=self.settings(simulation), in_background=True))
