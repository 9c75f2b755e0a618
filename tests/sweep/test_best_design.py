"""Tests that a design is written at the lines that define its values, also in included files."""

from pathlib import Path

import pytest
import trimesh

from kbot.sweep.best_design import WrittenDesign, chosen_design, written_design
from kbot.sweep.designs import Method
from kbot.sweep.plan import Plan
from kbot.sweep.results import Design
from kbot.sweep.space import Choices, Dimension, Space, Target, Value
from kbot.text import KbotError
from kbot.trials.scenario import RobotSource
from kbot.xacro import expand

ROBOT = """<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:arg name="mass" default="1.0"/>  <!-- kg -->
  <xacro:property name="gap" value="0.01"/>
  <xacro:include filename="parts/wheel.xacro"/>
  <link name="base" mass="$(arg mass)" gap="${gap}" radius="${radius}" half="${half}"/>
</robot>
"""
WHEEL = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:include filename="$(dirname)/sizes.xacro"/>
  <xacro:property name="half" value="${radius / 2}"/>
</robot>
"""
SIZES = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
  <!-- measured -->
  <xacro:property name="radius" value="0.035"/>
</robot>
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "parts").mkdir()
    (tmp_path / "r.xacro").write_text(ROBOT)
    (tmp_path / "parts/wheel.xacro").write_text(WHEEL)
    (tmp_path / "parts/sizes.xacro").write_text(SIZES)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def design(number: int = 3, **values: Value) -> Design:
    return Design(number, values, {"energy": 1.5}, ())


def written(
    path: str, robot: str = "r.xacro", *, given: dict[str, str] | None = None, **values: Value
) -> WrittenDesign:
    targets = {"mass": Target.ARGUMENT, "world": Target.WORLD, "seed": Target.SEED}
    dimensions = tuple(
        Dimension(name, str(value), Choices((value,)), targets.get(name, Target.PROPERTY))
        for name, value in values.items()
    )
    plan = Plan(RobotSource(robot, given or {}), Space(dimensions), (), (), Method.GRID, 1)
    return written_design(plan, design(**values), path)


def attributes(path: Path) -> dict[str, str]:
    document = expand(path).require().document
    assert document is not None
    return next(document.elements()).attributes


def test_the_robot_is_copied_with_the_values_of_the_design(folder: Path) -> None:
    found = written("best.xacro", mass=2.5, gap=0.02, world="rooms")
    assert found.elsewhere == ("world=rooms",)
    assert found.changes == (
        "mass: 1.0 → 2.5 (r.xacro:2)",
        "gap: 0.01 → 0.02 (r.xacro:3)",
    ) or found.changes == (
        "gap: 0.01 → 0.02 (r.xacro:3)",
        "mass: 1.0 → 2.5 (r.xacro:2)",
    )
    assert found.existing() == []
    found.write()
    assert (folder / "best.xacro").read_text() == ROBOT.replace('"1.0"', '"2.5"').replace('"0.01"', '"0.02"')
    assert (folder / "r.xacro").read_text() == ROBOT


def test_an_included_file_in_which_a_value_changes_is_copied_beside_it(folder: Path) -> None:
    found = written("best.xacro", radius=0.05)
    assert found.changes == ("radius: 0.035 → 0.05 (parts/sizes.xacro:3)",)
    found.write()
    assert (folder / "parts/best_sizes.xacro").read_text() == SIZES.replace("0.035", "0.05")
    assert (folder / "parts/best_wheel.xacro").read_text() == WHEEL.replace("sizes", "best_sizes")
    assert (folder / "best.xacro").read_text() == ROBOT.replace("parts/wheel", "parts/best_wheel")
    assert attributes(folder / "best.xacro")["half"] == "0.025"
    assert attributes(folder / "r.xacro")["half"] == "0.0175"
    assert sorted(written("best.xacro", radius=0.06).existing()) == [
        "best.xacro",
        "parts/best_sizes.xacro",
        "parts/best_wheel.xacro",
    ]


def test_the_files_of_the_robot_change_if_it_is_named(folder: Path) -> None:
    found = written("r.xacro", radius=0.05, half=0.04, mass=3)
    assert sorted(found.existing()) == ["parts/sizes.xacro", "parts/wheel.xacro", "r.xacro"]
    assert '-  <xacro:property name="radius" value="0.035"/>' in found.diff()
    assert '+  <xacro:property name="radius" value="0.05"/>' in found.diff()
    found.write()
    assert (folder / "parts/sizes.xacro").read_text() == SIZES.replace("0.035", "0.05")
    assert (folder / "parts/wheel.xacro").read_text() == WHEEL.replace("${radius / 2}", "0.04")
    assert attributes(folder / "r.xacro") == {
        "name": "base",
        "mass": "3.0",
        "gap": "0.01",
        "radius": "0.05",
        "half": "0.04",
    }


def test_values_of_the_command_line_are_part_of_the_design(folder: Path) -> None:
    found = written("best.xacro", given={"mass": "7", "prefix": "ignored"}, gap=0.02)
    assert len(found.changes) == 2
    found.write()
    assert attributes(folder / "best.xacro")["mass"] == "7"


def test_a_copy_in_another_folder_includes_the_same_files(folder: Path) -> None:
    (folder / "designs").mkdir()
    written("designs/best.xacro", radius=0.05).write()
    assert 'filename="../parts/best_wheel.xacro"' in (folder / "designs/best.xacro").read_text()
    assert attributes(folder / "designs/best.xacro")["half"] == "0.025"


def test_a_copy_that_would_be_another_robot_is_refused(folder: Path) -> None:
    file = folder / "r.xacro"
    file.write_text(ROBOT.replace('"${gap}"', "\"${xacro.load_yaml('gaps.yaml').side + gap}\""))
    (folder / "gaps.yaml").write_text("side: 1\n")
    with pytest.raises(KbotError, match="its folder does not exist"):
        written("designs/best.xacro", gap=0.02)
    (folder / "designs").mkdir()
    with pytest.raises(
        KbotError,
        match=r"best.xacro would not be the robot that was simulated: .*gaps.yaml.* Write it to the",
    ):
        written("designs/best.xacro", gap=0.02)


def test_a_copy_that_does_not_find_the_meshes_is_refused(folder: Path) -> None:
    """The file name is relative to the folder of the description, so both expansions are equal."""
    box = trimesh.creation.box((0.1, 0.1, 0.1))
    box.export(folder / "box.stl")
    mesh = '<collision><geometry><mesh filename="box.stl"/></geometry></collision>'
    link = f'<link name="base_link">{mesh}</link>'
    head = ROBOT[: ROBOT.index("  <link")]
    (folder / "r.xacro").write_text(f"{head}{link}</robot>")
    (folder / "designs").mkdir()
    with pytest.raises(KbotError) as raised:
        written("designs/best.xacro", gap=0.02)
    assert str(raised.value) == (
        "designs/best.xacro would not be the robot that was simulated: from its folder, it does not find "
        "box.stl. Write it to the folder ."
    )
    assert not list((folder / "designs").iterdir())
    box.export(folder / "designs" / "box.stl")  # another file, even if it is equal now
    with pytest.raises(KbotError, match=r"it does not find box\.stl"):
        written("designs/best.xacro", gap=0.02)
    written("best.xacro", gap=0.02).write()
    assert attributes(folder / "best.xacro") == {"name": "base_link"}


def test_a_copy_in_a_package_with_other_controllers_is_refused(folder: Path) -> None:
    """The files of controllers beside a description are found by its package."""
    robot = """<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:property name="gap" value="0.2"/>
  <link name="base_link"/>
  <link name="left"/><link name="right"/>
  <joint name="left_joint" type="continuous">
    <parent link="base_link"/><child link="left"/><origin xyz="0 ${gap} 0"/><axis xyz="0 1 0"/>
  </joint>
  <joint name="right_joint" type="continuous">
    <parent link="base_link"/><child link="right"/><origin xyz="0 ${-gap} 0"/><axis xyz="0 1 0"/>
  </joint>
  <gazebo><plugin name="c" filename="libgazebo_ros_control.so"/></gazebo>
