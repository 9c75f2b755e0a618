"""Models of a running world are moved, attached, paused and reset."""

from math import hypot

import numpy as np
import pytest

from kbot.kinematics.planar_pose import PlanarPose
from kbot.kinematics.transform import Transform
from kbot.messages.sensing import Bool
from kbot.sim import Simulation, SimulationDiverged
from kbot.sim.injected_faults import Kick
from kbot.text import KbotError
from kbot.world import Body, Box, Part, World
from kbot.world.builders import at, floor


@pytest.fixture
def yard(kbot_robot) -> Simulation:
    """A crate of 0.2 kg that touches the robot from behind, a static post, and a crate far away."""
    part = (Part(Box((0.1, 0.1, 0.1))),)
    crate = Body("crate", part, at(-0.3, 0.0, 0.05), mass=0.2)
    far = Body("far", part, at(3.0, 3.0, 0.05), mass=0.2)
    return Simulation(
        kbot_robot, world=World("yard", (floor(), crate, far, Body("post", part, at(0.0, 1.0, 0.05))))
    )


def test_attached_object_is_pulled_along_until_it_is_detached(yard):
    yard.models.attach("base_link", "crate")
    apart = yard.link_pose("base_link").inverse() @ yard.models.body_poses()["crate"]
    yard.cmd_vel(0.2, 0.3)
    yard.run(3.0)
    now = yard.link_pose("base_link").inverse() @ yard.models.body_poses()["crate"]
    assert np.abs(now.matrix - apart.matrix).max() < 1e-3
    yard.models.detach("base_link")
    left = yard.models.body_poses()["crate"].translation
    yard.run(1.0)
    assert np.abs(yard.models.body_poses()["crate"].translation - left).max() < 0.02
    assert yard.ground_truth.pose.x > left[0] + 0.2


def test_robot_attached_to_a_static_body_is_held(yard):
    yard.models.attach("base_link", "post")
    yard.cmd_vel(0.3, 0.0)
    yard.run(2.0)
    pose = yard.ground_truth.pose
    assert hypot(pose.x, pose.y) < 1e-3
    yard.models.detach("base_link")
    yard.run(1.0)
    assert yard.ground_truth.pose.x > 0.2


def test_a_robot_whose_topic_has_another_type_is_not_added(yard, kbot_robot):
    taken = yard.bus.advertise("/b/odom", Bool)
    topics, digest = yard.bus.topics, yard.state_sha256()
    with pytest.raises(KbotError, match="topic /b/odom carries Bool, not Odometry"):
        yard.models.spawn_model(kbot_robot, "b", x=-0.9)
    assert [*yard.robots] == [yard.robots.first.name]
    assert yard.bus.topics == topics
    assert yard.state_sha256() == digest
    taken.close()
    yard.cmd_vel(0.2, 0.0)
    yard.run(1.0)
    assert yard.models.spawn_model(kbot_robot, "b", x=-0.9).name == "b"


def test_one_robot_tows_another(yard, kbot_robot):
    yard.models.spawn_model(kbot_robot, "b", x=-0.6)
    yard.models.attach("base_link", "base_link", to_robot="b")
    with pytest.raises(KbotError, match="is attached to 'base_link' already"):
        yard.models.attach("base_link", "base_link", "b", "kbot")
    before = yard.robots["b"].ground_truth.pose.x
    yard.cmd_vel(0.1, 0.0)
    yard.robots["b"].cmd_vel(0.1, 0.0)
    yard.run(2.0)
    gap = yard.ground_truth.pose.x - yard.robots["b"].ground_truth.pose.x
    assert gap == pytest.approx(0.6, abs=1e-3)
    assert yard.robots["b"].ground_truth.pose.x > before + 0.15
    yard.models.delete_model("b")
    with pytest.raises(KbotError, match="not attached to anything"):
        yard.models.detach("base_link")


def test_attachments_survive_a_spawn_and_end_with_a_reset(yard, kbot_robot):
    yard.models.attach("base_link", "crate")
    yard.models.spawn_model(kbot_robot, "b", x=1.0, y=1.0)
    yard.cmd_vel(0.2, 0.0)
    yard.run(2.0)
    assert yard.models.body_poses()["crate"].translation[0] > 0.0
    yard.reset()
    with pytest.raises(KbotError, match="not attached to anything"):
        yard.models.detach("base_link")
    assert yard.models.body_poses()["crate"].translation[0] == pytest.approx(-0.3)


def test_saved_state_keeps_attachments(yard):
    yard.models.attach("base_link", "crate")
    yard.cmd_vel(0.2, 0.1)
    yard.run(0.5)
    saved = yard.state()
    yard.run(1.0)
    after = yard.state_sha256()
    yard.models.detach("base_link")
    yard.run(0.3)
    yard.restore(saved)
    yard.run(1.0)
    assert yard.state_sha256() == after


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("base_link", "crte"), "did you mean 'crate'"),
        (("base_lnk", "crate"), "did you mean 'base_link'"),
        (("base_link", "base_link"), "to itself"),
        (("base_link", "base_footprint"), "rigidly connected"),
        (("crate", "far", "kbot"), "has no link 'crate'"),
        (("post", "ground_plane"), "both static"),
    ],
)
def test_invalid_attachments_are_rejected(yard, arguments, message):
    before = yard.state_sha256()
    with pytest.raises(KbotError, match=message):
        yard.models.attach(*arguments)
    assert yard.state_sha256() == before


