"""A world or a start without ground is reported at its line, and not as a fault of the robot."""

import json
from pathlib import Path

import numpy as np
import pytest

from kbot.cli.main import run
from kbot.kinematics.planar_pose import PlanarPose
from kbot.kinematics.transform import Transform
from kbot.sim import Simulation
from kbot.world.builders import box
from kbot.world.world import Body, HeightField, Part, Plane, World

BOX = "<geometry><box><size>4 4 0.1</size></box></geometry>"
PLANE = "<geometry><plane><normal>0 0 1</normal><size>1 1</size></plane></geometry>"


def model(inside, pose="0 0 -0.05 0 0 0", name="slab"):
    return (
        f'<model name="{name}"><static>true</static><pose>{pose}</pose>\n<link name="l">\n{inside}\n'
        "</link></model>\n"
    )


def sdf(tmp_path, content):
    file = tmp_path / "yard.world"
    file.write_text(f'<sdf version="1.6">\n<world name="yard">\n{content}</world></sdf>\n')
    return str(file)


def line_of(file, part):
    lines = Path(file).read_text().splitlines()
    return next(number for number, line in enumerate(lines, 1) if part in line)


def fallen(robot, world, **setup):
    simulation = Simulation(robot, world, **setup)
    simulation.cmd_vel(0.2, 0.0)
    simulation.run(2.0)
    return simulation


def only(findings, code="W115"):
    (found,) = (each for each in findings if each.code == code)
    return found


@pytest.mark.parametrize(
    "content",
    [
        "",
        model(f'<collision name="c">{BOX}</collision>', "5 5 0.5 0 0 0", "high crate"),
        model(f'<collision name="c">{BOX}</collision>', "0 0 2 0 0 0", "roof"),
    ],
)
def test_a_world_without_ground_is_reported_at_its_line(tmp_path, kbot_robot, content):
    world = sdf(tmp_path, content)
    simulation = fallen(kbot_robot, world)
    found = only(simulation.diagnostics)
    assert found.message == "the world 'yard' has no ground: robots fall"
    assert (found.origin.span.file, found.origin.span.line) == (world, line_of(world, "<world"))
    assert "ground_plane" in found.hint
    (falls,) = simulation.findings
    assert falls.code == "W304"
    assert falls.message.endswith("has no ground: robots fall (W115)")
    assert falls.origin == found.origin


@pytest.mark.parametrize("geometry", [BOX, PLANE])
def test_ground_that_is_only_drawn_is_reported_at_its_line(tmp_path, kbot_robot, geometry):
    pose = "0 0 -0.05 0 0 0" if geometry is BOX else "0 0 0 0 0 0"
    world = sdf(tmp_path, model(f'<visual name="v">{geometry}</visual>', pose))
    simulation = fallen(kbot_robot, world)
    found = only(simulation.diagnostics)
    assert found.message == "the ground 'slab' has a <visual> and no <collision>: robots fall through it"
    assert found.origin.span.line == line_of(world, "<visual")
    assert [each.code for each in simulation.findings] == ["W304"]


def test_the_plane_of_a_collision_is_infinite(tmp_path, kbot_robot):
    """sdformat's plane_shape.sdf: the size is meaningful only for a visual."""
    world = sdf(tmp_path, model(f'<collision name="c">{PLANE}</collision>', "0 0 0 0 0 0"))
    simulation = fallen(kbot_robot, world, start=PlanarPose(50.0, 0.0, 0.0))
    assert (simulation.diagnostics, simulation.findings) == ((), ())


def test_a_ground_that_was_not_found_is_named(tmp_path, kbot_robot):
    world = sdf(tmp_path, "<include><uri>model://my_ground</uri></include>\n")
    found = only(Simulation(kbot_robot, world).diagnostics)
    assert "W202" in found.hint
    assert [each.origin.span.line for each in found.related] == [line_of(world, "my_ground")]


def test_a_start_beside_the_ground_names_the_nearest_ground(tmp_path, kbot_robot):
    slabs = "".join(
        model(f'<collision name="c">{BOX}</collision>', f"{x} 0 -0.05 0 0 0", f"slab_{x}") for x in (5, 30)
    )
    world = sdf(tmp_path, slabs)
    simulation = fallen(kbot_robot, world)
    found = only(simulation.diagnostics)
    assert found.message.endswith("starts at 0, 0, beside the ground: the nearest is 'slab_5' around 5, 0")
    assert "--pose" in found.hint
    assert [each.code for each in simulation.findings] == ["W304"]
    assert Simulation(kbot_robot, world, start=PlanarPose(5.0, 0.0, 0.0)).diagnostics == ()


