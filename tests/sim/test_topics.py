"""The topics that a simulation publishes and subscribes to."""

from math import hypot

import pytest

from kbot.kinematics.frames import FrameTree
from kbot.messages import ClockMessage, JointState, Odometry, TFMessage, Twist, Vector3
from kbot.text import KbotError


def collect(sim, topic, kind):
    received = []
    sim.bus.subscribe(topic, kind, received.append)
    return received


def test_odometry_is_published_at_50_hz_with_matching_stamps(sim):
    odometry, joints, clock = collect(sim, "/odom", Odometry), collect(sim, "/joint_states", JointState), []
    sim.bus.subscribe("/clock", ClockMessage, clock.append)
    sim.cmd_vel(0.2, 0.0)
    sim.run(1.0)
    assert len(odometry) == len(joints) == len(clock) == 50
    for index in range(50):
        stamp = odometry[index].header.stamp
        assert stamp == joints[index].header.stamp == clock[index].clock
        assert stamp.nanoseconds == (index + 1) * 20_000_000
    last = odometry[-1]
    assert (last.header.frame_id, last.child_frame_id) == ("odom", "base_footprint")
    assert last.pose.pose.position.x == pytest.approx(sim.odometry.pose.x)
    assert last.twist.twist.linear.x == pytest.approx(0.2, rel=0.01)
    assert all(last.pose.covariance[i * 7] > 0.0 for i in range(6))


def test_joint_states_have_position_velocity_and_effort_of_every_joint(sim):
    joints = collect(sim, "/joint_states", JointState)
    sim.cmd_vel(0.2, 0.0)
    sim.run(2.0)
    message = joints[-1]
    assert message.name == ("left_wheel_joint", "right_wheel_joint")
    assert message.velocity == pytest.approx((0.2 / 0.035,) * 2, rel=1e-3)
    assert len(message.position) == len(message.effort) == 2


def test_transform_is_from_odom_to_the_root(sim):
    transforms = collect(sim, "/tf", TFMessage)
    sim.cmd_vel(0.2, 1.0)
    sim.run(1.0)
    transform = transforms[-1].transforms[0]
    assert (transform.header.frame_id, transform.child_frame_id) == ("odom", "base_footprint")
    pose = sim.odometry.pose
    assert (transform.transform.translation.x, transform.transform.translation.y) == pytest.approx(
        (pose.x, pose.y)
    )


def test_command_by_topic_times_out_after_half_a_second(sim):
    twist = Twist(Vector3(0.2, 0.0, 0.0), Vector3(0.0, 0.0, 0.0))
    sim.bus.publish("/cmd_vel", twist)
    sim.run(0.5)
    assert sim.robots.first.twist.x == pytest.approx(0.2)
    sim.run(1.0)
    assert sim.robots.first.twist.x == 0.0
    there = sim.ground_truth.pose
    sim.run(1.0)
    assert hypot(sim.ground_truth.pose.x - there.x, sim.ground_truth.pose.y - there.y) < 1e-6


def test_repeated_command_does_not_time_out(sim):
    for _ in range(20):
        sim.robots.first.command(0.2, 0.0)
        sim.run(0.1)
    assert sim.robots.first.twist.x == pytest.approx(0.2)


def test_command_in_python_does_not_time_out(sim):
    sim.cmd_vel(0.2, 0.0)
    sim.run(5.0)
    assert sim.robots.first.twist.x == pytest.approx(0.2)


def test_invalid_command_raises_in_the_publisher(sim):
    with pytest.raises(KbotError, match="finite"):
        sim.bus.publish("/cmd_vel", Twist(Vector3(float("nan"), 0.0, 0.0)))


def test_timers_are_called_at_their_times(sim):
    times = []
    sim.clock.every(100.0, lambda: times.append(sim.time))
    sim.run(0.1)
    assert times == pytest.approx([0.01 * (i + 1) for i in range(10)])


def test_joint_states_and_transforms_equal_those_of_the_topics(sim):
    received, tf = collect(sim, "/joint_states", JointState), collect(sim, "/tf", TFMessage)
    sim.cmd_vel(0.2, 0.5)
    sim.run(1.0)
    assert sim.joint_states == received[-1]
    reported = tf[-1].transforms[0]
    assert sim.transforms[reported.child_frame_id].translation == pytest.approx(
        (
            reported.transform.translation.x,
            reported.transform.translation.y,
            reported.transform.translation.z,
        ),
        abs=1e-12,
    )
    wheel = sim.transforms["base_footprint"].inverse() @ sim.transforms["left_wheel"]
    joints = sim.joint_positions
    assert wheel.is_close(FrameTree(sim.robot).pose("left_wheel", "base_footprint", joints), 1e-9)
