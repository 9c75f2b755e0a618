"""Every known fault of the chapter's package is reported at its line, and KBot has no findings."""

from __future__ import annotations

from pathlib import Path

import pytest

from kbot.checks import check_file, check_text
from kbot.checks.config import Config
from kbot.model.load import resolve_robot_path
from kbot.text import Diagnostic

PRINTED = Path("chapter/printed/kbot_description")
CORRECTED = Path("chapter/corrected/kbot_description")
CASTER_PROPERTIES = (
    '<xacro:property name="caster_wheel_radius" value="0.0175"/>\n'
    '<xacro:property name="caster_wheel_joint_offset" value="-0.06"/>\n'
)


def lines_of(diagnostic: Diagnostic) -> set[int]:
    """The lines of a finding, of its macro calls and of its related places."""
    if diagnostic.origin is None:
        return set()
    calls = {c.span.line for c in diagnostic.origin.stack if c.kind == "macro"}
    return {diagnostic.origin.span.line, *calls, *(r.origin.span.line for r in diagnostic.related)}


def line(text: str, words: str, after: str = "") -> int:
    at = text.index(words, text.index(after) if after else 0)
    return text[:at].count("\n") + 1


def expect(found: tuple[Diagnostic, ...], code: str, at: int, words: str) -> None:
    """Assert that a finding of a code at a line contains these words."""
    matches = [d for d in found if d.code == code and d.origin and d.origin.span.line == at]
    assert matches, f"no {code} at line {at}: " + "; ".join(map(str, found))
    assert any(words in d.message for d in matches), [d.message for d in matches]


@pytest.fixture(params=["printed", "corrected", "colored"])
def robot(request: pytest.FixtureRequest, shared: Path) -> tuple[str, tuple[Diagnostic, ...]]:
    """The chapter's robot with a corrected root element and with the properties that it lacks, and its
    findings: while there are errors, KBot does not judge the drive."""
    folder, name = {
        "printed": (PRINTED, "kbot.xacro"),
        "corrected": (CORRECTED, "kbot.xacro"),
        "colored": (CORRECTED, "kbot_colored.xacro"),
    }[request.param]
    path = shared / folder / "urdf" / name
    text = path.read_text("utf-8").replace("<robot>\n<xmlns:xacro=", "<robot xmlns:xacro=")
    if request.param == "printed":
        text = text.replace("<xacro:macro", CASTER_PROPERTIES + "<xacro:macro", 1)
    return text, check_text(text, str(path), config=Config())


def test_the_broken_root_is_reported_with_a_fix(shared: Path) -> None:
    found = check_file(str(shared / PRINTED / "urdf" / "kbot.xacro"), config=Config())
    assert [(d.code, d.origin.span.line if d.origin else 0) for d in found] == [("P001", 3)]
    assert found[0].fix is not None
    assert "xmlns:xacro" in found[0].hint


def test_every_undefined_property_is_found_in_one_run(shared: Path) -> None:
    path = shared / PRINTED / "urdf" / "kbot.xacro"
    text = path.read_text("utf-8").replace("<robot>\n<xmlns:xacro=", "<robot xmlns:xacro=")
    found = [d for d in check_text(text, str(path), config=Config()) if d.is_error]
    assert {d.code for d in found} == {"X103"}
    names = {d.message.split("'")[1]: d.origin.span.line for d in found if d.origin}
    assert names == {
        "caster_wheel_radius": line(text, 'radius="${caster_wheel_radius}'),
        "caster_wheel_joint_offset": line(text, "${caster_wheel_joint_offset}"),
    }


def test_rpy_on_an_axis_is_reported(robot: tuple[str, tuple[Diagnostic, ...]]) -> None:
    text, found = robot
    expect(found, "U202", line(text, "<axis", '<xacro:macro name="wheel"'), "'rpy'")
    expect(found, "U202", line(text, "<axis", '<joint name="caster'), "'rpy'")


def test_exchanged_height_and_depth_are_reported(robot: tuple[str, tuple[Diagnostic, ...]]) -> None:
    text, found = robot
    expect(found, "I112", line(text, '<xacro:box_inertia m="10"'), "iyy 0.04267 and izz 0.02142")


def test_the_wheels_inertia_that_is_not_turned_is_reported_at_the_macro(
    robot: tuple[str, tuple[Diagnostic, ...]],
) -> None:
    text, found = robot
    (finding,) = [d for d in found if d.code == "I111"]
    assert "0.003083" in finding.message
    assert "0.006125" in finding.message
    assert {
        line(text, "<inertia ", '<xacro:macro name="cylinder_inertia"'),
        line(text, '<xacro:cylinder_inertia m="10"'),
        line(text, '<xacro:wheel prefix="left"'),
        line(text, '<xacro:wheel prefix="right"'),
    } <= lines_of(finding)


