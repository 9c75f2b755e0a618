"""Tests that a sweep notices each changed file on which its results depend."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from kbot.sweep.inputs import sampled_designs
from kbot.sweep.preparation import Request, prepare
from kbot.sweep.processes import Processes
from kbot.sweep.runner import opened_sweep
from kbot.sweep.space import parse_space
from kbot.text.notes import notes_sent_to
from kbot.trials.pool import Pool
from kbot.world.occupancy import OccupancyGrid
from kbot.world.occupancy_files import write_map

ROBOT = """\
<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
{head}
  <link name="base_link">
    <collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision>
    <inertial>
      <mass value="1"/>
      <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>
    </inertial>
  </link>
</robot>
"""
PART = """\
<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
  <link name="part"><visual><geometry><mesh filename="{mesh}"/></geometry></visual></link>
  <joint name="part_joint" type="fixed"><parent link="base_link"/><child link="part"/></joint>
</robot>
"""
TRIANGLE = """\
solid body
facet normal 0 0 1
outer loop
vertex 0 0 0
vertex 0.100 0 0
vertex 0 0.100 0
endloop
endfacet
endsolid body
"""
SDF = """\
<sdf version="1.7"><world name="w">{more}<model name="m"><static>true</static><link name="l">
<collision name="c"><geometry>{shape}</geometry></collision></link></model></world></sdf>
"""
BOX = "<box><size>1 1 1</size></box>"
WHEELS = """
  <link name="{side}_wheel">
    <collision>
      <origin rpy="1.5708 0 0"/><geometry><cylinder radius="0.05" length="0.02"/></geometry>
    </collision>
    <inertial>
      <mass value="0.1"/>
      <inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/>
    </inertial>
  </link>
  <joint name="{side}_wheel_joint" type="continuous">
    <parent link="base_link"/><child link="{side}_wheel"/><origin xyz="0 {y} 0"/><axis xyz="0 1 0"/>
  </joint>
