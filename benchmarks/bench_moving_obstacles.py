"""Goals without a map among obstacles that move: arrivals and contacts.

    python benchmarks/bench_moving_obstacles.py [COUNT] [--without]

KBot drives through a hall of 8 m x 4 m at up to 1 m/s. The obstacles are boxes with edges of 0.25 to 0.45 m.
They move at 0.3 to 1 m/s, whatever the robot does. In `parking`, no run can arrive, because a box stands on
the goal. These runs pass if the robot does not drive into the box.

    crossing   three boxes cross the hall between the robot and its goal, back and forth
    oncoming   two boxes come from the goal towards the robot's start
    parking    a box drives into the goal, and stays: the robot must stop before it, and report the reason

A contact while the robot drives towards the box counts as its fault, others as the box's. COUNT is
the number of seeds of each, 20 by default. `--without` ignores the velocities of obstacles, for comparison.
"""

from __future__ import annotations

import argparse
import math
import random
import statistics
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from kbot.kinematics import PlanarPose, Transform
from kbot.model import RobotModel
from kbot.model.load import load_robot
from kbot.navigation.goal_status import GoalState
from kbot.navigation.perception.moving_obstacles import MovingObstacles
from kbot.navigation.simulated.collision_watch import CollisionWatch
from kbot.navigation.without_map.local_pilot import LocalPilot, local_navigator
from kbot.sim import Simulation
from kbot.sim.wheel_odometry import Motion
from kbot.world import World
from kbot.world.builders import floor, wall

START, GOAL = PlanarPose(-3.0, 0.0), PlanarPose(3.0, 0.0)
ARRIVE, TIME_LIMIT = 0.2, 60.0
RATE = 50.0
"""Updates of the boxes per second."""
HEIGHT = 0.4
STANDS = 0.05
"""m/s. A robot that drives towards a box more slowly is hit by the box."""

Way = Callable[[float], tuple[float, float]]
"""The place of a box in m at a time in s."""


@dataclass(frozen=True)
class Outcome:
    state: GoalState
    reason: str
    seconds: float
    drove_into: bool
    was_hit: bool


def hall() -> World:
    walls = (
        wall("left", (-4.0, 2.0), (4.0, 2.0)),
        wall("right", (-4.0, -2.0), (4.0, -2.0)),
        wall("back", (-4.0, -2.0), (-4.0, 2.0)),
        wall("front", (4.0, -2.0), (4.0, 2.0)),
    )
    return World("hall", (floor(), *walls))


def there_and_back(start: float, end: float, speed: float, phase: float) -> Callable[[float], float]:
    """A coordinate that moves between two values, beginning at a share `phase` of the way there and back."""
    length = abs(end - start)

    def at(time: float) -> float:
        along = (phase * 2.0 * length + speed * time) % (2.0 * length)
        along = along if along < length else 2.0 * length - along
        return start + math.copysign(along, end - start)

    return at


def _across(x: float, y: Callable[[float], float], time: float) -> tuple[float, float]:
    return x, y(time)


def _along(x: Callable[[float], float], y: float, time: float) -> tuple[float, float]:
    return x(time), y


def crossing(draw: random.Random) -> list[Way]:
    ways: list[Way] = []
    for x in (-1.3, 0.2, 1.7):
        across = there_and_back(-1.6, 1.6, draw.uniform(0.3, 1.0), draw.random())
        ways.append(partial(_across, x + draw.uniform(-0.2, 0.2), across))
    return ways


def oncoming(draw: random.Random) -> list[Way]:
    ways: list[Way] = []
    for side in (-1.0, 1.0):
        x = there_and_back(3.6, -3.6, draw.uniform(0.3, 1.0), 0.0)
        y = side * draw.uniform(0.0, 0.5) + 0.3 * side
        ways.append(partial(_along, x, y))
    return ways


def parking(draw: random.Random) -> list[Way]:
    speed, y = draw.uniform(0.3, 1.0), draw.choice((-1.6, 1.6))
    arrives = draw.uniform(2.0, 6.0)
    begins = arrives - abs(y) / speed

    def way(time: float) -> tuple[float, float]:
        left = max(0.0, abs(y) - speed * max(0.0, time - begins))
        return GOAL.x, math.copysign(left, y)

    return [way]


def _approach(robot: Motion, boxes: list[tuple[float, float]]) -> float:
    """The speed in m/s with which the robot drives towards the nearest box."""
    x, y = min((robot.pose.local(*box) for box in boxes), key=lambda place: math.hypot(*place))
    return (robot.twist.x * x + robot.twist.y * y) / math.hypot(x, y)


def drive(robot: RobotModel, scenario: Callable[[random.Random], list[Way]], seed: int) -> Outcome:
    draw = random.Random(seed)
    ways = scenario(draw)
    simulation = Simulation(robot, hall(), start=START, seed=seed)
    for number in range(len(ways)):
        edge = draw.uniform(0.25, 0.45)
        simulation.models.spawn_thing("box", f"box_{number}", 0.0, 50.0 + number, size=(edge, edge, HEIGHT))
    collisions = CollisionWatch(simulation)
    drove_into = was_hit = False

    def move() -> None:
        nonlocal drove_into, was_hit
        time = simulation.time
        robot_now = simulation.ground_truth
        if collisions.collided and not (drove_into or was_hit):
            drove_into = max(approaches) >= STANDS
            was_hit = not drove_into
        approaches[:] = [approaches[-1], _approach(robot_now, [way(time) for way in ways])]
        for number, way in enumerate(ways):
            (x, y), (later_x, later_y) = way(time), way(time + 1.0 / RATE)
            velocity = (later_x - x) * RATE, (later_y - y) * RATE, 0.0
            pose = Transform.from_xyz_rpy((x, y, 0.001), (0.0, 0.0, 0.0))
            simulation.models.set_model_state(f"box_{number}", pose, velocity)

    approaches = [0.0, 0.0]
    navigator, lidars = local_navigator(simulation)
    navigator.go(GOAL, any_heading=True, arrive=ARRIVE, timeout=TIME_LIMIT)
    simulation.clock.every(RATE, move)
    pilot = LocalPilot(simulation, navigator, lidars)
    while navigator.status is not None and not navigator.status.state.is_end:
        simulation.run(0.05)
    pilot.close()
    assert navigator.status is not None
    status = navigator.status
    return Outcome(status.state, status.reason, simulation.time, drove_into, was_hit)


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("count", type=int, nargs="?", default=20)
    parser.add_argument("--without", action="store_true")
    options = parser.parse_args()
    if options.without:
        MovingObstacles.add = lambda *_: None  # type: ignore[method-assign]  # to compare
    robot = load_robot("kbot", {"lidar": "true"}).require()
    print("scenario  runs  arrived  drove into a box  hit by a box  median time  reasons of the others")
    faults = 0
    for scenario in (crossing, oncoming, parking):
        outcomes = [drive(robot, scenario, seed) for seed in range(options.count)]
        arrived = [o.seconds for o in outcomes if o.state is GoalState.REACHED]
        others = sorted({o.reason.split(",")[0] for o in outcomes if o.state is not GoalState.REACHED})
        into = sum(o.drove_into for o in outcomes)
        faults += into
        print(
            f"{scenario.__name__:9s} {len(outcomes):4d} {len(arrived):8d} {into:17d}"
            f" {sum(o.was_hit for o in outcomes):13d}"
            f" {statistics.median(arrived) if arrived else math.nan:10.1f} s  {'; '.join(others)}",
            flush=True,
        )
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
