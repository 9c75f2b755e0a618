"""Goals of public robots of each kind of base: how many are reached, untouched, and how long the paths are.

    python benchmarks/bench_bases.py [--from FOLDER] [--goals N] [NAME…]

Each robot of the list drives to random goals in furnished rooms that are as large as the robot needs: rooms
of 4 robot lengths or 4 turning radii, doors of 1.6 robot widths and 0.1 m, and boxes at random places. A goal
is a random pose where the robot's outline has some room. The robot gets a map first. If it has a level lidar,
it then drives to the same goals without a map, at up to 1 m/s, with any heading. The path is the ratio of the
driven distance to the planned one, or, without a map, to the straight line.

A robot with a least turning radius also drives to random poses in an empty world. Its driven path is compared
with the Reeds-Shepp distance for its own least turning radius, below which no path can be, and for the larger
radius with which KBot plans. Exit status 1 if a driven path is shorter than the Reeds-Shepp distance, less
the arrival radius, or if a robot touches anything.

The robots are fetched as in `bench_robots.py`.
"""

from __future__ import annotations

import argparse
import math
import statistics
import sys
import tempfile
import time
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from bench_robots import Robot, read_robots
from public_repositories import fetch

from kbot.kinematics import PlanarPose, Transform
from kbot.model import RobotModel
from kbot.model.load import load_robot
from kbot.navigation import Trip, go_to, go_to_without_map
from kbot.navigation.planning.reeds_shepp import distances
from kbot.navigation.simulated.lidars import level_lidars
from kbot.navigation.simulated.mobility import RESERVE, BaseKind, Mobility, mobility
from kbot.navigation.space.distance_field import DistanceField
from kbot.navigation.space.footprint_clearance import FootprintClearance
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.world import World, load_world
from kbot.world.builders import WOOD, box
from kbot.world.occupancy_of_world import world_grid
from kbot.world.world import Body, Box
from kbot.xacro import Packages

NAMES = (
    "carlikebot", "rbcar", "hunter2", "limo_ackermann", "audibot", "ackermann_em_3905", "agvs", "tricycle_gz",
    "ridgeback", "mpo_500", "nexus_4wd_mecanum", "linorobot2_mecanum", "robotino", "youbot", "rbvogui",
    "swervi", "bunker",
)  # fmt: skip
MAX_SPEED = 1.0, 2.0
"""m/s and rad/s without a map. Some robots declare more than 100 m/s."""
HEIGHT = 2.0
"""m. Walls and boxes are higher than every lidar."""
ARRIVE_WITHOUT_MAP = 0.1
"""m, or a tenth of the robot's length if that is more: odometry drifts."""


@dataclass
class Row:
    """The goals of one robot."""

    name: str
    kind: str
    trips: list[Trip] = field(default_factory=list)
    walls: list[float] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)

    def text(self) -> str:
        reached = [trip for trip in self.trips if trip.reached]
        contacts = sum(trip.collided for trip in self.trips)
        ratios = [trip.distance / trip.shortest for trip in reached if trip.shortest > 0.3]
        off = [1e3 * trip.off for trip in reached]
        return (
            f"| {self.name} | {self.kind} | {len(reached)} of {len(self.trips) + len(self.errors)} |"
            f" {contacts} | {_median(ratios):.2f} | {_median(off):.1f} | {_median(self.walls):.1f} |"
            f" {'; '.join(self.reasons())} |"
        )

    def reasons(self) -> list[str]:
        """Why goals were not reached, each once with its count."""
        found = [trip.status.reason for trip in self.trips if not trip.reached] + self.errors
        return [f"{found.count(reason)} x {reason}" for reason in dict.fromkeys(found)]


def _median(values: list[float]) -> float:
    return statistics.median(values) if values else math.nan


