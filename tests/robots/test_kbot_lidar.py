"""KBot with its lidar (`lidar:=true`)."""

import math

import numpy as np
import pytest

import kbot
from kbot.kinematics import PlanarPose
from kbot.navigation.with_map.go_to import go_to
from kbot.sensors import Lidar
from kbot.sensors.declared import declared_sensors, mount_declared


def test_kbot_has_no_lidar_by_default():
    robot = kbot.load("kbot")
    assert "lidar_link" not in robot.links
    assert not declared_sensors(robot).specs


@pytest.mark.parametrize("control", ["classic", "gz", "ros2_control", "none"])
def test_the_lidar_is_declared_equally_for_every_simulator(control):
    (spec,) = declared_sensors(kbot.load("kbot", lidar=True, control=control)).specs
    assert isinstance(spec, Lidar)
    assert (spec.samples, spec.rate, spec.frame) == (360, 20.0, "lidar_link")
    assert spec.topic.removeprefix("/") == "scan"  # plugins of gazebo_ros give a full name
    # one beam per degree, all around
    assert spec.increment == pytest.approx(math.radians(1))
    assert spec.noise.stddev == 0.005


@pytest.mark.parametrize("radius", [0.035, 0.06])
def test_the_beams_of_the_lidar_pass_over_the_wheels(radius):
    robot = kbot.load("kbot", lidar=True, wheel_radius=radius)
    x, _, z = robot.pose("lidar_link", in_frame="base_footprint").translation
    assert z > 2 * radius + 0.01
    assert x == pytest.approx(0.0)


def test_the_lidar_measures_a_corridor_and_guides_the_robot():
    simulation = kbot.Simulation(kbot.load("kbot", lidar=True), "corridor")
    sensors, diagnostics = mount_declared(simulation)
    assert not diagnostics
    simulation.run(0.1)
    ranges = sensors["lidar"].latest.ranges
    # the walls are 0.02 m thick, their middles are 0.4 m to each side, and the noise is 5 mm
    assert ranges[[90, 270]] == pytest.approx([0.39, 0.39], abs=0.025)
    # the far wall's middle is at 5.5 m
    assert ranges[180] == pytest.approx(5.49, abs=0.025)
    assert np.isinf(ranges[0])
    trip = go_to(simulation, PlanarPose(1.5, 0.1, 0.0), lidar=sensors["lidar"])
    assert trip.reached, trip.status
