"""A stage: one robot in one world, which is reset for each episode. A library shares what stages have in
common."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

from kbot.learn.environments.places import Places
from kbot.learn.environments.recently_used import RecentlyUsed
from kbot.model import RobotModel
from kbot.navigation.simulated.lidars import level_lidar
from kbot.robot import Value, load
from kbot.sensors.declared import mount_declared
from kbot.sensors.lidar import LidarSensor
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.world import World

SEED = "{seed}"
"""In the name of a world, it is replaced by a number that is drawn for each episode."""


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """The robot and the world of an episode.

    `values` are of xacro arguments and properties. `is_drawn`: some of them are random.
    """

    robot: str | os.PathLike[str] | RobotModel
    world: str | World
    values: tuple[tuple[str, Value], ...] = ()
    packages: tuple[str, ...] = ()
    is_drawn: bool = False

    @property
    def key(self) -> tuple[object, ...]:
        """Scenes of one environment with equal keys are equal: they have the same robot."""
        return (self.world if isinstance(self.world, str) else self.world.name), self.values

    def with_drawn(self, values: Mapping[str, Value]) -> Scene:
        """The same scene with values that are drawn."""
        return replace(self, values=tuple({**dict(self.values), **values}.items()), is_drawn=True)


class Library:
    """Loads robots, and finds their places, once for all environments that share it."""

    def __init__(self, reach: float) -> None:
        """`reach` is that of `Places`."""
        self._reach = reach
        self._robot: RobotModel | None = None
        self._places: RecentlyUsed[Places] = RecentlyUsed()

    def robot(self, scene: Scene) -> RobotModel:
        """The robot of a scene.

        Raises:
            DescriptionError: as `kbot.load`.
            KbotError: as `kbot.load`.
        """
        if scene.is_drawn:
            return _load(scene)
        if self._robot is None:
            self._robot = _load(scene)
        return self._robot

    def places(self, scene: Scene, simulation: Simulation) -> Places:
        """The places of a simulation of a scene."""
        if scene.is_drawn:
            return Places(simulation, self._reach)
        return self._places.get(scene.key, lambda: Places(simulation, self._reach))


class Stage:
    """A simulation of a scene. It is reset for each episode."""

    def __init__(self, scene: Scene, library: Library, timestep: float) -> None:
        """Raises DescriptionError or KbotError: the robot or the world cannot be used."""
        self.scene, self._library = scene, library
        self.simulation = Simulation(library.robot(scene), scene.world, timestep=timestep)

    @cached_property
    def lidar(self) -> LidarSensor | None:
        """The robot's first level lidar, mounted. The robot's other sensors do not measure."""
        found = level_lidar(self.simulation)
        sensors, _ = mount_declared(self.simulation, strict=False)
        for sensor in sensors.values():
            if sensor is not found:
                sensor.close()
        return found

    @cached_property
    def places(self) -> Places:
        return self._library.places(self.scene, self.simulation)


def _load(scene: Scene) -> RobotModel:
    if isinstance(scene.robot, RobotModel):
        if scene.values:
            names = ", ".join(name for name, _ in scene.values)
            raise KbotError(
                f"the values of {names} cannot be set in a loaded robot: give the robot's file instead"
            )
        return scene.robot
    with warnings.catch_warnings():
        if scene.is_drawn:  # each episode would repeat the warnings
            warnings.simplefilter("ignore")
        return load(scene.robot, packages=list(scene.packages), arguments=dict(scene.values))
