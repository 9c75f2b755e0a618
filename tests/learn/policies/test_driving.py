"""Policies drive simulated robots to goals."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import kbot
from kbot.kinematics.planar_pose import PlanarPose
from kbot.learn.interface.policy_interface import PolicyInterface, Sectors
from kbot.learn.interface.robot_interface import policy_interface
from kbot.learn.policies.driving import fitted, go_to_with_policy, policy_goals
from kbot.learn.policies.network import read_network
from kbot.learn.policies.policy import Policy
from kbot.model.load import load_robot_text
from kbot.model.writer import to_urdf
from kbot.text import KbotError

from .networks import linear, towards_goal

BLIND = PolicyInterface("goal", linear=(0.0, 0.4), angular=(-2.0, 2.0))
GOAL = PlanarPose(0.6, -0.5)


@pytest.fixture
def simulation() -> kbot.Simulation:
    return kbot.Simulation(kbot.load("kbot", lidar=True), world="rooms")


def policy(interface: PolicyInterface, **others: float) -> Policy:
    return Policy(read_network(towards_goal(interface, **others))).with_interface(interface)


def test_a_policy_reaches_a_goal(simulation: kbot.Simulation, straight_policy: Path) -> None:
    trip = go_to_with_policy(simulation, Policy.read(straight_policy), GOAL)
    assert trip.state == "reached", trip.status
    assert trip.map == "none"
    assert not trip.collided
    assert trip.off < 0.2
    assert trip.shortest == pytest.approx(math.hypot(0.6, 0.5))
    # it drives at 0.3 m/s, and time counts from the first 0.1 m to the last 0.2 m
    assert trip.arrival == pytest.approx((trip.shortest - 0.3) / 0.3, rel=0.25)
    assert trip.odometry_error < 0.005


def test_equal_runs_are_equal_bit_for_bit(straight_policy: Path) -> None:
    digests = set()
    for _ in range(2):
        sim = kbot.Simulation(kbot.load("kbot", lidar=True), world="rooms", seed=3)
        go_to_with_policy(sim, Policy.read(straight_policy), GOAL)
        digests.add(sim.state_sha256())
    assert len(digests) == 1


def test_it_knows_its_pose_from_odometry_only(simulation: kbot.Simulation, straight_policy: Path) -> None:
    """The wall stops the robot. Its wheels slip, and odometry reaches the goal."""
    trip = go_to_with_policy(simulation, Policy.read(straight_policy), PlanarPose(1.8, 1.8))
    assert trip.collided
    assert trip.state == "stuck"
    assert "because its pose estimate is" in trip.status.reason


def test_a_policy_that_passes_its_goal_and_drives_on_does_not_reach_it() -> None:
    """It sees the goal every 10 s, when it is far from it."""
    interface = PolicyInterface("goal", linear=(0.0, 0.4), angular=(-2.0, 2.0), rate=0.1)
    ahead = Policy(read_network(linear(np.zeros((2, 7)), np.array([1.0, 0.0])))).with_interface(interface)
    simulation = kbot.Simulation(kbot.load("kbot"))
    trip = go_to_with_policy(simulation, ahead, PlanarPose(1.0, 0.0), timeout=8.0)
    assert trip.arrival == pytest.approx((0.8 - 0.1) / 0.4, rel=0.1)  # from 0.1 m of movement
    assert trip.state == "stuck"
    assert "out of time" in trip.status.reason


def test_a_policy_that_is_faster_than_the_simulation_is_refused(simulation: kbot.Simulation) -> None:
    """A step of the simulation takes 0.002 s."""
    interface = replace(BLIND, rate=501.0)
    with pytest.raises(KbotError, match=r"501 commands per second, but the simulation makes only 500 steps"):
        go_to_with_policy(simulation, policy(interface), GOAL)
    assert fitted(policy(replace(BLIND, rate=500.0)), simulation).interface is not None


def test_a_number_that_is_not_finite_stops_the_robot(simulation: kbot.Simulation) -> None:
    weights, bias = np.zeros((2, 7)), np.array([0.5, 0.0])
    weights[1, 0] = math.inf  # inf * distance
    network = Policy(read_network(linear(weights, bias, clipped=False))).with_interface(BLIND)
    trip = go_to_with_policy(simulation, network, GOAL)
    assert trip.state == "stuck"
    assert "output 'angular' is not finite: inf" in trip.status.reason
    assert trip.distance < 0.001


def test_the_default_inputs_of_the_robot_apply_without_a_description(simulation: kbot.Simulation) -> None:
    interface = policy_interface(simulation, "goal")
    bare = Policy(read_network(towards_goal(interface)))
    assert fitted(bare, simulation).interface == interface
    message = r"not the default ones of robot 'kbot': the network's input has 7 numbers instead of 43"
    with pytest.raises(KbotError, match=message):
        fitted(Policy(read_network(towards_goal(BLIND))), simulation)


def test_a_policy_that_is_faster_than_the_robot_is_one_finding(simulation: kbot.Simulation) -> None:
    """The wheels of kbot turn at 1 m/s at most. A policy for this robot may exceed it by rounding."""
    slow = policy(replace(BLIND, linear=(0.0, 1.005)))
    fitted(slow, simulation)
    assert not simulation.findings
    fast = policy(replace(BLIND, linear=(-2.0, 1.0)))
    for _ in range(2):
        fitted(fast, simulation)
    (finding,) = simulation.findings
    assert finding.code == "W308"
    assert finding.message == "the policy commands up to 2 m/s, but robot 'kbot' only reaches 1 m/s"
    simulation.reset()
    assert simulation.findings == (finding,)


def test_a_policy_that_does_not_fit_is_refused(simulation: kbot.Simulation) -> None:
    lateral = policy(replace(BLIND, lateral=(-0.2, 0.2)))
    with pytest.raises(KbotError, match="commands a lateral speed, but robot 'kbot' cannot drive sideways"):
        go_to_with_policy(simulation, lateral, GOAL)
    seeing = policy(replace(BLIND, lidar=Sectors(4)))
    with pytest.raises(KbotError, match="robot 'kbot' declares no level lidar"):
        go_to_with_policy(kbot.Simulation("kbot"), seeing, GOAL)


def test_a_policy_that_follows_paths_does_not_fit(simulation: kbot.Simulation) -> None:
    interface = replace(BLIND, target="path")
    network = Policy(read_network(linear(np.zeros((2, len(interface.inputs))), np.zeros(2))))
    message = "the policy follows a path, and cannot drive to a goal. Run it in kbot/Follow-v0"
    with pytest.raises(KbotError, match=message):
        fitted(network.with_interface(interface), simulation)


def test_a_lidar_that_sees_less_than_the_policy_is_refused() -> None:
    robot = kbot.load("kbot", lidar=True)
    ahead = (
        to_urdf(robot)
        .replace("<min_angle>-3.14", "<min_angle>-1.57")
        .replace("<max_angle>3.12", "<max_angle>1.55")
    )
    simulation = kbot.Simulation(load_robot_text(ahead, "robot.urdf").require())
    message = "from -180 to 180 degrees, but the lidar of robot 'kbot' only from -90 to 89 degrees"
    with pytest.raises(KbotError, match=message):
        fitted(policy(replace(BLIND, lidar=Sectors(4))), simulation)
    half = policy(replace(BLIND, lidar=Sectors(4, -math.pi / 2, math.pi / 2)))
    assert fitted(half, simulation) is half


def test_a_lidar_with_less_range_than_the_policy_is_refused() -> None:
    short = to_urdf(kbot.load("kbot", lidar=True)).replace("<max>8.0</max>", "<max>2.0</max>")
    simulation = kbot.Simulation(load_robot_text(short, "robot.urdf").require())
    message = "obstacles up to 5 m, but the lidar of robot 'kbot' only up to 2 m"
    with pytest.raises(KbotError, match=message):
        fitted(policy(replace(BLIND, lidar=Sectors(4))), simulation)
    near = policy(replace(BLIND, lidar=Sectors(4, reach=2.0)))
    assert fitted(near, simulation) is near


def test_goals_follow_each_other(simulation: kbot.Simulation, straight_policy: Path) -> None:
    goals = policy_goals(simulation, Policy.read(straight_policy))
    goals.go(PlanarPose(0.5, 0.0))
    assert goals.status == "accepted"
    simulation.run(4.0)
    assert goals.status == "reached"
    assert not goals.is_driving
    assert goals.grid is None
    assert goals.path is None
    # it brakes 0.16 m from the goal
    assert 0.34 <= simulation.ground_truth.pose.x < 0.5
    goals.go(PlanarPose(0.5, 0.6))
    simulation.run(0.5)
    assert goals.status == "driving"
    goals.cancel("no longer wanted")
    assert str(goals.status) == "cancelled: no longer wanted"
    simulation.run(1.0)
    assert abs(simulation.ground_truth.twist.x) < 1e-3


def test_the_pose_estimate_continues_from_goal_to_goal(
    simulation: kbot.Simulation, straight_policy: Path
) -> None:
    """The wheels slip at the wall, so odometry is off from then on, until the robot is placed elsewhere."""
    goals = policy_goals(simulation, Policy.read(straight_policy))
    goals.go(PlanarPose(1.8, 1.8))
    simulation.run(9.0)

    def error() -> float:
        true, believed = simulation.ground_truth.pose, goals.pose
        return math.hypot(true.x - believed.x, true.y - believed.y)

    assert simulation.collided
    before = error()
    assert before > 0.3
    goals.cancel()
    simulation.run(0.5)
    goals.go(PlanarPose(0.0, 0.0))
    simulation.run(0.1)
    assert error() == pytest.approx(before, abs=0.1)
    goals.place(PlanarPose(0.5, 0.5))
    assert error() < 1e-6
    goals.go(PlanarPose(0.5, 0.5))
    assert error() < 1e-6
    goals.cancel()
    simulation.run(0.1)
    simulation.reset()
    simulation.run(1.0)
    assert error() < 1e-3


def test_a_reset_cancels_a_goal(simulation: kbot.Simulation, straight_policy: Path) -> None:
    goals = policy_goals(simulation, Policy.read(straight_policy))
    goals.go(PlanarPose(0.9, 0.0))
    simulation.run(1.0)
    simulation.reset()
    simulation.run(0.5)
    assert str(goals.status) == "cancelled: the simulation was reset"
    assert abs(simulation.ground_truth.pose.x) < 0.01


def test_goals_of_a_robot_that_does_not_fit_are_refused(straight_policy: Path) -> None:
    goals = policy_goals(kbot.Simulation("kbot"), Policy.read(straight_policy))
    with pytest.raises(KbotError, match="declares no level lidar"):
        goals.go(GOAL)


BASE = """<robot name="base"><link name="base_link">
<inertial><origin xyz="0 0 0.1"/><mass value="10"/>
<inertia ixx="0.2" iyy="0.3" izz="0.4" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><origin xyz="0 0 0.1"/><geometry><box size="0.5 0.4 0.2"/></geometry></collision></link>
<gazebo><plugin name="drive" filename="libgazebo_ros_planar_move.so"/></gazebo></robot>"""


def test_a_holonomic_base_drives_sideways() -> None:
    """The policy commands half of its highest speed to the left, 0.15 m/s, and nothing else."""
    interface = replace(BLIND, linear=(-0.3, 0.3), lateral=(-0.3, 0.3))
    network = linear(np.zeros((3, len(interface.inputs))), np.array([0.0, 0.0, 0.5]))
    simulation = kbot.Simulation(load_robot_text(BASE, "base.urdf").require())
    found = Policy(read_network(network)).with_interface(interface)
    trip = go_to_with_policy(simulation, found, PlanarPose(0.0, 1.0))
    assert trip.state == "reached", trip.status
    # it stops at 0.16 m
    assert (trip.pose.x, trip.pose.y) == pytest.approx((0.0, 0.84), abs=0.03)
    assert trip.time == pytest.approx(0.84 / 0.15, rel=0.1)
