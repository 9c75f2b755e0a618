"""SDF models that are spawned into a running world."""

from pathlib import Path

import pytest

from kbot.kinematics.transform import Transform
from kbot.model import RobotModel
from kbot.sim import Simulation
from kbot.text import DescriptionError, KbotError

CRATE = """<?xml version="1.0"?><!-- a <b> --><sdf version="1.7"><model name="crate"><link name="l">
<inertial><mass>2</mass></inertial>
<collision name="c"><geometry><box><size>0.2 0.2 0.2</size></box></geometry></collision></link></model>
</sdf>"""
GATE = """<sdf version="1.7"><model name="gate"><pose>0.5 0 0 0 0 0</pose>
<link name="post"><pose>0 0 0.5 0 0 0</pose><inertial><mass>50</mass></inertial>
<collision name="c"><geometry><box><size>0.2 0.2 1</size></box></geometry></collision></link>
<link name="bar"><pose>0.4 0 0.8 0 0 0</pose><inertial><mass>0.5</mass></inertial>
<collision name="c"><geometry><box><size>0.5 0.05 0.05</size></box></geometry></collision></link>
<joint name="j" type="revolute"><parent>post</parent><child>bar</child><axis><xyz>0 0 1</xyz></axis></joint>
</model></sdf>"""

TWO = CRATE.replace("</sdf>", GATE[GATE.index("<model") :])
TWO_IN_A_WORLD = TWO.replace("<model", "<world name='w'><model", 1).replace("</sdf>", "</world></sdf>")
BARE = '<sdf version="1.7"><model name="m"/></sdf>'


@pytest.fixture
def sim(kbot_robot: RobotModel) -> Simulation:
    return Simulation(kbot_robot)


def at(x: float, y: float = 0.0, z: float = 0.0, yaw: float = 0.0) -> Transform:
    return Transform.from_xyz_rpy((x, y, z), (0.0, 0.0, yaw))


def test_sdf_model_has_the_given_pose_and_name(sim: Simulation) -> None:
    (body,) = sim.models.spawn_sdf(CRATE, "box_a", at(1.0, 2.0, 0.5))
    assert (body.name, body.mass) == ("box_a", 2.0)
    assert sim.models.body_poses()["box_a"].translation == pytest.approx((1.0, 2.0, 0.5))
    sim.run(1.0)
    assert sim.models.body_poses()["box_a"].translation[2] == pytest.approx(0.1, abs=2e-3)  # half its height
    sim.models.delete_model("box_a")
    assert "box_a" not in sim.models.body_poses()


def test_sdf_model_keeps_its_links_joints_and_own_pose(sim: Simulation) -> None:
    post, bar = sim.models.spawn_sdf(GATE, "g", at(1.0, 1.0, yaw=1.5707963267948966))
    assert (post.name, bar.name) == ("g", "g::bar")
    assert bar.joint is not None
    assert bar.joint.parent == "g"
    # a rotation by 90 degrees moves the model's own 0.5 m and the bar's 0.4 m to y
    assert sim.models.body_poses()["g"].translation == pytest.approx((1.0, 1.5, 0.5))
    assert sim.models.body_poses()["g::bar"].translation == pytest.approx((1.0, 1.9, 0.8))
    sim.models.delete_model("g")
    assert not sim.models.body_poses().keys() & {"g", "g::bar"}


def test_missing_part_of_a_model_is_reported(sim: Simulation) -> None:
    include = "<include><uri>model://far_away</uri></include></model>"
    sim.models.spawn_sdf(CRATE.replace("</model>", include), "own", at(2.0))
    assert [(d.code, d.is_error) for d in sim.diagnostics] == [("W202", False)]
    with pytest.raises(DescriptionError, match="model://far_away"):
        sim.models.spawn_sdf(CRATE.replace("</model>", include), "peer", is_confined=True)
    with pytest.raises(DescriptionError, match="model://far_away not found"):
        sim.models.spawn_sdf(f"<sdf version='1.7'><model name='none'>{include}</sdf>")


def test_impossible_inertia_of_a_model_of_a_peer_is_an_error(sim: Simulation) -> None:
    inertia = "<inertia><ixx>1</ixx><iyy>1</iyy><izz>9</izz></inertia></inertial>"
    sdf = CRATE.replace("</inertial>", inertia)
    sim.models.spawn_sdf(sdf, "own", at(2.0))
    assert [(d.code, d.is_error) for d in sim.diagnostics] == [("W104", False)]
    with pytest.raises(DescriptionError) as refused:
        sim.models.spawn_sdf(sdf, "peer", is_confined=True)
    (error,) = refused.value.diagnostics
    assert (error.code, error.is_error, "KBot" in str(error)) == ("W104", True, False)


def test_model_with_self_collision_is_one_model(sim: Simulation) -> None:
    gate = GATE.replace("<pose>0.5 0 0 0 0 0</pose>", "<self_collide>true</self_collide>", 1)
    bodies = sim.models.spawn_sdf(gate, "g", at(1.0, 1.0))
    assert [body.name for body in bodies] == ["g", "g::bar"]
    assert not any(body.model for body in bodies)  # bodies of one model would not collide with each other
    sim.models.delete_model("g")
    assert not sim.models.body_poses()


def test_world_file_with_one_model_is_spawned_as_that_model(sim: Simulation) -> None:
    world = CRATE.replace("<model", "<world name='w'><model", 1).replace("</model>", "</model></world>")
    (body,) = sim.models.spawn_sdf(world, "box", at(1.0))
    assert body.name == "box"


def test_model_is_read_from_a_file_or_a_folder(sim: Simulation, tmp_path: Path) -> None:
    (tmp_path / "model.sdf").write_text(CRATE)
    sim.models.spawn_sdf(str(tmp_path / "model.sdf"), "a", at(1.0))
    sim.models.spawn_sdf(str(tmp_path), None, at(2.0))
    assert {"a", "crate"} <= sim.models.body_poses().keys()


@pytest.mark.parametrize(
    ("sdf", "name", "place", "reported"),
    [
        (CRATE, "kbot", at(1.0), "the name 'kbot' is taken"),
        (CRATE, "a b", at(1.0), "not a valid object name"),
        (CRATE, "a", at(0.0), "'kbot' is in the way"),
        ('<sdf version="1.7"/>', "a", at(1.0), "contains no SDF world or model"),
        (TWO, "a", at(1.0), "2 models"),
        (TWO_IN_A_WORLD, "a", at(1.0), "2 models"),
        (BARE, "a", at(1.0), "the model in a.sdf has no link"),
        (BARE.replace("</sdf>", '<model name="b"/></sdf>'), "a", at(1.0), "2 models"),
        ('<sdf version="1.7"><world name="w"/></sdf>', "a", at(1.0), "contains no models"),
    ],
)
def test_rejected_sdf_model_changes_nothing(
    sim: Simulation, sdf: str, name: str, place: Transform, reported: str
) -> None:
    before = sim.state_sha256()
    with pytest.raises((KbotError, DescriptionError), match=reported):
        sim.models.spawn_sdf(sdf, name, place)
    assert sim.state_sha256() == before
    assert len(sim.world.bodies) == 1