def test_a_start_on_an_edge_and_beside_terrain_is_reported(kbot_robot):
    table = World("table", (box("slab", (2.0, 2.0, 0.1), 0.0, 0.0, -0.05, ground=True),))
    edge = Simulation(kbot_robot, table, start=PlanarPose(1.05, 0.0, 0.0))
    assert "on the edge of the ground" in only(edge.diagnostics).message
    hills = HeightField(np.zeros((8, 8)), (4.0, 4.0))
    terrain = World("terrain", (Body("hills", (Part(hills, ground=True),)),))
    assert Simulation(kbot_robot, terrain).diagnostics == ()
    beside = Simulation(kbot_robot, terrain, start=PlanarPose(9.0, 0.0, 0.0))
    assert "beside the ground: the nearest is 'hills' around 0, 0" in only(beside.diagnostics).message


@pytest.mark.parametrize(("height", "reported"), [(-1.0, "1 m above"), (0.5, "0.5 m below")])
def test_a_start_far_above_or_below_the_ground_is_reported(kbot_robot, height, reported):
    low = Body("floor", (Part(Plane(), Transform.from_xyz_rpy((0, 0, height), (0, 0, 0)), ground=True),))
    found = only(Simulation(kbot_robot, World("low", (low,))).diagnostics)
    assert f"starts {reported} the" in found.message


@pytest.mark.parametrize(
    "floor", ["", model(f'<collision name="p">{PLANE}</collision>', "0 0 0 0 0 0", "floor")]
)
def test_a_start_in_a_flat_box_is_reported_at_its_line(tmp_path, kbot_robot, floor):
    """The contact throws the robot out: the box reaches 50 mm above z = 0, where robots start."""
    world = sdf(tmp_path, floor + model(f'<collision name="c">{BOX}</collision>', "0 0 0 0 0 0"))
    simulation = fallen(kbot_robot, world)
    found = only(simulation.diagnostics)
    assert "W304" not in [each.code for each in simulation.findings]
    assert found.message == "robot 'kbot' starts 0.05 m below the surface of the ground 'slab'"
    assert found.origin.span.line == line_of(world, 'name="c"')


def test_a_fall_onto_the_ground_is_not_the_robot_s_fault(kbot_robot):
    """A metre takes 0.45 s."""
    low = Body("floor", (Part(Plane(), Transform.from_xyz_rpy((0, 0, -1), (0, 0, 0)), ground=True),))
    simulation = fallen(kbot_robot, World("low", (low,)))
    assert "W309" not in [each.code for each in simulation.findings]
    for found in simulation.findings:
        assert "it was in the air from 0.0 s on" in found.message
        assert found.origin is None


@pytest.mark.parametrize(
    "world",
    ["empty", "boxes", "maze", "rooms", "corridor", "ramp:angle=30", "incline:angle=20", "stairs", "track"],
)
def test_built_in_worlds_have_ground(kbot_robot, world):
    assert "W115" not in [each.code for each in Simulation(kbot_robot, world).diagnostics]


def test_no_ground_is_needed_without_gravity_or_on_a_pole(urdf, kbot_robot):
    assert Simulation(kbot_robot, World("space", (), (0.0, 0.0, 0.0))).diagnostics == ()
    shape = '<collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision>'
    inertia = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    arm = (
        '<robot name="arm"><link name="world"/><joint name="j" type="fixed"><parent link="world"/>'
        f'<child link="arm"/></joint><link name="arm"><inertial><mass value="1"/>{inertia}</inertial>'
        f"{shape}</link></robot>"
    )
    assert Simulation(urdf(arm), World("space", ())).diagnostics == ()


def test_a_robot_that_is_spawned_or_placed_beside_the_ground_is_reported(kbot_robot):
    table = World("table", (box("slab", (2.0, 2.0, 0.1), 0.0, 0.0, -0.05, ground=True),))
    simulation = Simulation(kbot_robot, table)
    simulation.models.spawn_model(kbot_robot, "second", 8.0)
    assert "robot 'second' starts at 8, 0, beside the ground" in only(simulation.diagnostics).message
    simulation.models.set_pose(4.0, 0.0, 0.0)
    simulation.cmd_vel(0.2, 0.0)
    simulation.run(2.0)
    (found,) = simulation.findings
    assert found.message.endswith("there is no ground below the place where it was put")


def test_a_robot_that_drives_off_the_ground_is_not_blamed(kbot_robot):
    """KBot is 1 m from the edge, which takes 5 s at 0.2 m/s."""
    table = World("table", (box("slab", (2.0, 2.0, 0.1), 0.0, 0.0, -0.05, ground=True),))
    simulation = Simulation(kbot_robot, table)
    simulation.cmd_vel(0.2, 0.0)
    simulation.run(8.0)
    found = only(simulation.findings, "W304")
    assert "it left the ground at 5." in found.message
    assert all(each.severity.name == "INFO" for each in simulation.findings)


def test_the_world_s_fault_is_in_the_reports(tmp_path, capsys):
    world = sdf(tmp_path, "")
    words = ["sim", "kbot", "--world", world, "--headless", "--duration", "2", "--json"]
    assert run(words) == 0
    printed = capsys.readouterr()
    assert f"{world}:2:1: warning: the world 'yard' has no ground" in printed.err
    (found,) = json.loads(printed.out)["findings"]
    assert (found["code"], found["file"], found["line"]) == ("W304", world, 2)
