"""With a lidar the robot avoids obstacles that are not on its map."""

import math

import numpy as np
import pytest

from kbot.kinematics import PlanarPose, Transform
from kbot.model.load import load_robot
from kbot.navigation.controller import twist
from kbot.navigation.footprint import Outline, outline
from kbot.navigation.goal_status import GoalState
from kbot.navigation.navigator import NavigatorSettings
from kbot.navigation.obstacle_guard import ObstacleGuard
from kbot.navigation.simulated import LidarPoints, Pilot, go_to
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


def test_the_outline_of_kbot_is_that_of_its_plate_and_wheels(robot):
    # the plate reaches from 0.10 m behind the axle to 0.06 m ahead and 0.08 m to each side;
    # the wheels are 0.07 m long and reach 0.0895 m to each side
    half = [(-0.10, 0.08), (-0.035, 0.0895), (0.035, 0.0895), (0.06, 0.08)]
    expected = sorted([*half, *((x, -y) for x, y in half)])
    corners = outline(robot, "base_footprint").corners.round(9).tolist()
    assert np.array(sorted(corners)) == pytest.approx(np.array(expected))


def test_an_outline_grows_by_its_margin():
    box = Outline.rectangle(-0.1, 0.2, -0.05, 0.05).grown(0.01)
    points = np.array(
        [(0.205, 0.0), (0.215, 0.0), (0.0, 0.059), (0.0, 0.061), (-0.105, -0.055), (-0.12, 0.0)]
    )
    assert box.holds(points).tolist() == [True, False, True, False, True, False]
    assert box.reach == pytest.approx(math.hypot(0.2, 0.05) + 0.01)


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
