"""Robots that are spawned, deleted and pushed and that collide, without disturbing the rest of the world."""

from math import hypot

import pytest

from kbot.messages import Odometry, TFMessage, Twist, Vector3
from kbot.model.load import load_robot
from kbot.sim import Simulation
from kbot.text import KbotError


def test_two_robots_drive_independently(sim, kbot_robot):
    other = sim.models.spawn_model(kbot_robot, "b", x=1.0, y=0.5, yaw=1.0)
    assert list(sim.robots) == ["kbot", "b"]
    start = other.ground_truth.pose
    assert (start.x, start.y, start.yaw) == pytest.approx((1.0, 0.5, 1.0))
    sim.cmd_vel(0.2, 0.0)
    other.cmd_vel(0.0, 1.0)
    sim.run(2.0)
    assert sim.ground_truth.pose.x == pytest.approx(0.4 - 0.02, abs=0.01)
    assert other.ground_truth.pose.yaw == pytest.approx(1.0 + 2.0 - 0.0625, abs=0.05)
    assert hypot(other.ground_truth.pose.x - 1.0, other.ground_truth.pose.y - 0.5) < 1e-4
    assert other.odometry.pose.yaw == pytest.approx(other.ground_truth.pose.yaw - 1.0, abs=1e-4)


def test_spawning_a_robot_does_not_disturb_a_driving_one(kbot_robot):
    """The driving robot keeps its pose, velocity, wheel angles, command and odometry."""
    alone, joined = Simulation(kbot_robot), Simulation(kbot_robot)
    for sim in (alone, joined):
        sim.cmd_vel(0.2, 0.3)
        sim.run(1.01)
    joined.models.spawn_model(kbot_robot, "b", x=2.0)
    joined.models.spawn_model(kbot_robot, "c", x=-2.0)
    joined.run(1.0)
    joined.models.delete_model("b")
    joined.run(1.0)
    alone.run(2.0)
    for a, b in ((alone.ground_truth, joined.ground_truth), (alone.odometry, joined.odometry)):
        assert (a.pose.x, a.pose.y, a.pose.yaw) == pytest.approx((b.pose.x, b.pose.y, b.pose.yaw), abs=1e-6)
    assert joined.robots.first.body.joint_velocities == pytest.approx(
        alone.robots.first.body.joint_velocities, rel=1e-6
    )
    assert list(joined.robots) == ["kbot", "c"]


def test_robots_collide_with_each_other(sim, kbot_robot):
    other = sim.models.spawn_model(kbot_robot, "b", x=0.5)
    sim.cmd_vel(0.3, 0.0)
    sim.run(3.0)
    assert other.ground_truth.pose.x > 0.501
    assert sim.ground_truth.pose.x < other.ground_truth.pose.x - 0.1
    assert sim.link_pose("base_link").translation[2] == pytest.approx(0.04, abs=2e-3)


def test_topics_and_frames_are_in_the_namespace(sim, kbot_robot):
    sim.models.spawn_model(kbot_robot, "b", x=1.0)
    odometry, frames = [], []
    sim.bus.subscribe("/b/odom", Odometry, odometry.append)
    sim.bus.subscribe("/tf", TFMessage, lambda m: frames.extend(t.child_frame_id for t in m.transforms))
    sim.bus.publish("/b/cmd_vel", Twist(Vector3(0.2, 0.0, 0.0)))
    sim.run(0.4)
    assert odometry[-1].twist.twist.linear.x > 0.1
    assert odometry[-1].child_frame_id == "b/base_footprint"
    assert set(frames) == {"base_footprint", "b/base_footprint"}
    assert sim.ground_truth.pose.x == pytest.approx(0.0, abs=1e-6)
    sim.models.delete_model("b")
    count = len(odometry)
    sim.run(0.1)
    assert len(odometry) == count
    # the topic /b/odom still exists for its subscriber
    assert [topic for topic in sim.bus.topics if topic.startswith("/b/")] == ["/b/odom"]


def test_runs_with_several_robots_are_equal(kbot_robot):
    digests = []
    for _ in range(2):
        sim = Simulation(kbot_robot)
        for index in range(5):
            robot = sim.models.spawn_model(kbot_robot, f"r{index}", x=0.5 * (index + 1))
            robot.cmd_vel(0.1, 0.2 * index)
        sim.run(0.5)
        saved = sim.state()
        sim.run(0.5)
        digests.append(sim.state_sha256())
        sim.restore(saved)
        sim.run(0.5)
        digests.append(sim.state_sha256())
    assert len(set(digests)) == 1


def test_reset_returns_every_robot_to_its_start(sim, kbot_robot):
    other = sim.models.spawn_model(kbot_robot, "b", x=1.0)
    other.cmd_vel(0.2, 0.0)
    sim.run(1.0)
    sim.reset()
    assert other.ground_truth.pose.x == pytest.approx(1.0)
    assert other.odometry.pose.x == 0.0
    sim.run(1.0)
    assert other.ground_truth.pose.x == pytest.approx(1.0, abs=1e-6)


def test_other_robots_survive_a_changed_robot(sim, kbot_robot):
    sim.models.spawn_model(kbot_robot, "b", x=1.0).cmd_vel(0.1, 0.0)
    sim.run(1.0)
    other = sim.with_robot(load_robot("kbot", {"wheel_radius": "0.04"}).require())
    assert list(other.robots) == ["kbot", "b"]
    before = other.robots["b"].ground_truth.pose.x
    assert before == pytest.approx(sim.robots["b"].ground_truth.pose.x)
    other.run(1.0)
    assert other.robots["b"].ground_truth.pose.x > before + 0.08