def test_the_wrong_wheel_separation_is_reported(robot: tuple[str, tuple[Diagnostic, ...]]) -> None:
    text, found = robot
    at = line(text, 'name="wheel_separation"')
    expect(found, "S101", at, "never used")
    expect(found, "D105", at, "0.174 m")
    expect(found, "D105", at, "16 %")


def test_the_single_axis_caster_is_reported(robot: tuple[str, tuple[Diagnostic, ...]]) -> None:
    text, found = robot
    expect(found, "D118", line(text, "<axis", '<joint name="caster'), "scrubs")


@pytest.mark.parametrize(("radius", "words"), [("0.015", "5 mm above"), ("0.02", "5 mm below")])
def test_a_caster_of_the_wrong_radius_is_reported(shared: Path, radius: str, words: str) -> None:
    path = shared / CORRECTED / "urdf" / "kbot.xacro"
    text = path.read_text("utf-8")
    assert not [d for d in check_text(text, str(path), config=Config()) if d.code == "D112"]
    changed = text.replace('value="0.0175"', f'value="{radius}"')
    found = check_text(changed, str(path), config=Config())
    expect(found, "D112", line(text, "<origin", '<joint name="caster'), words)


def test_implausible_masses_are_reported(robot: tuple[str, tuple[Diagnostic, ...]]) -> None:
    text, found = robot
    expect(found, "I117", line(text, '<xacro:box_inertia m="20"'), "1 mm^3")
    expect(found, "I117", line(text, '<xacro:cylinder_inertia m="10"'), "66.2 times steel")


def test_the_inertia_of_the_root_is_reported(robot: tuple[str, tuple[Diagnostic, ...]]) -> None:
    text, found = robot
    expect(found, "I115", line(text, '<xacro:box_inertia m="20"'), "KDL")


def test_faults_of_the_footprint_are_reported(robot: tuple[str, tuple[Diagnostic, ...]]) -> None:
    text, found = robot
    expect(found, "D128", line(text, '<box size="0.001'), "0.5 mm below the ground")
    (off_axle,) = [d for d in found if d.code == "D124"]
    assert "20 mm behind" in off_axle.message
    assert line(text, "<origin", '<joint name="${prefix}_wheel_joint"') in lines_of(off_axle)


def test_wheels_without_a_drive_are_reported(robot: tuple[str, tuple[Diagnostic, ...]]) -> None:
    text, found = robot
    expect(found, "D125", line(text, '<joint name="${prefix}_wheel_joint"'), "no effort or velocity limit")


def test_faults_of_the_launch_files_are_reported(shared: Path) -> None:
    path = shared / PRINTED / "launch" / "kbot_base_rviz_gazebo.launch"
    text = path.read_text("utf-8")
    found = check_file(str(path), config=Config())
    expect(found, "L053", line(text, 'type="state_publisher"'), "robot_state_publisher")
    expect(found, "L056", line(text, "-verbose"), "-verbose")
    expect(found, "L057", line(text, "--inorder"), "--inorder")
    corrected = shared / CORRECTED / "launch" / "kbot_base_rviz.launch"
    found = check_file(str(corrected), config=Config())
    assert [d for d in found if d.origin is None or d.origin.span.file == str(corrected)] == []


@pytest.mark.parametrize("control", ["classic", "gz", "ros2_control", "none"])
def test_kbot_has_no_findings(control: str) -> None:
    arguments = {"control": control}
    found = check_file(resolve_robot_path("kbot"), arguments, config=Config())
    assert [d for d in found if control != "none" or d.code != "D125"] == []


def test_the_launch_files_of_kbot_have_no_findings() -> None:
    folder = Path(resolve_robot_path("kbot")).parents[1] / "launch"
    for file in sorted(folder.glob("*.launch")):
        assert check_file(str(file), config=Config()) == ()


def test_two_publishers_of_the_wheel_states_are_reported(tmp_path: Path) -> None:
    launch = tmp_path / "both.launch"
    launch.write_text(
        "<launch>\n"
        '<param name="robot_description" command="xacro $(find kbot_description)/urdf/kbot.xacro"/>\n'
        '<node name="states" pkg="joint_state_publisher" type="joint_state_publisher"/>\n'
        '<node name="spawn" pkg="gazebo_ros" type="spawn_model"'
        ' args="-urdf -param robot_description -model k"/>\n'
        "</launch>\n"
    )
    (found,) = check_file(str(launch), config=Config())
    assert (found.code, found.origin.span.line if found.origin else 0) == ("D122", 3)
    assert "publishWheelJointState" in found.related[0].origin.span.text
