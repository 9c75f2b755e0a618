"""The robot KBot: the chapter's robot with correct physics, at any sensible size."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import kbot
from kbot.checks.facts.bodies import body_of
from kbot.kinematics import DifferentialDrive, FrameTree
from kbot.kinematics.bodies import center_of_mass, robot_bounds, total_mass
from kbot.kinematics.transform import Transform
from kbot.model import JointType, read_robot
from kbot.model.load import resolve_robot_path
from kbot.text import parse_xml, read_source

xacro = pytest.importorskip("xacro")

PACKAGE = Path(resolve_robot_path("kbot")).parents[1]
sizes = st.fixed_dictionaries(
    {},
    optional={
        "wheel_radius": st.floats(0.02, 0.1),
        "wheel_width": st.floats(0.003, 0.012),
        "base_width": st.floats(0.12, 0.5),
        "base_len": st.floats(0.12, 0.5),
        "base_height": st.floats(0.005, 0.03),
        "base_wheel_gap": st.floats(0.007, 0.05),
        "wheel_joint_offset": st.floats(0.01, 0.04),
    },
)


def test_names_and_sizes_are_those_of_the_chapter(shared):
    ours = kbot.load("kbot")
    chapter = read_robot(parse_xml(read_source(shared / "chapter/corrected/kbot.urdf"))).require()
    assert ours.name == "kbot"
    assert sorted(ours.links) == sorted(chapter.links)
    assert sorted(ours.joints) == sorted(chapter.joints)
    theirs = FrameTree(chapter)
    for link in ("base_link", "left_wheel", "right_wheel", "caster_wheel"):
        assert ours.pose(link, "left_wheel").is_close(theirs.pose(link, "left_wheel"), 1e-15)
        for mine, other in zip(ours.links[link].collisions, chapter.links[link].collisions, strict=True):
            named = {
                name: getattr(mine.geometry, name)
                for name in ("size", "radius", "length")
                if hasattr(mine.geometry, name)
            }
            assert all(getattr(other.geometry, name) == value for name, value in named.items())


def test_colours_are_those_of_the_chapter():
    robot = kbot.load("kbot")
    colors = {name: link.visuals[0].material.name for name, link in robot.links.items()}
    assert colors == {
        "base_footprint": "white",
        "base_link": "blue",
        "left_wheel": "black",
        "right_wheel": "black",
        "caster_wheel": "red",
    }
    assert robot.links["base_link"].visuals[0].material.rgba == (0, 0, 0.8, 1)


def test_the_mass_is_that_of_a_robot_of_this_size():
    robot = kbot.load("kbot")
    assert 1.0 < total_mass(robot) < 2.0
    assert robot.links["base_footprint"].inertial is None


@settings(max_examples=25, deadline=None)
@given(sizes)
def test_any_sensible_size_stands_on_the_ground_and_can_drive(arguments):
    robot = kbot.load("kbot", **arguments)
    size = {"wheel_radius": 0.035, "base_width": 0.16, "base_wheel_gap": 0.007, **arguments}
    drive = robot.drive
    assert isinstance(drive, DifferentialDrive)
    assert drive.base == "base_footprint"
    assert drive.radius == pytest.approx(size["wheel_radius"])
    assert drive.separation == pytest.approx(size["base_width"] + 2 * size["base_wheel_gap"])
    assert drive.casters == ("caster_wheel",)
    assert drive.axle_in_base.translation == pytest.approx([0, 0, size["wheel_radius"]], abs=1e-12)

    caster = robot.links["caster_wheel"].collisions[0].geometry
    center = robot.pose("caster_wheel").translation
    assert center[2] - caster.radius == pytest.approx(0, abs=1e-12)
    low, _ = robot_bounds(robot.frames)
    assert low[2] == pytest.approx(0, abs=1e-12)
    x, y, _ = center_of_mass(robot.frames)
    assert center[0] < x < 0
    assert y == pytest.approx(0, abs=1e-12)

    for link in robot.links.values():
        if link.inertial is None:
            continue
        solid = body_of(link).solid
        assert 500 < link.inertial.mass / solid.volume < 8000
        own = Transform.of(link.inertial.pose).rotation
        due = link.inertial.mass * np.array(solid.unit_tensor)
        assert own @ link.inertial.tensor @ own.T == pytest.approx(due)


def test_wheels_have_limits_and_the_caster_follows_a_turn():
    robot = kbot.load("kbot")
    for name in ("left_wheel_joint", "right_wheel_joint"):
        joint = robot.joints[name]
        assert joint.type is JointType.CONTINUOUS
        assert joint.axis == (0, 1, 0)
        assert joint.limit.velocity * 0.035 == pytest.approx(1.0)
        assert joint.limit.effort > 9.81 * total_mass(robot) * 0.035 * math.sin(math.radians(30))
        assert joint.dynamics is not None
    assert robot.joints["caster_wheel_joint"].type is JointType.FIXED
    friction = [e for e in robot.extensions if e.attributes.get("reference") == "caster_wheel"]
    assert [e.find("mu1").text for e in friction] == ["0.0"]


@pytest.mark.parametrize("control", ["classic", "gz", "none"])
def test_plugins_have_the_sizes_of_the_geometry(control):
    robot = kbot.load("kbot", control=control, wheel_radius=0.05)
    plugins = [p for e in robot.extensions for p in e.elements("plugin")]
    figures = {e.tag: e.text for p in plugins for e in p.elements()}
    if control == "classic":
        assert float(figures["wheelSeparation"]) == pytest.approx(robot.drive.separation)
        assert float(figures["wheelDiameter"]) == pytest.approx(2 * robot.drive.radius)
    elif control == "gz":
        assert float(figures["wheel_separation"]) == pytest.approx(robot.drive.separation)
        assert float(figures["wheel_radius"]) == pytest.approx(robot.drive.radius)
    else:
        assert not plugins


@pytest.mark.parametrize("arguments", [{}, {"wheel_radius": "0.05", "control": "gz"}, {"control": "none"}])
def test_the_official_xacro_expands_kbot_to_the_same_urdf(arguments):
    path = resolve_robot_path("kbot")
    official = xacro.process_file(path, mappings=dict(arguments)).toprettyxml(indent="  ")
    ours = kbot.load("kbot", **arguments).loaded.expansion.text
    assert ours.strip() == official.strip()


def test_the_sizes_in_the_controller_file_are_those_of_the_robot():
    yaml = pytest.importorskip("yaml")
    config = yaml.safe_load((PACKAGE / "config/kbot_controllers.yaml").read_text())
    figures = config["diff_drive_controller"]["ros__parameters"]
    drive = kbot.load("kbot").drive
    assert figures["wheel_separation"] == pytest.approx(drive.separation)
    assert figures["wheel_radius"] == pytest.approx(drive.radius)
    assert tuple(figures["left_wheel_names"] + figures["right_wheel_names"]) == drive.joints


def test_principal_moments_obey_the_triangle_inequality():
    for link in kbot.load("kbot").links.values():
        if link.inertial:
            a, b, c = np.sort(np.linalg.eigvalsh(link.inertial.tensor))
            assert a > 0
            assert a + b >= c


def test_an_unknown_control_is_an_error():
    with pytest.raises(kbot.DescriptionError, match="classic, gz, ros2_control or none, not gazebo"):
        kbot.load("kbot", control="gazebo")
