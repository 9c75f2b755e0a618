"""Overlapping faults, and faults that end early."""

from math import inf

import pytest

from kbot.messages import Odometry
from kbot.sim.injected_faults import BlockedJoint, LostCommands, Payload, SilentTopic, Slip
from kbot.text import KbotError


def mass(sim) -> float:
    model, _ = sim.engine.current()
    return float(model.body_subtreemass[0])


def test_overlapping_payloads_end_at_their_own_times(sim):
    before = mass(sim)
    sim.disturbances.schedule(Payload("base_link", 1.0), at=0.0, duration=0.4)
    sim.disturbances.schedule(Payload("base_link", 2.0), at=0.2, duration=0.4)
    carried = []
    for _ in range(4):
        sim.run(0.1)
        carried.append(mass(sim) - before)
        sim.run(0.1)
    assert carried == pytest.approx([1.0, 3.0, 2.0, 0.0])
    assert mass(sim) == before


def test_scheduling_a_later_fault_does_not_change_the_active_one(sim):
    sim.disturbances.schedule(SilentTopic("odom"), at=0.0, duration=0.3)
    sim.disturbances.schedule(SilentTopic("odom"), at=0.2, duration=0.3)
    sim.disturbances.schedule(LostCommands(0.5), at=0.0, duration=0.3)
    sim.disturbances.schedule(LostCommands(0.9), at=0.6, duration=0.1)
    received, lost = [], []
    sim.bus.subscribe("odom", Odometry, lambda message: received.append(sim.time))
    for _ in range(8):
        sim.run(0.05)
        lost.append(sim.commands.lost_share)
        sim.run(0.05)
    assert received[0] == pytest.approx(0.5, abs=0.021)  # odometry is published every 0.02 s
    assert lost == [0.5, 0.5, 0.5, 0.0, 0.0, 0.0, 0.9, 0.0]


def test_wheel_grips_again_after_two_overlapping_faults(sim):
    model, _ = sim.engine.current()
    geom = next(
        g for g in range(model.ngeom) if model.geom_bodyid[g] == sim.robots.first.body.index("left_wheel")
    )
    before = model.geom_friction[geom, 0]
    sim.disturbances.schedule(Slip("left_wheel", 0.2), at=0.0, duration=0.2)
    sim.disturbances.schedule(Slip("left_wheel", 0.1), at=0.1, duration=0.2)
    found = []
    for _ in range(4):
        sim.run(0.05)
        found.append(float(model.geom_friction[geom, 0]))
        sim.run(0.05)
    assert found == [0.2, 0.1, 0.1, before]


def test_ended_fault_does_not_start_again_after_a_reset(sim):
    number = sim.disturbances.schedule(BlockedJoint("left_wheel_joint"), at=0.0)
    sim.cmd_vel(0.1, 0.0)
    sim.run(0.5)
    assert abs(sim.joint_positions["left_wheel_joint"]) < 0.01
    sim.disturbances.end_fault(number)
    for _ in range(2):
        start = sim.joint_positions["left_wheel_joint"]
        sim.run(1.0)
        assert sim.joint_positions["left_wheel_joint"] - start > 1.0
        sim.reset()
        sim.cmd_vel(0.1, 0.0)
    with pytest.raises(KbotError, match=f"no fault has the number {number}; scheduled faults: none"):
        sim.disturbances.end_fault(number)


def test_ending_the_first_of_two_payloads_keeps_the_second(sim):
    before = mass(sim)
    first = sim.disturbances.schedule(Payload("base_link", 1.0), at=0.0)
    second = sim.disturbances.schedule(Payload("base_link", 2.0), at=0.0, duration=5.0)
    later = sim.disturbances.schedule(Payload("base_link", 4.0), at=3.0, duration=1.0)
    sim.run(0.1)
    assert [(entry.number, entry.start, entry.stop) for entry in sim.disturbances.faults] == [
        (first, 0.0, inf),
        (second, 0.0, 5.0),
        (later, 3.0, 4.0),
    ]
    sim.disturbances.end_fault(first)
    assert mass(sim) - before == pytest.approx(2.0)
    assert [entry.number for entry in sim.disturbances.faults] == [second, later]
    sim.run(5.0)
    assert sim.disturbances.faults == ()
    assert mass(sim) == before


def test_faults_end_after_an_object_was_spawned_meanwhile(sim):
    received = []
    sim.bus.subscribe("/odom", Odometry, received.append)
    sim.disturbances.schedule(LostCommands(0.5), at=0.0, duration=0.3)
    sim.disturbances.schedule(SilentTopic("odom"), at=0.0, duration=0.3)
    sim.run(0.1)
    sim.models.spawn_thing("box", x=1.0, size=(0.1, 0.1, 0.1))
    sim.run(0.1)
    assert (sim.commands.lost_share, received) == (0.5, [])
    sim.run(0.2)
    assert sim.commands.lost_share == 0.0
    assert received


@pytest.mark.parametrize("at", [0.0, 0.3])
def test_fault_of_a_deleted_robots_topic_has_no_effect(sim, kbot_robot, at):
    sim.models.spawn_model(kbot_robot, "b", x=1.0)
    sim.disturbances.schedule(SilentTopic("/b/odom"), at)
    sim.run(0.1)
    sim.models.delete_model("b")
    sim.run(0.3)
    assert list(sim.robots) == ["kbot"]
