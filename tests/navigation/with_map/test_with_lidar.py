"""With a lidar the robot avoids obstacles that are not on its map."""

import math

import numpy as np
import pytest

from kbot.kinematics import PlanarPose, Transform
from kbot.model.load import load_robot
from kbot.navigation.controller import twist
from kbot.navigation.followers.obstacle_guard import ObstacleGuard
from kbot.navigation.goal_status import GoalState
from kbot.navigation.simulated.lidars import LidarPoints
from kbot.navigation.simulated.pilot import Pilot
from kbot.navigation.space.footprint import outline
from kbot.navigation.with_map.go_to import go_to
from kbot.navigation.with_map.navigator import NavigatorSettings
from kbot.sensors import Contact, Lidar
from kbot.sim import Simulation
from kbot.world.builders import box, floor
from kbot.world.occupancy import OccupancyGrid
from kbot.world.world import World

EMPTY = OccupancyGrid(np.zeros((100, 100), dtype=np.int8), 0.05, PlanarPose(-2.5, -2.5))
SENSOR = Lidar(link="base_link", pose=Transform.from_xyz_rpy((0, 0, 0.06), (0, 0, 0)), rate=20.0)


@pytest.fixture(scope="module")
def robot():
    return load_robot("kbot").require()


class _Straight:
    def update(self, observation):
        return twist(0.4, 0.0)


def _touched(simulation):
    return simulation.add_sensor(Contact(link="base_link", everywhere=True, rate=500.0)), []


def test_the_robot_stops_before_a_wall_without_touching_it(robot):
    simulation = Simulation(robot, World("wall", (floor(), box("wall", (0.1, 2.0, 0.3), 1.05, 0.0))))
    lidar = simulation.add_sensor(SENSOR)
    touches = []
    bumper = simulation.add_sensor(Contact(link="base_link", everywhere=True, rate=500.0))
    simulation.bus.subscribe("bumper", bumper.message_type, lambda m: touches.append(m.data))
    Pilot(simulation, ObstacleGuard(_Straight(), outline(robot, "base_footprint")), seen=LidarPoints(lidar))
    simulation.run(6.0)
    front = simulation.ground_truth.pose.x + 0.06
    assert 0.93 < front < 1.0
    assert not any(touches)


def test_the_robot_drives_around_a_box_that_is_not_on_the_map(robot):
    simulation = Simulation(robot, World("box", (floor(), box("box", (0.2, 0.5, 0.3), 0.7, 0.0))))
    trip = go_to(
        simulation, PlanarPose(1.6, 0.0), EMPTY, lidar=simulation.add_sensor(SENSOR),
        settings=NavigatorSettings(patience=1.0),
    )  # fmt: skip
    assert trip.reached, trip.status
    assert math.hypot(trip.pose.x - 1.6, trip.pose.y) < 0.02


def test_a_closed_way_ends_in_stuck_with_its_reason(robot):
    simulation = Simulation(robot, World("wall", (floor(), box("wall", (0.1, 9.0, 0.3), 0.7, 0.0))))
    trip = go_to(
        simulation, PlanarPose(1.6, 0.0), EMPTY, lidar=simulation.add_sensor(SENSOR),
        settings=NavigatorSettings(patience=1.0, attempts=1),
    )  # fmt: skip
    assert trip.status.state is GoalState.STUCK
    assert trip.status.reason
    assert trip.time < 60.0
    assert trip.pose.x + 0.06 < 0.65
