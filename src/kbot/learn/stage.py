"""A stage: one robot in one world, with the places where it can stand, for any number of episodes."""

from __future__ import annotations

import math
import os
import warnings
from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from kbot.model import RobotModel
from kbot.navigation.footprint import height, turning_radius
from kbot.navigation.inflation import inflate
from kbot.navigation.jump_point_search import JumpPointSearch
from kbot.navigation.local.cost_to_go import BLOCKED, LETHAL, CostToGo, Sweeping
from kbot.navigation.simulated import level_lidar
from kbot.navigation.string_pulling import pull_taut
from kbot.robot import Value, load
from kbot.sensors.declared import mount_declared
from kbot.sensors.lidar import LidarSensor
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.world import World
from kbot.world.ground import ground_heights
from kbot.world.occupancy import FREE_BELOW, OccupancyGrid
from kbot.world.occupancy_of_world import HEIGHTS, world_grid

_CELL = 0.05
"""m. A way to the goal need not be finer: it only measures progress."""
_MOST_CELLS = 250_000
"""A map of 25 x 25 m. The ways to a goal are then computed in 0.1 s."""
_ROOM = 0.05
"""m between a robot that starts or has arrived, in any heading, and the nearest obstacle."""
_LEVEL = 0.001
"""m by which the ground at a start may differ from that at the world's origin."""
MOST_KEPT = 64
"""Robots, maps and stages that are kept. A stage takes a few MB, and 0.05 s to build."""
_TRIES = 20
"""Goals that are drawn before a world counts as too small. In a world of rooms, the first one suffices."""
T = TypeVar("T")
SEED = "{seed}"
"""In the name of a world, it is replaced by a number that is drawn for each episode."""


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """The robot and the world of an episode.

    `values` are of xacro arguments and properties.
    """

    robot: str | os.PathLike[str] | RobotModel
    world: str | World
    values: tuple[tuple[str, Value], ...] = ()
    packages: tuple[str, ...] = ()

    @property
    def key(self) -> tuple[object, ...]:
        """Scenes of one environment with equal keys are equal: they have the same robot."""
        return (self.world if isinstance(self.world, str) else self.world.name), self.values

    def with_values(self, values: Mapping[str, Value]) -> Scene:
        """The same scene with more values."""
        return replace(self, values=tuple({**dict(self.values), **values}.items()))


