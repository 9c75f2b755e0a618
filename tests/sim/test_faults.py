"""Injected faults act at their time, for their duration, and in the same way in every run."""

import json
from math import hypot

import numpy as np
import pytest

from kbot.messages import Odometry
from kbot.sim import Simulation
from kbot.sim.injected_faults import (
    BlockedJoint,
    Kick,
    LostCommands,
    Payload,
    SilentTopic,
    Slip,
    from_journal,
    to_journal,
)
from kbot.text import KbotError


def test_blocked_wheel_turns_the_robot_about_it_until_the_fault_ends(sim):
    """With the left wheel blocked, the robot turns about its contact point. Then it drives on as before."""
    sim.disturbances.schedule(BlockedJoint("left_wheel_joint"), at=1.0, duration=1.0)
    sim.cmd_vel(0.1, 0.0)
    sim.run(1.0)
    wheel = sim.joint_positions["left_wheel_joint"]
    assert abs(sim.ground_truth.pose.yaw) < 1e-6
    sim.run(1.0)
    assert sim.joint_positions["left_wheel_joint"] == pytest.approx(wheel, abs=0.01)
    assert sim.ground_truth.pose.yaw == pytest.approx(0.1 / 0.174, rel=0.15)
    before = sim.joint_positions["left_wheel_joint"]
    sim.run(1.0)
    assert sim.joint_positions["left_wheel_joint"] > before + 1.0


@pytest.mark.parametrize("at", [0.2, 0.8], ids=["acting", "to come"])
@pytest.mark.parametrize(
    "fault",
    [BlockedJoint("left_wheel_joint", "other"), Kick((0.1, 0.0, 0.0), robot="other")],
    ids=["blocked", "kicked"],
)
def test_fault_is_removed_with_its_robot(sim, kbot_robot, fault, at):
    sim.models.spawn_model(kbot_robot, "other", x=2.0)
    sim.disturbances.schedule(fault, at)
    sim.disturbances.schedule(Slip("left_wheel", 0.1), at=0.0)
    sim.run(0.5)
    sim.models.delete_model("other")
    assert [entry.fault for entry in sim.disturbances.faults] == [Slip("left_wheel", 0.1)]
    sim.run(1.0)
    sim.reset()
    sim.run(1.0)


@pytest.mark.parametrize(
    "fault",
    [
        Slip("left_wheel", np.float32(0.25)),
        Payload("base_link", np.float32(0.5), np.array([0.0, 0.0, 0.1])),
        LostCommands(np.float32(0.5)),
        Kick(np.array([0.1, 0.0, 0.0]), [0, 0, 1]),
    ],
    ids=lambda fault: type(fault).__name__,
)
def test_fault_with_numpy_numbers_survives_the_journal(fault):
    assert from_journal(json.loads(json.dumps(to_journal(fault)))) == fault


def test_slipping_wheel_makes_odometry_wrong(kbot_robot):
    distances = []
    for friction in (1.0, 0.0):
        sim = Simulation(kbot_robot)
        for wheel in ("left_wheel", "right_wheel"):
            sim.disturbances.schedule(Slip(wheel, friction), at=0.0)
        sim.cmd_vel(0.3, 0.0)
        sim.run(2.0)
        distances.append((sim.ground_truth.pose.x, sim.odometry.pose.x))
    assert distances[0][0] == pytest.approx(distances[0][1], abs=1e-5)
    assert distances[1][0] < 0.01
    assert distances[1][1] > 0.4


def test_payload_adds_weight_until_the_fault_ends(sim):
    """A payload of 1 kg doubles the weight, which the contact forces of the ground show."""
    model, _ = sim.engine.current()
    sim.disturbances.schedule(Payload("base_link", 1.0, (0.0, 0.0, 0.02)), at=0.5, duration=0.5)
    weights = []
    for _ in range(3):
        sim.run(0.45)
        weights.append(float(model.body_subtreemass[0]))
        sim.run(0.05)
    assert weights[1] - weights[0] == pytest.approx(1.0)
    assert weights[2] == pytest.approx(weights[0])
    assert sim.link_pose("base_link").translation[2] == pytest.approx(0.04, abs=1e-4)


def test_only_commands_from_outside_are_lost(sim):
    sim.disturbances.schedule(LostCommands(1.0), at=0.0)
    sim.robots.first.command(0.2, 0.0)
    sim.run(0.4)
    assert sim.robots.first.twist.x == 0.0
    sim.cmd_vel(0.2, 0.0)
    sim.run(0.4)
    assert sim.robots.first.twist.x == pytest.approx(0.2)