"""


@pytest.fixture(autouse=True)
def folder(drive_folder: Path) -> Path:
    (drive_folder / "r.xacro").write_text(ROBOT.format(head=""))
    return drive_folder


def inputs(*dimensions: str, robot: str = "r.xacro") -> str:
    with Pool(1) as pool:
        return prepare(
            Request(robot=robot, dimensions=dimensions, scenarios=["drive.scenario.yaml"]), pool
        ).inputs


def is_noticed(change: Callable[[], object], *dimensions: str, robot: str = "r.xacro") -> bool:
    before = inputs(*dimensions, robot=robot)
    assert inputs(*dimensions, robot=robot) == before
    change()
    return inputs(*dimensions, robot=robot) != before


def edit(name: str, old: str, new: str) -> Callable[[], object]:
    def change() -> None:
        text = Path(name).read_text()
        assert old in text
        Path(name).write_text(text.replace(old, new))

    return change


def test_each_world_that_varies(folder: Path) -> None:
    (folder / "a.sdf").write_text(SDF.format(more="", shape=BOX))
    (folder / "b.sdf").write_text(SDF.format(more="", shape=BOX))
    assert is_noticed(edit("b.sdf", "1 1 1", "1 1 2"), "world=a.sdf,b.sdf")


def test_each_world_of_the_seeds_that_vary(folder: Path) -> None:
    for seed in (0, 1, 2, 3, 4):
        (folder / f"w{seed}.sdf").write_text(SDF.format(more="", shape=BOX))
    assert is_noticed(edit("w3.sdf", "1 1 1", "1 1 2"), "world=w{seed}.sdf", "seed=0:4")


def test_the_models_and_meshes_of_a_world(folder: Path) -> None:
    (folder / "m").mkdir()
    (folder / "body.stl").write_text(TRIANGLE)
    (folder / "m/model.sdf").write_text(
        f'<sdf version="1.7"><model name="i"><static>true</static><link name="l"><collision name="c">'
        f"<geometry>{BOX}</geometry></collision></link></model></sdf>"
    )
    shape = "<mesh><uri>body.stl</uri></mesh>"
    (folder / "a.sdf").write_text(SDF.format(more="<include><uri>m/model.sdf</uri></include>", shape=shape))
    assert is_noticed(edit("m/model.sdf", "1 1 1", "1 1 2"), "world=a.sdf")
    assert is_noticed(edit("body.stl", "0.100", "0.200"), "world=a.sdf")


def test_the_image_of_a_map(folder: Path) -> None:
    cells = np.zeros((20, 20), dtype=np.int8)
    write_map(OccupancyGrid(cells, 0.1), folder / "map.yaml", "pgm")

    def change() -> None:
        cells[0, 0] = 100
        write_map(OccupancyGrid(cells, 0.1), folder / "map.yaml", "pgm")

    assert is_noticed(change, "world=map.yaml")


def test_files_that_only_one_of_the_texts_includes_and_their_meshes(folder: Path) -> None:
    head = (
        '<xacro:arg name="part" default="small"/><xacro:arg name="side" default="left"/>'
        '<xacro:include filename="$(arg part)_$(arg side).xacro"/>'
    )
    (folder / "r.xacro").write_text(ROBOT.format(head=head))
    for part in ("small", "large"):
        for side in ("left", "right"):
            (folder / f"{part}_{side}.xacro").write_text(PART.format(mesh=f"{part}_{side}.stl"))
            (folder / f"{part}_{side}.stl").write_text(TRIANGLE)
    dimensions = ("part=small,large", "side=left,right")
    assert is_noticed(edit("large_right.xacro", "</robot>", "</robot>\n"), *dimensions)
    assert is_noticed(edit("large_right.stl", "0.100", "0.200"), *dimensions)


def test_a_file_that_only_the_last_number_includes(folder: Path) -> None:
    head = '<xacro:arg name="n" default="1"/><xacro:include filename="part$(arg n).xacro"/>'
    (folder / "r.xacro").write_text(ROBOT.format(head=head))
    for number in (1, 2):
        (folder / f"part{number}.xacro").write_text(PART.format(mesh="none.stl"))
    assert is_noticed(edit("part2.xacro", "</robot>", "</robot>\n"), "n=1,2")


def test_the_controllers_of_a_drive(folder: Path) -> None:
    (folder / "controllers.yaml").write_text("controller_manager:\n  ros__parameters: {update_rate: 100}\n")
    head = (
        '<gazebo><plugin filename="gz_ros2_control-system" name="x">'
        f"<parameters>{folder}/controllers.yaml</parameters></plugin></gazebo>"
    )
    (folder / "r.xacro").write_text(ROBOT.format(head=head))
    assert is_noticed(edit("controllers.yaml", "100", "50"), "seed=0,1")


def test_the_controllers_beside_the_description(folder: Path) -> None:
    package = folder / "bot_description"
    (package / "config").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>bot_description</name></package>")
    (package / "config/control.yaml").write_text(
        "drive:\n  type: diff_drive_controller/DiffDriveController\n"
        "  left_wheel: left_wheel_joint\n  right_wheel: right_wheel_joint\n  wheel_radius: 0.05\n"
    )
    head = WHEELS.format(side="left", y="0.1") + WHEELS.format(side="right", y="-0.1")
    head += '<gazebo><plugin filename="libgazebo_ros_control.so" name="x"/></gazebo>'
    (package / "bot.xacro").write_text(ROBOT.format(head=head))
    change = edit("bot_description/config/control.yaml", "0.05", "0.06")
    assert is_noticed(change, "seed=0,1", robot="bot_description/bot.xacro")


def test_a_script_that_varies(folder: Path) -> None:
    edit("drive.scenario.yaml", "command: {linear: 0.2}", "script: a.py")()
    for name in ("a.py", "b.py"):
        (folder / name).write_text("import kbot\n")
    key = f"scenario.steps.0.script={folder}/a.py,{folder}/b.py"
    assert is_noticed(edit("b.py", "kbot", "math"), key)


def test_a_file_that_changes_while_the_sweep_runs_is_reported() -> None:
    notes: list[str] = []
    change = edit("r.xacro", "</robot>", "</robot>\n")
    with Pool(1) as pool, notes_sent_to(notes.append):
        request = Request(robot="r.xacro", dimensions=["seed=0"], scenarios=["drive.scenario.yaml"])
        plan = prepare(request, pool)
        with opened_sweep(plan, "out") as sweep, Processes(pool) as executor:
            sweep.run(executor, change)
    assert [note for note in notes if "changed" in note] == [
        "r.xacro changed while the sweep ran: its rows may mix both versions. Run it again in another folder"
    ]
    assert Path("out/results.parquet").exists()


def test_few_robots_are_read_for_many_numbers_and_many_texts() -> None:
    space = parse_space([f"a{number}=0.0:1.0:1000" for number in range(4)])
    assert len(sampled_designs(space)) == 1 + 4 * 2
    texts = parse_space([f"a{number}={','.join(map('x{}'.format, range(100)))}" for number in range(4)])
    assert len(sampled_designs(texts)) == 1 + 4 * 99