def load(robot: Robot, scratch: Path, folder: Path | None) -> RobotModel:
    for source in (robot.source, *robot.packages):
        if not (scratch / source.folder).exists():
            fetch(source, scratch, folder)
    packages = Packages(tuple(str(scratch / s.folder) for s in (robot.source, *robot.packages)))
    arguments = dict(word.split(":=") for word in robot.arguments)
    file = scratch / robot.source.folder / robot.file
    return load_robot(str(file), arguments=arguments, packages=packages).require()


def rooms(moves: Mobility, seed: int) -> tuple[World, PlanarPose]:
    """Rooms as large as a robot needs, with boxes, and a goal where it has some room."""
    random = np.random.default_rng(seed)
    length, width = sorted(np.ptp(moves.outline.corners, axis=0).tolist(), reverse=True)
    turning = moves.steering.radius if moves.steering is not None else 0.0
    size, door = max(4.0 * length, 4.0 * turning), 1.6 * width + 0.1
    bare = load_world(f"rooms:columns=3,rows=2,size={size:.3f},door={door:.3f}")
    boxes = []
    for number in range(8):
        x, y = random.uniform(-0.4, 2.4) * size, random.uniform(-0.4, 1.4) * size
        if math.hypot(x, y) > 1.5 * length and not _is_at_door(x / size, y / size):
            wide = (*random.uniform(0.1, 0.5, 2) * length, HEIGHT)
            boxes.append(box(f"box{number}", wide, x, y, yaw=float(random.uniform(0, 3)), rgba=WOOD))
    high = [_raised(body) for body in bare.bodies if not body.name.startswith("table")]
    world = World("rooms", (*high, *boxes))
    grid = world_grid(world, heights=(0.01, max(0.25, moves.shape.height)))
    field = DistanceField.of(
        grid.cells == 100, (grid.origin.x, grid.origin.y), grid.resolution, 2.0 * moves.shape.radius
    )
    footprint = FootprintClearance(moves.outline, grid.resolution)
    while True:
        x, y = random.uniform(-0.4, 2.4) * size, random.uniform(-0.4, 1.4) * size
        goal = PlanarPose(float(x), float(y), float(random.uniform(-3, 3)))
        at = goal @ moves.point
        clearance = footprint.of(field, np.array([at.x]), np.array([at.y]), np.array([at.yaw]))
        if clearance[0] > 0.03 + 0.05 * length and math.hypot(x, y) > length:
            return world, goal


def _raised(body: Body) -> Body:
    """A wall that is as high as the boxes."""
    (part,) = body.parts
    if not isinstance(part.shape, Box):
        return body
    size, place = (*part.shape.size[:2], HEIGHT), body.pose.translation
    pose = Transform.from_rotation_translation(body.pose.rotation, (place[0], place[1], HEIGHT / 2.0))
    return replace(body, parts=(replace(part, shape=Box(size)),), pose=pose)


def _is_at_door(x: float, y: float) -> bool:
    """Whether a place, in rooms, is in front of a door: doors are in the middle of the walls."""
    across = (abs(x - round(x)), abs(y - round(y)))
    return min(across) < 0.15 and max(across) > 0.25


def in_rooms(robot: RobotModel, name: str, goals: int, has_map: bool) -> Row:
    moves = mobility(Simulation(robot))
    row = Row(name, moves.kind)
    for seed in range(goals):
        world, goal = rooms(moves, seed)
        simulation = Simulation(robot, world)
        begun = time.process_time()
        try:
            if has_map:
                trip = go_to(simulation, goal)
            else:
                arrive = max(ARRIVE_WITHOUT_MAP, 0.2 * moves.shape.radius)
                trip = go_to_without_map(
                    simulation, goal, any_heading=True, arrive=arrive, max_speed=MAX_SPEED
                )
        except KbotError as error:
            row.errors.append(str(error))
            continue
        row.trips.append(trip)
        row.walls.append(time.process_time() - begun)
        print(f"  {name} {seed}: {trip.status}{' (contact)' if trip.collided else ''}", file=sys.stderr)
    return row


