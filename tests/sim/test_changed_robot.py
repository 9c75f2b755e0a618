"""A robot whose description changes while the world runs: the state of everything else is kept."""

import numpy as np
import pytest

import kbot
from kbot.kinematics.transform import Transform
from kbot.model import RobotModel
from kbot.sim import Simulation

BIGGER = {"base_len": 0.4, "base_width": 0.4}


def bigger() -> RobotModel:
    return kbot.load("kbot", arguments=BIGGER)


def test_objects_keep_their_poses_when_the_robot_changes() -> None:
    sim = Simulation("kbot")
    sim.models.spawn_thing("box", "crate", 0.25, 0.0, 0.0, 0.0, (0.1, 0.1, 0.1))
    sim.cmd_vel(0.3, 0.0)
    sim.run(2.0)
    pushed = sim.models.body_poses()["crate"]
    assert pushed.translation[0] > 0.3  # it was pushed
    before = sim.models.get_model_state("crate")
    other = sim.with_robot(kbot.load("kbot"))
    after = other.models.get_model_state("crate")
    assert after.pose.is_close(before.pose, 1e-12)
    assert after.linear == before.linear
    assert other.link_pose("base_footprint").is_close(sim.link_pose("base_footprint"), 1e-6)
    other.cmd_vel(0.3, 0.0)
    other.run(1.0)
    assert other.models.body_poses()["crate"].translation[0] > pushed.translation[0] + 0.1  # pushed further


def test_spawned_and_deleted_objects_survive_a_changed_robot() -> None:
    sim = Simulation("kbot", "boxes")
    sim.models.spawn_thing("box", "crate", 2.0, 2.0, 0.5, 0.0, (0.1, 0.1, 0.1))
    sim.models.delete_model("box_0")
    sim.run(1.0)
    other = sim.with_robot(bigger())
    names = {body.name for body in other.world.bodies}
    assert "crate" in names
    assert "box_0" not in names
    assert other.models.body_poses()["crate"].translation[2] < 0.1  # it has fallen to the floor


def test_tilted_robot_stays_tilted_when_it_changes() -> None:
    sim = Simulation("kbot", "ramp")
    sim.cmd_vel(0.3, 0.0)
    for _ in range(80):
        sim.run(0.1)
        if abs(sim.link_pose("base_footprint").rpy[1]) > 0.1:
            break
    sim.cmd_vel(0.0, 0.0)
    sim.run(0.3)
    before = sim.link_pose("base_footprint")
    assert abs(before.rpy[1]) > 0.1
    after = sim.with_robot(kbot.load("kbot")).link_pose("base_footprint")
    assert np.allclose(after.matrix, before.matrix, atol=1e-6)


def test_changed_robot_with_larger_wheels_is_on_the_same_ground() -> None:
    sim = Simulation("kbot")
    sim.cmd_vel(0.3, 0.5)
    sim.run(2.0)
    taller = kbot.load("kbot", wheel_radius=0.06)
    other = sim.with_robot(taller)
    assert np.allclose(
        other.link_pose("base_footprint").translation[:2], sim.link_pose("base_footprint").translation[:2]
    )
    start = Simulation(taller).link_pose("base_footprint").translation[2]
    assert other.link_pose("base_footprint").translation[2] == pytest.approx(start, abs=1e-3)
    other.run(0.5)
    assert np.abs(other.link_pose("base_footprint").rpy[:2]).max() < 0.05  # did not jump


def test_changed_robot_that_would_overlap_moves_to_its_start() -> None:
    sim = Simulation("kbot")
    sim.models.set_model_state(
        "kbot", sim.link_pose("base_footprint") @ Transform.from_xyz_rpy((1, 0, 0), (0, 0, 0))
    )
    sim.models.spawn_thing("box", "crate", 1.25, 0.0, 0.0, 0.0, (0.2, 0.2, 0.2))
    sim.run(0.2)
    assert sim.with_robot(kbot.load("kbot")).ground_truth.pose.x == pytest.approx(1.0, abs=0.01)
    other = sim.with_robot(bigger())
    assert other.ground_truth.pose.x == pytest.approx(0.0, abs=0.01)
    assert other.models.body_poses()["crate"].is_close(sim.models.body_poses()["crate"], 1e-12)


def test_attachments_survive_a_changed_robot() -> None:
    sim = Simulation("kbot")
    sim.models.spawn_thing("box", "crate", -0.4, 0.0, 0.0, 0.0, (0.1, 0.1, 0.1))
    sim.run(0.5)
    sim.models.attach("base_link", to="crate")
    sim.cmd_vel(0.2, 0.0)
    sim.run(2.0)
    other = sim.with_robot(bigger())
    assert other.models.attachments == 1
    between = other.link_pose("base_footprint").inverse() @ other.models.body_poses()["crate"]
    other.cmd_vel(0.2, 0.0)
    other.run(2.0)
    after = other.link_pose("base_footprint").inverse() @ other.models.body_poses()["crate"]
    pulled, left = (each.models.body_poses()["crate"].translation[0] for each in (other, sim))
    assert pulled > left + 0.2
    assert np.allclose(after.translation, between.translation, atol=5e-3)  # pulled along
    other.models.detach("base_link")  # can be detached


def test_attachment_to_a_removed_link_is_detached() -> None:
    sim = Simulation(kbot.load("kbot", lidar="true"))
    sim.models.spawn_thing("box", "crate", -0.4, 0.0, 0.0, 0.0, (0.1, 0.1, 0.1))
    sim.models.attach("lidar_link", to="crate")
    other = sim.with_robot(kbot.load("kbot"))
    assert (sim.models.attachments, other.models.attachments) == (1, 0)
    other.cmd_vel(0.2, 0.0)
    other.run(1.0)
    assert other.models.body_poses()["crate"].translation[0] == pytest.approx(-0.4, abs=1e-3)
