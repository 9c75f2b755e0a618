"""Range, bumper and line sensors in worlds with known readings."""

import math

import pytest

from kbot.kinematics import PlanarPose, Transform
from kbot.sensors import Contact, Line, Noise, Range
from kbot.sim import Simulation
from kbot.world.builders import box, floor
from kbot.world.world import World

WALL = World("wall", (floor(), box("wall", (0.1, 4.0, 1.0), 1.05, 0.0)))
UP = Transform.from_xyz_rpy((0.0, 0.0, 0.5), (0.0, 0.0, 0.0))


def test_sonar_measures_the_nearest_point_of_a_wall(robot):
    simulation = Simulation(robot, WALL)
    sonar = simulation.add_sensor(Range(link="base_footprint", pose=UP))
    assert sonar.measure().range == pytest.approx(1.0, abs=1e-9)
    simulation.models.place(PlanarPose(0.0, 0.0, math.radians(5)))
    # the bottom of the wall is within the cone of 7.4 degrees to each side; rays are 7.4/4 degrees apart
    assert sonar.measure().range == pytest.approx(1.0, abs=1.0 / math.cos(math.radians(2)) - 1.0 + 1e-9)


def test_sonar_out_of_range_reads_infinity(robot):
    simulation = Simulation(robot, WALL)
    far = simulation.add_sensor(Range(link="base_footprint", name="far", pose=UP, range_max=0.9))
    near = simulation.add_sensor(
        Range(link="base_footprint", name="near", pose=UP, range_min=1.5, noise=Noise(0.1))
    )
    simulation.run(0.1)
    assert far.latest.range == math.inf
    assert near.latest.range == -math.inf


def test_bumper_detects_a_collision(robot):
    simulation = Simulation(robot, World("wall", (floor(), box("wall", (0.1, 2.0, 0.3), 0.35, 0.0))))
    bumper = simulation.add_sensor(Contact(link="base_link"))
    wheel = simulation.add_sensor(Contact(link="left_wheel", name="wheel"))
    simulation.run(0.5)
    assert bumper.latest.data is False
    simulation.cmd_vel(0.2, 0.0)
    # the plate's front is 0.06 m ahead of the axle, the wall's face at 0.30 m
    simulation.run(1.0)
    assert bumper.latest.data is False
    for _ in range(100):
        simulation.run(0.02)
        if bumper.latest.data:  # later the robot bounces off the wall by micrometres, between the readings
            break
    assert bumper.latest.data is True
    touches = bumper.touches()
    assert {touch.body for touch in touches} == {"wall"}
    assert sum(touch.force for touch in touches) > 1.0
    # the ground does not count as touched
    assert wheel.latest.data is False


def test_line_sensor_reads_a_line_darker_than_the_floor(robot):
    simulation = Simulation(robot, "track:line=0.03")
    low = Transform.from_xyz_rpy((0.05, 0.0, 0.01), (0.0, 0.0, 0.0))
    line = simulation.add_sensor(Line(link="base_footprint", pose=low, eyes=5, spacing=0.02))
    seen = line.measure().data
    # the line is 0.03 m wide: of the eyes at 0.04, 0.02, 0 … only the middle one is above it
    assert [value < 0.2 for value in seen] == [False, False, True, False, False]
    assert seen[0] > 0.8
    simulation.models.place(PlanarPose(0.0, 0.02))
    # the robot is to the left of the line: an eye on its right sees it
    assert [value < 0.2 for value in line.measure().data] == [False, False, False, True, False]


def test_line_sensor_sees_a_line_added_to_a_running_world(robot):
    simulation = Simulation(robot, World("floor", (floor(),)))
    low = Transform.from_xyz_rpy((0.0, 0.0, 0.01), (0.0, 0.0, 0.0))
    line = simulation.add_sensor(Line(link="base_footprint", pose=low, eyes=1))
    assert line.measure().data[0] > 0.3
    black = "<material><diffuse>0 0 0 1</diffuse></material>"
    shape = "<geometry><box><size>0.2 0.02 0.001</size></box></geometry>"
    simulation.models.spawn_sdf(
        "<sdf version='1.9'><model name='tape'><static>true</static><link name='link'>"
        f"<visual name='paint'>{shape}{black}</visual></link></model></sdf>"
    )
    assert line.measure().data == (0.0,)
    simulation.models.delete_model("tape")
    assert line.measure().data[0] > 0.3