def in_the_open(robot: RobotModel, name: str, goals: int) -> tuple[str, bool]:
    """A row that compares driven paths with Reeds-Shepp distances, and whether no path is too short."""
    random = np.random.default_rng(1)
    shares, planned, reached, is_possible = [], [], 0, True
    for _ in range(goals):
        simulation = Simulation(robot)
        moves = mobility(simulation)
        assert moves.steering is not None
        radius, reach = moves.steering.radius, 6.0 * moves.steering.radius
        goal = PlanarPose(*random.uniform(-reach, reach, 2).tolist(), float(random.uniform(-3, 3)))
        odometer = _Odometer(simulation, moves.point)
        trip = go_to(simulation, goal)
        if not trip.reached:
            continue
        reached += 1
        start, end = moves.point, goal @ moves.point
        x, y = start.local(end.x, end.y)
        least, larger = (
            r * float(distances(np.array([x / r]), np.array([y / r]), np.array([goal.yaw]))[0])
            for r in (radius, RESERVE * radius)
        )
        is_possible = is_possible and odometer.distance > least - 0.02
        shares.append(odometer.distance / least)
        planned.append(odometer.distance / larger)
    row = (
        f"| {name} | {reached} of {goals} | {min(shares):.3f} | {_median(shares):.3f} |"
        f" {_median(planned):.3f} | {max(planned):.3f} |"
    )
    return row, is_possible


class _Odometer:
    """Measures the path of a point of the base. Reeds-Shepp distances are those of the axle's middle."""

    def __init__(self, simulation: Simulation, point: PlanarPose) -> None:
        self._simulation, self._point = simulation, point
        self._last = simulation.ground_truth.pose @ point
        self.distance = 0.0
        simulation.clock.every(100.0, self._sample)

    def _sample(self) -> None:
        pose = self._simulation.ground_truth.pose @ self._point
        self.distance += math.hypot(pose.x - self._last.x, pose.y - self._last.y)
        self._last = pose


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--from", dest="folder", type=lambda path: Path(path).resolve(), metavar="FOLDER")
    parser.add_argument("--goals", type=int, default=20)
    parser.add_argument("names", nargs="*", metavar="NAME")
    options = parser.parse_args()
    known = {robot.name: robot for robot in read_robots()}
    if unknown := sorted(set(options.names) - set(known)):
        parser.error(f"unknown name {', '.join(unknown)}")
    with_map, without_map, in_open, is_fine = [], [], [], True
    with tempfile.TemporaryDirectory() as scratch:
        for name in options.names or NAMES:
            robot = load(known[name], Path(scratch), options.folder)
            with_map.append(in_rooms(robot, name, options.goals, has_map=True))
            simulation = Simulation(robot)
            if level_lidars(simulation):
                without_map.append(in_rooms(robot, name, options.goals, has_map=False))
            if mobility(simulation).kind is BaseKind.STEERS:
                row, is_possible = in_the_open(robot, name, options.goals)
                in_open.append(row)
                is_fine = is_fine and is_possible
    for title, rows in (("with a map", with_map), ("without a map", without_map)):
        print(f"Rooms, {title}\n")
        print("| robot | base | reached | contacts | path | off, mm | processor, s | not reached |")
        print("| --- | --- | ---: | ---: | ---: | ---: | ---: | --- |")
        print("\n".join(row.text() for row in rows), end="\n\n")
    print("Path in the open, as a share of the Reeds-Shepp distance\n")
    print("| robot | reached | least | median | median, planned radius | most, planned radius |")
    print("| --- | ---: | ---: | ---: | ---: | ---: |")
    print("\n".join(in_open))
    contacts = sum(trip.collided for row in (*with_map, *without_map) for trip in row.trips)
    return int(contacts > 0 or not is_fine)


if __name__ == "__main__":
    sys.exit(main())
