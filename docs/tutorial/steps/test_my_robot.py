"""Test the description and the programs of my_robot."""

import avoid
import drive
import pytest

from kbot import Simulation
from kbot.checks import check_file

ROBOT = "urdf/my_robot.xacro"


def test_the_checker_finds_nothing() -> None:
    assert not check_file(ROBOT)


def test_it_drives_back_to_the_start() -> None:
    sim = Simulation(ROBOT)
    drive.drive(sim)
    pose = sim.ground_truth.pose
    assert (pose.x, pose.y) == pytest.approx((0.0, 0.0), abs=0.01)
    assert sim.odometry.pose.x == pytest.approx(pose.x, abs=0.001)


def test_it_touches_no_wall() -> None:
    sim = Simulation(ROBOT, world="rooms:columns=1,rows=1,size=2")
    avoid.drive(sim)
    assert not sim.collided
