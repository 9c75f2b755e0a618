"""What is in view, by geometry."""

import math

import numpy as np
import pytest

from kbot.kinematics import Transform
from kbot.sensors import LogicalCamera, Noise
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.world.builders import at, box, floor
from kbot.world.world import Body, Box, Part, World

UP = Transform.from_xyz_rpy((0.0, 0.0, 0.1), (0.0, 0.0, 0.0))

THINGS = World(
    "things",
    (
        floor(),
        box("ahead", (0.1, 0.1, 0.2), 1.0, 0.0),
        box("near", (0.1, 0.1, 0.2), 0.4, 0.0),
        box("far", (0.1, 0.1, 0.2), 3.1, 0.0),
        # at 2 m a view of 90 degrees reaches 2 m to the sides, and with an aspect of 2, 1 m up
        box("left_within", (0.1, 0.1, 0.2), 2.0, 1.99),
        box("left_beyond", (0.1, 0.1, 0.2), 2.0, 2.01),
        box("up_within", (0.1, 0.1, 0.1), 2.0, 0.0, 1.09, yaw=0.5),
        box("up_beyond", (0.1, 0.1, 0.1), 2.0, 0.5, 1.11),
        Body("ball", (Part(Box((0.1, 0.1, 0.1))),), at(1.5, -0.5, 0.05), mass=1.0),
    ),
)
SPEC = LogicalCamera(link="base_footprint", pose=UP, near=0.5, far=3.0, fov=math.pi / 2, aspect=2.0)


def _seen(sensor):
    return {t.child_frame_id: t.transform for t in sensor.measure().transforms}


def test_what_is_in_view_and_where(robot):
    simulation = Simulation(robot, THINGS)
    sensor = simulation.add_sensor(SPEC)
    seen = _seen(sensor)
    assert set(seen) == {"ahead", "left_within", "up_within", "ball"}
    place = seen["up_within"].translation
    assert (place.x, place.y, place.z) == pytest.approx((2.0, 0.0, 0.99), abs=1e-3)
    assert seen["up_within"].rotation.z == pytest.approx(math.sin(0.25), abs=1e-3)


def test_it_turns_with_the_robot_and_follows_what_moves(robot):
    simulation = Simulation(robot, THINGS)
    sensor = simulation.add_sensor(SPEC)
    simulation.set_pose(0.0, 0.0, math.pi)
    assert not _seen(sensor)
    simulation.set_pose(0.0, 0.0, -math.pi / 4)
    (name,) = _seen(sensor)
    assert name == "ball"
    place = _seen(sensor)["ball"].translation
    # (1.5, -0.5) turned by an eighth to the left
    assert (place.x, place.y) == pytest.approx((math.sqrt(2.0), math.sqrt(0.5)), abs=1e-3)


def test_noise_latency_and_topic(robot):
    simulation = Simulation(robot, THINGS)
    sensor = simulation.add_sensor(
        LogicalCamera(link="base_footprint", name="eye", pose=UP, rate=100.0, noise=Noise(0.03), latency=0.05)
    )
    heard = []
    simulation.bus.subscribe("eye/models", sensor.message_type, heard.append)
    simulation.run(5.06)
    assert len(heard) == 501
    x = np.array([next(t.transform.translation.x for t in m.transforms if t.child_frame_id == "ahead")
                  for m in heard])  # fmt: skip
    assert x.std() == pytest.approx(0.03, rel=0.15)
    assert x.mean() == pytest.approx(1.0, abs=0.006)


@pytest.mark.parametrize("spec", [{"near": 2.0, "far": 1.0}, {"fov": 4.0}, {"aspect": 0.0}])
def test_views_that_are_none(spec):
    with pytest.raises(KbotError):
        LogicalCamera(link="base_link", **spec)