@pytest.mark.parametrize(
    ("name", "x", "message"),
    [
        ("kbot", 1.0, "the robot name 'kbot' is taken"),
        ("a/b", 1.0, "is not a valid robot name"),
        ("b", float("nan"), "finite"),
        ("b", 1e400, "finite"),
        ("b", 0.0, "it would overlap 'kbot/"),
    ],
)
def test_rejected_robot_leaves_the_world_unchanged(sim, kbot_robot, name, x, message):
    sim.cmd_vel(0.2, 0.0)
    sim.run(0.1)
    before = sim.state_sha256()
    with pytest.raises(KbotError, match=message):
        sim.models.spawn_model(kbot_robot, name, x=x)
    assert sim.state_sha256() == before
    sim.reset()
    assert list(sim.robots) == ["kbot"]


def test_robot_is_not_spawned_inside_a_wall(kbot_robot):
    sim = Simulation(kbot_robot, world="corridor:width=0.8")
    with pytest.raises(KbotError, match="overlap 'left_wall'"):
        sim.models.spawn_model(kbot_robot, "b", x=1.0, y=0.4)


def test_first_robot_and_unknown_robots_cannot_be_deleted(sim):
    with pytest.raises(KbotError, match="cannot be deleted"):
        sim.models.delete_model("kbot")
    with pytest.raises(KbotError, match="did you mean 'kbot'"):
        sim.models.delete_model("kbt")


def test_push_gives_its_impulse(urdf):
    """Without ground and friction, 2 N for 0.5 s accelerate 1 kg to 1 m/s."""
    inertia = '<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/>'
    link = f'<link name="base"><inertial><mass value="1"/>{inertia}</inertial></link>'
    sim = Simulation(urdf(f'<robot name="r">{link}</robot>'))
    sim.disturbances.apply_body_wrench("base", (2.0, 0.0, 0.0), 0.5, torque=(0.0, 0.0, 0.02))
    sim.run(1.0)
    twist = sim.robots["r"].body.link_velocity("base")
    assert twist[0][2] == pytest.approx(0.02 * 0.5 / 0.1, rel=1e-6)
    assert hypot(twist[1][0], twist[1][1]) == pytest.approx(1.0, rel=1e-6)


def test_push_is_part_of_the_state(sim):
    sim.disturbances.apply_body_wrench("base_link", (1.0, 0.5, 0.0), 0.3)
    sim.run(0.1)
    saved = sim.state()
    sim.run(0.5)
    after = sim.state_sha256()
    sim.restore(saved)
    sim.run(0.5)
    assert sim.state_sha256() == after


def test_kick_moves_the_robot_without_tipping_it(sim):
    sim.run(0.1)
    sim.models.set_twist((0.0, 0.5, 0.0))
    assert sim.ground_truth.twist.y == pytest.approx(0.5)
    sim.run(2.0)
    assert 0.005 < sim.ground_truth.pose.y < 0.2
    assert abs(sim.link_pose("base_link").rpy[0]) < 0.01


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("base_lnk", (1.0, 0.0, 0.0), 1.0), "did you mean 'base_link'"),
        (("base_link", (float("nan"), 0.0, 0.0), 1.0), "finite"),
        (("base_link", (1.0, 0.0, 0.0), 0.0), "above 0"),
        (("base_link", (1.0, 0.0, 0.0), float("inf")), "finite"),
    ],
)
def test_invalid_push_is_rejected(sim, arguments, message):
    before = sim.state_sha256()
    with pytest.raises(KbotError, match=message):
        sim.disturbances.apply_body_wrench(*arguments)
    assert sim.state_sha256() == before


def test_sleeping_bodies_are_restored(kbot_robot):
    """The engine puts resting crates to sleep. A restored run still continues bit for bit."""
    from kbot.world import Body, Box, Part, World
    from kbot.world.builders import at, floor

    crates = [
        Body(f"c{i}", (Part(Box((0.1, 0.1, 0.1))),), at(0.5 + 0.2 * i, 0, 0.05), mass=0.1) for i in range(5)
    ]
    sim = Simulation(kbot_robot, world=World("yard", (floor(), *crates)))
    sim.run(4.0)
    saved = sim.state()
    assert (sim.engine.data.tree_asleep >= 0).any()
    digests = []
    for _ in range(2):
        sim.cmd_vel(0.3, 0.0)
        sim.run(3.0)
        digests.append(sim.state_sha256())
        sim.restore(saved)
    assert digests[0] == digests[1]
    sim.cmd_vel(0.3, 0.0)
    sim.run(3.0)
    assert sim.models.body_poses()["c0"].translation[0] > 0.6


def test_robot_starts_at_a_given_pose(kbot_robot):
    """Ground truth is in the world, odometry is relative to the start. A reset returns to the start."""
    from kbot.kinematics.planar_pose import PlanarPose

    sim = Simulation(kbot_robot, start=PlanarPose(2.0, -1.0, 1.5))
    sim.cmd_vel(0.2, 0.0)
    sim.run(1.0)
    sim.reset()
    truth, odometry = sim.ground_truth.pose, sim.odometry.pose
    assert (truth.x, truth.y, truth.yaw) == pytest.approx((2.0, -1.0, 1.5))
    assert (odometry.x, odometry.y, odometry.yaw) == (0.0, 0.0, 0.0)