</robot>
"""
    wheel = '<collision><geometry><sphere radius="0.05"/></geometry></collision>'
    for side in ("left", "right"):
        robot = robot.replace(f'<link name="{side}"/>', f'<link name="{side}">{wheel}</link>')
    (folder / "r.xacro").write_text(robot)
    package = folder / "other"
    (package / "config").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>other</name></package>")
    (package / "config" / "drive.yaml").write_text("a: 1\n")
    with pytest.raises(KbotError, match=r"simulated: from its folder, it also uses other/config/drive\.yaml"):
        written("other/best.xacro", gap=0.1)


def test_a_file_of_another_package_is_not_changed(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "work").mkdir()
    monkeypatch.chdir(folder / "work")
    with pytest.raises(
        KbotError, match=r"'radius' is defined in .*parts/sizes.xacro:3, outside the working dir"
    ):
        written("best.xacro", "../r.xacro", radius=0.05)


def test_the_shipped_robot_is_copied(folder: Path) -> None:
    found = written("best.xacro", "kbot", given={"wheel_radius": "0.04"})
    assert len(found.changes) == 1
    found.write()
    assert 'name="wheel_radius" default="0.04"' in (folder / "best.xacro").read_text()
    with pytest.raises(KbotError, match="outside the working directory"):
        written(found.files[0].source, "kbot", given={"wheel_radius": "0.04"})


def test_one_of_several_best_designs_must_be_chosen() -> None:
    two = [design(3, a=1), design(8, a=2)]
    assert chosen_design(two[:1], None) is two[0]
    assert chosen_design(two, 8) is two[1]
    with pytest.raises(
        KbotError,
        match=r"2 designs are best. Choose one with --design N: 3: a 1, energy 1.5; 8: a 2, energy 1.5",
    ):
        chosen_design(two, None)
    with pytest.raises(KbotError, match=r"design 4 is not one of the best. Choose one"):
        chosen_design(two, 4)
    with pytest.raises(KbotError, match="so none is written"):
        chosen_design([], None)
