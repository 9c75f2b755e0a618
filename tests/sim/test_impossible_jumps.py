"""A jump in velocity that no force explains is reported as an error of the engine, and nothing else is."""

import pytest

from kbot.kinematics.planar_pose import PlanarPose
from kbot.sim import Simulation
from kbot.sim.injected_faults import Kick, Payload
from kbot.world.builders import box
from kbot.world.world import World


def codes(simulation):
    return [found.code for found in simulation.findings]


@pytest.mark.parametrize("impulse", [(0.0, 0.0, 5.0), (3.0, 0.0, 0.0), (-2.0, 2.0, 1.5)])
def test_a_velocity_from_nowhere_is_an_error_of_the_engine(sim, impulse):
    """KBot falls over when it lands, which follows from the jump."""
    sim.cmd_vel(0.2, 0.0)
    sim.run(1.005)
    sim.engine.data.qvel[:3] += impulse
    sim.engine.data.qvel[3:6] += (9.0, 4.0, 0.0)
    sim.run(4.0)
    (found,) = sim.findings
    assert found.code == "W309"
    assert found.origin is None
    assert found.message.startswith("between 1.00 s and 1.02 s the velocity of the robot changes by ")
    assert "the robot is not at fault" in found.message
    sim.reset()
    assert sim.findings == ()


def test_a_jump_hides_only_what_follows_from_it(kbot_robot):
    """A command that is too fast was there before."""
    simulation = Simulation(kbot_robot)
    simulation.cmd_vel(1000.0, 0.0)
    simulation.run(1.5)
    simulation.engine.data.qvel[2] += 5.0
    simulation.run(1.0)
    assert codes(simulation) == ["W309", "W305"]


@pytest.mark.parametrize(("height", "speed"), [(0.0, 0.5), (-2.0, 0.5)])
def test_drops_are_possible(kbot_robot, height, speed):
    """From 2 m, it arrives at sqrt(2 g h) = 6.3 m/s and stops within a control period."""
    place = World("low", (box("slab", (50.0, 50.0, 0.2), 0.0, 0.0, height - 0.1, ground=True),))
    simulation = Simulation(kbot_robot, place)
    simulation.cmd_vel(speed, 0.0)
    simulation.run(3.0)
    assert "W309" not in codes(simulation)


@pytest.mark.parametrize("velocity", [3.0, 5.0, 7.0])
def test_collisions_are_possible(kbot_robot, velocity):
    """A robot that is fired at a wall stops there or bounces."""
    simulation = Simulation(kbot_robot, "corridor")
    simulation.models.set_twist((0.0, velocity, 0.0), (0.0, 0.0, 0.0))
    simulation.run(1.0)
    assert abs(simulation.ground_truth.pose.y) < 1.0
    assert "W309" not in codes(simulation)


def test_a_heavy_object_that_hits_the_robot_is_possible(kbot_robot):
    simulation = Simulation(kbot_robot)
    simulation.models.spawn_thing("box", "crate", x=1.0, z=1.5, size=(0.5, 0.5, 0.5))
    simulation.models.spawn_thing("box", "above", x=0.0, z=2.0, size=(0.4, 0.4, 0.4))
    simulation.run(2.0)
    assert simulation.collided
    assert "W309" not in codes(simulation)


def test_pushes_kicks_and_payloads_are_possible(kbot_robot):
    simulation = Simulation(kbot_robot)
    simulation.disturbances.schedule(Kick((4.0, 0.0, 2.0), (0.0, 8.0, 0.0)), at=0.505)
    simulation.disturbances.schedule(Payload("base_link", 5.0), at=0.8)
    simulation.run(1.5)
    simulation.disturbances.apply_body_wrench("base_link", (500.0, 0.0, 100.0), 0.03)
    simulation.run(1.0)
    assert "W309" not in codes(simulation)


def test_set_poses_and_twists_are_possible(sim):
    for _ in range(3):
        sim.run(0.303)
        sim.models.set_pose(3.0, 1.0, 0.4)
        sim.run(0.303)
        sim.models.set_twist((8.0, 0.0, 3.0), (0.0, 0.0, 1.0))
        state = sim.state()
        sim.run(0.303)
        sim.restore(state)
    sim.run(0.5)
    assert "W309" not in codes(sim)


def test_what_overlaps_at_the_start_is_pushed_out(kbot_robot):
    """The robot's front is 3 cm inside a wall, which W111 reports."""
    place = World(
        "wall", (box("floor", (9, 9, 0.1), 0, 0, -0.05, ground=True), box("wall", (0.1, 2, 1), 0.08, 0))
    )
    simulation = Simulation(kbot_robot, place, start=PlanarPose(0.0, 0.0, 0.0))
    assert [found.code for found in simulation.diagnostics] == ["W111"]
    simulation.run(2.0)
    assert "W309" not in codes(simulation)


@pytest.mark.parametrize("world", ["boxes", "maze", "ramp:angle=20", "stairs", "obstacle_course"])
def test_driving_into_everything_is_possible(kbot_robot, world):
    simulation = Simulation(kbot_robot, world)
    for linear, angular in ((1.0, 0.0), (-1.0, 2.0), (1.0, -1.0)):
        simulation.cmd_vel(linear, angular)
        simulation.run(4.0)
    assert "W309" not in codes(simulation)