def test_thrown_object_follows_a_parabola(yard):
    """Thrown upwards at 2 m/s from 1 m, it is at 1 + 0.6 - 9.81 * 0.09 / 2 m after 0.3 s."""
    yard.run(5.0)  # the crates are asleep
    attitude = Transform.from_xyz_rpy((3.0, 3.0, 1.0), (0.1, 0.2, 0.3))
    yard.models.set_model_state("far", attitude, (0.5, 0.0, 2.0), (0.0, 0.0, 1.0))
    state = yard.models.get_model_state("far")
    assert state.pose.is_close(attitude)
    assert state.linear == pytest.approx((0.5, 0.0, 2.0))
    assert state.angular == pytest.approx((0.0, 0.0, 1.0))
    yard.run(0.3)
    pose = yard.models.get_model_state("far").pose
    assert pose.translation == pytest.approx((3.15, 3.0, 1.6 - 9.81 * 0.045), abs=4e-3)
    yard.run(5.0)
    assert yard.models.get_model_state("far").pose.translation[2] < 0.2


def test_robot_is_placed_in_the_air_in_any_attitude(yard):
    pose = Transform.from_xyz_rpy((1.0, -1.0, 0.5), (0.0, 0.3, 2.0))
    yard.models.set_model_state("kbot", pose)
    assert yard.link_pose("base_footprint").is_close(pose)
    assert yard.ground_truth.pose.yaw == pytest.approx(2.0, abs=0.1)
    assert yard.models.get_model_state("kbot").pose.is_close(pose)


@pytest.mark.parametrize(
    ("model", "message"),
    [("post", "static and cannot be moved"), ("crat", "did you mean 'crate'"), (3, "name")],
)
def test_unmovable_and_unknown_models_are_rejected(yard, model, message):
    with pytest.raises(KbotError, match=message):
        yard.models.set_model_state(model, Transform.identity())


def test_object_is_pushed_until_the_push_is_cleared(yard):
    yard.disturbances.apply_body_wrench("far", (5.0, 0.0, 0.0), 10.0)
    yard.run(0.3)
    assert yard.models.get_model_state("far").linear[0] > 0.5
    yard.disturbances.clear_body_wrenches("far")
    yard.run(2.0)
    assert yard.models.get_model_state("far").linear[0] == pytest.approx(0.0, abs=1e-6)
    with pytest.raises(KbotError, match="cannot be pushed"):
        yard.disturbances.apply_body_wrench("post", (5.0, 0.0, 0.0), 1.0)


def test_reset_world_keeps_the_time(yard):
    yard.cmd_vel(0.2, 0.0)
    yard.run(2.0)
    drawn = yard.state().random
    yard.snapshots.reset_world()
    assert yard.time == 2.0
    assert yard.ground_truth.pose.x == pytest.approx(0.0)
    assert yard.robots.first.twist.x == 0.0
    assert yard.state().random == drawn  # the random numbers are not restarted
    yard.run(1.0)
    assert yard.time == 3.0
    assert yard.ground_truth.pose.x == pytest.approx(0.0, abs=1e-6)


def test_reset_time_keeps_the_world(kbot_robot):
    """Acceleration, a push and the watchdog that are in progress end after the same remaining time."""
    plain, turned = Simulation(kbot_robot), Simulation(kbot_robot)
    for sim in (plain, turned):
        sim.cmd_vel(0.1, 0.0)
        sim.run(1.0)
        sim.robots.first.command(0.4, 0.2)
        sim.disturbances.apply_body_wrench("base_link", (0.5, 0.0, 0.0), 0.3)
        sim.run(0.1)
    turned.snapshots.reset_time()
    assert turned.time == 0.0
    for sim in (plain, turned):
        sim.run(1.0)
    assert turned.time == 1.0
    assert turned.ground_truth == plain.ground_truth
    assert turned.odometry == plain.odometry


def test_faults_start_again_after_reset_time(sim):
    sim.disturbances.schedule(Kick((0.0, 0.4, 0.0)), at=0.5)
    sim.run(1.0)
    first = sim.ground_truth.pose.y
    sim.snapshots.reset_time()
    sim.run(1.0)
    assert sim.ground_truth.pose.y == pytest.approx(2 * first, rel=0.01)


def test_pause_stops_only_loops_that_run_in_real_time(sim):
    sim.paused = True
    sim.step(5)
    assert sim.steps == 5


def test_divergence_of_a_robot_inside_a_wall_names_the_wall(kbot_robot):
    sim = Simulation(kbot_robot, world="corridor:width=0.8", start=PlanarPose(1.0, 0.4, 0.0))
    assert [d.code for d in sim.diagnostics] == ["W111"]
    with pytest.raises(SimulationDiverged, match="the robot started inside 'left_wall'"):
        sim.run(1.0)