def test_lost_commands_depend_on_the_seed(kbot_robot):
    def received_commands(seed):
        sim, received = Simulation(kbot_robot, seed=seed), []
        sim.disturbances.schedule(LostCommands(0.5), at=0.0)
        for index in range(200):
            sim.robots.first.command(0.001 * (index + 1), 0.0)
            received.append(sim.robots.first.commanded_twist.x == 0.001 * (index + 1))
        return received

    assert sum(received_commands(1)) == pytest.approx(100, abs=30)
    assert received_commands(1) == received_commands(1) != received_commands(2)


def test_silent_topic_publishes_again_after_the_fault(sim):
    received = []
    sim.bus.subscribe("/odom", Odometry, lambda m: received.append(m.header.stamp.seconds))
    sim.disturbances.schedule(SilentTopic("/odom"), at=0.1, duration=0.2)
    sim.run(0.5)
    assert not [t for t in received if 0.11 < t < 0.29]
    assert len(received) == pytest.approx(15, abs=1)


def test_kick_acts_once_at_its_time(sim):
    sim.disturbances.schedule(Kick((0.0, 0.4, 0.0)), at=0.5)
    sim.run(0.498)
    assert abs(sim.ground_truth.pose.y) < 1e-9
    sim.run(1.0)
    moved = sim.ground_truth.pose.y
    assert moved > 0.003
    sim.run(1.0)
    assert sim.ground_truth.pose.y == pytest.approx(moved, abs=1e-4)


def test_faults_start_again_after_a_reset_and_a_restore(sim):
    sim.disturbances.schedule(BlockedJoint("left_wheel_joint"), at=0.5, duration=0.5)
    sim.disturbances.schedule(Kick((0.1, 0.1, 0.0)), at=1.2)
    sim.cmd_vel(0.2, 0.0)
    sim.run(0.7)
    saved = sim.state()
    sim.run(1.0)
    first = sim.state_sha256()
    sim.restore(saved)
    sim.run(1.0)
    assert sim.state_sha256() == first
    sim.reset()
    sim.cmd_vel(0.2, 0.0)
    sim.run(1.7)
    assert sim.state_sha256() == first


def test_fault_continues_when_a_robot_is_spawned(sim, kbot_robot):
    sim.disturbances.schedule(BlockedJoint("left_wheel_joint"), at=0.0)
    sim.cmd_vel(0.1, 0.0)
    sim.run(0.5)
    sim.models.spawn_model(kbot_robot, "b", x=2.0)
    before = sim.joint_positions["left_wheel_joint"]
    sim.run(0.5)
    assert sim.joint_positions["left_wheel_joint"] == pytest.approx(before, abs=0.01)
    assert hypot(sim.ground_truth.pose.x, sim.ground_truth.pose.y) < 0.2


@pytest.mark.parametrize(
    ("make", "at", "duration", "message"),
    [
        (lambda: BlockedJoint("lef_wheel_joint"), 1.0, None, "did you mean 'left_wheel_joint'"),
        (lambda: Slip("nothing", 0.1), 1.0, None, "has no link 'nothing'"),
        (lambda: Slip("left_wheel", -1.0), 1.0, None, "coefficient of friction"),
        (lambda: Payload("base_link", float("nan")), 1.0, None, "mass of a payload"),
        (lambda: LostCommands(2.0), 1.0, None, "from 0 to 1"),
        (lambda: SilentTopic("/odon"), 1.0, None, "did you mean '/odom'"),
        (lambda: BlockedJoint("left_wheel_joint", "b"), 1.0, None, "unknown robot 'b'"),
        (lambda: LostCommands(), -1.0, None, "from now"),
        (lambda: LostCommands(), float("nan"), None, "from now"),
        (lambda: LostCommands(), 1.0, 0.0, "above 0"),
    ],
)
def test_invalid_fault_is_rejected(sim, make, at, duration, message):
    before = sim.state_sha256()
    with pytest.raises(KbotError, match=message):
        sim.disturbances.schedule(make(), at, duration)
    sim.cmd_vel(0.2, 0.0)
    sim.run(0.5)
    assert sim.ground_truth.twist.x == pytest.approx(0.2, rel=0.01)
    assert before != sim.state_sha256()
