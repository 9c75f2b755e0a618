"""KBot with its lidar on: `lidar:=true`."""

import math

import numpy as np
import pytest

import kbot
from kbot.kinematics import PlanarPose
from kbot.navigation.simulated import go_to
from kbot.sensors import Lidar
from kbot.sensors.declared import declared_sensors, mount_declared


def test_without_being_asked_for_there_is_none():
    robot = kbot.load("kbot")
    assert "lidar_link" not in robot.links
    assert not declared_sensors(robot).specs


@pytest.mark.parametrize("control", ["classic", "gz", "ros2_control", "none"])
def test_each_simulator_is_told_of_the_same_lidar(control):
    (spec,) = declared_sensors(kbot.load("kbot", lidar=True, control=control)).specs
    assert isinstance(spec, Lidar)
    assert (spec.samples, spec.rate, spec.frame) == (360, 20.0, "lidar_link")
    assert spec.topic.removeprefix("/") == "scan"  # plugins of gazebo_ros give a full name
    # the beams are a degree apart all around
    assert spec.increment == pytest.approx(math.radians(1))
    assert spec.noise.stddev == 0.005


@pytest.mark.parametrize("radius", [0.035, 0.06])
def test_its_beams_pass_over_the_wheels(radius):
    robot = kbot.load("kbot", lidar=True, wheel_radius=radius)
    x, _, z = robot.pose("lidar_link", in_frame="base_footprint").translation
    assert z > 2 * radius + 0.01
    assert x == pytest.approx(0.0)


def test_it_measures_a_corridor_and_drives_by_it():
    simulation = kbot.Simulation(kbot.load("kbot", lidar=True), "corridor")
    sensors, said = mount_declared(simulation)
    assert not said
    simulation.run(0.1)
    ranges = sensors["lidar"].latest.ranges
    # walls 0.02 m thick, their middles 0.4 m to each side; noise of 5 mm
    assert ranges[[90, 270]] == pytest.approx([0.39, 0.39], abs=0.025)
    # the far wall's middle is at 5.5 m
    assert ranges[180] == pytest.approx(5.49, abs=0.025)
    assert np.isinf(ranges[0])
    trip = go_to(simulation, PlanarPose(1.5, 0.1, 0.0), lidar=sensors["lidar"])
    assert trip.reached, trip.status