class Map:
    """The places of a world where a robot can stand, and the ways between them."""

    def __init__(self, simulation: Simulation, reach: float) -> None:
        """`reach` in m is how far the map extends beyond the robot's start and the objects of the world."""
        first, start = simulation.robots.first, simulation.start
        low, high = HEIGHTS
        heights = low, max(high, height(first.robot, first.base))
        around = [(start.x, start.y)]
        grid = world_grid(simulation.world, _CELL, heights, around, margin=reach, most_cells=_MOST_CELLS)
        self.grid: OccupancyGrid = grid
        self._world, self._start = simulation.world, start
        self._radius = (turning_radius(first.robot, first.base) + _ROOM) / grid.resolution + 0.5
        """The distance in cells that the robot's middle keeps from obstacles."""
        self._weight = np.where(inflate(grid.cells >= FREE_BELOW, self._radius), LETHAL, 1.0)

    @cached_property
    def free(self) -> NDArray[np.intp]:
        """The cells (n, 2), as row and column, that the robot can reach from the world's start.

        Raises:
            KbotError: there is none.
        """
        start = self._start
        reached = self.ways_to(start.x, start.y).raw < BLOCKED
        ground = ground_heights(self._world, self.grid)
        if ground is not None:
            row, column = self.grid.cell(start.x, start.y)
            reached &= np.abs(ground - ground[row, column]) < _LEVEL
        cells = np.argwhere(reached & (self._weight < LETHAL))
        if not len(cells):
            raise KbotError(
                f"world '{self._world.name}' has no place in which the robot can turn without a collision"
            )
        return cells

    def ways_to(self, x: float, y: float) -> CostToGo:
        """The lengths in m of the shortest ways to a point that keep the robot away from obstacles."""
        grid = self.grid
        sweeping = Sweeping(self._weight, (grid.origin.x, grid.origin.y), grid.resolution, (x, y))
        while not sweeping.is_done:
            sweeping.sweep()
        found = sweeping.result()
        lengths = found.raw[: grid.rows]  # a row is added where their number is odd
        return replace(found, raw=lengths, values=self._extended(lengths))

    def _extended(self, lengths: NDArray[np.float64]) -> NDArray[np.float64]:
        """The lengths, with those of the nearest free cells near obstacles, where a robot may be too."""
        known = np.where((self._weight < LETHAL) & (lengths < BLOCKED), lengths, np.inf)
        step = self.grid.resolution
        for _ in range(math.ceil(self._radius) + 2):
            padded = np.pad(known, 1, constant_values=np.inf)
            beside = np.minimum(
                np.minimum(padded[:-2, 1:-1], padded[2:, 1:-1]),
                np.minimum(padded[1:-1, :-2], padded[1:-1, 2:]),
            )
            known = np.where(np.isinf(known), beside + step, known)
        # cells that no robot reaches
        return np.where(np.isinf(known), np.max(known, initial=0.0, where=np.isfinite(known)), known)

    def random_goal(
        self, random: np.random.Generator, low: float, high: float
    ) -> tuple[tuple[float, float], CostToGo, NDArray[np.intp]]:
        """A random free point, the ways to it, and the free cells from which they are `low` to `high` m long.

        Raises:
            KbotError: no two places are so far apart.
        """
        for _ in range(_TRIES):
            x, y = self.random_place(random)
            ways = self.ways_to(x, y)
            cells = self.between(ways, low, high)
            if len(cells):
                return (x, y), ways, cells
        raise KbotError(
            f"world '{self._world.name}' has no two places {low:g} to {high:g} m apart: change distance"
        )

    def between(self, ways: CostToGo, low: float, high: float) -> NDArray[np.intp]:
        """The free cells (n, 2) from which ways are `low` to `high` m long."""
        lengths = ways.raw[self.free[:, 0], self.free[:, 1]]
        return self.free[(lengths >= low) & (lengths <= high)]

    def way(self, start: tuple[float, float], goal: tuple[float, float]) -> list[tuple[float, float]]:
        """The corners in m of a shortest way between two free points."""
        cells = self._search.find(self.grid.cell(*start), self.grid.cell(*goal))
        corners = [] if cells is None else pull_taut(self._weight < LETHAL, cells)
        return [start, *(self.grid.center(*cell) for cell in corners[1:-1]), goal]

    @cached_property
    def _search(self) -> JumpPointSearch:
        return JumpPointSearch(self._weight < LETHAL)

    def random_place(
        self, random: np.random.Generator, cells: NDArray[np.intp] | None = None
    ) -> tuple[float, float]:
        """A random point in m in one of the cells, by default in `free`."""
        cells = self.free if cells is None else cells
        row, column = cells[int(random.integers(len(cells)))].tolist()
        return self.grid.center(row, column)


class Library:
    """Loads robots, and makes maps, once for all environments that share it."""

    def __init__(self, reach: float) -> None:
        """`reach` is that of the maps."""
        self._reach = reach
        self._robots: OrderedDict[object, RobotModel] = OrderedDict()
        self._maps: OrderedDict[object, Map] = OrderedDict()

    def robot(self, scene: Scene) -> RobotModel:
        """The robot of a scene. Raises DescriptionError or KbotError as `kbot.load` does."""
        return _kept(self._robots, scene.values, lambda: _load(scene))

    def map(self, scene: Scene, simulation: Simulation) -> Map:
        """The map of a simulation of a scene."""
        return _kept(self._maps, scene.key, lambda: Map(simulation, self._reach))


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
    def map(self) -> Map:
        return self._library.map(self.scene, self.simulation)


def _kept(kept: OrderedDict[object, T], key: object, make: Callable[[], T]) -> T:
    """What was made for a key before, or else is made now. Threads may make the same thing twice."""
    found = kept.get(key)
    if found is None:
        found = kept[key] = make()
        while len(kept) > MOST_KEPT:
            kept.popitem(last=False)
    return found


def _load(scene: Scene) -> RobotModel:
    if isinstance(scene.robot, RobotModel):
        if scene.values:
            names = ", ".join(name for name, _ in scene.values)
            raise KbotError(
                f"the values of {names} cannot be set in a loaded robot: give the robot's file instead"
            )
        return scene.robot
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # kbot check prints them; each episode would repeat them
        return load(scene.robot, packages=list(scene.packages), arguments=dict(scene.values))
