"""Poses that peers set by Gazebo's names: a robot in the ground is raised onto it, others are exact."""

import math

import pytest

from kbot.messages import types as msg
from kbot.model.load import load_robot
from kbot.ros.gazebo.states import put
from kbot.sim import Simulation
from kbot.world.builders import box, floor
from kbot.world.world import World


@pytest.fixture
def simulation():
    simulation = Simulation(
        load_robot("kbot").require(), World("w", (floor(), box("step", (2, 2, 0.1), 3, 0)))
    )
    simulation.run(0.5)
    return simulation


def _put(simulation, x, z, yaw=0.0):
    pose = msg.Pose(msg.Point(x, 0.0, z), msg.Quaternion.about_z(yaw))
    put(simulation, simulation.robots.first.name, pose, msg.Twist(), "world")
    return simulation.link_pose(simulation.robot.root).translation


@pytest.mark.parametrize("sunk", [0.01, 0.03])
def test_a_robot_in_the_ground_stands_on_it(simulation, sunk):
    rest = simulation.link_pose(simulation.robot.root).translation[2]
    x, y, z = _put(simulation, -1.0, rest - sunk, 1.0)
    assert (x, y) == pytest.approx((-1.0, 0.0))
    assert z == pytest.approx(rest, abs=2e-3)
    heights = []
    for _ in range(50):
        simulation.run(0.02)
        heights.append(simulation.link_pose(simulation.robot.root).translation[2])
    assert max(heights) < rest + 2e-3
    assert simulation.ground_truth.pose.yaw == pytest.approx(1.0, abs=0.01)


def test_a_robot_in_an_obstacle_that_is_ground_stands_on_it(simulation):
    rest = simulation.link_pose(simulation.robot.root).translation[2]
    _, _, z = _put(simulation, 3.0, rest + 0.09)
    assert z == pytest.approx(rest + 0.1, abs=2e-3)


@pytest.mark.parametrize("above", [0.0, 0.4])
def test_a_robot_that_is_not_in_the_ground_is_placed_exactly(simulation, above):
    rest = simulation.link_pose(simulation.robot.root).translation[2]
    _, _, z = _put(simulation, -1.0, rest + above, math.pi / 3)
    assert z == pytest.approx(rest + above, abs=1e-9)
