"""An error is reported alone: at its cause, at the line of the macro that has it, without what follows from
it. The faults are those of a learner who types the chapter's robot."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from kbot.checks import Config, check_file, check_text
from kbot.checks.fixes import fixed
from kbot.model.load import resolve_robot_path
from kbot.text import Diagnostic
from kbot.text.edits import apply_edits
from kbot.text.files import unsaved

SIZES = (("wheel_radius", "0.035"), ("caster_wheel_radius", "0.0175"))
CHAPTER = Path("chapter/corrected/kbot_description/urdf/kbot.xacro")


@pytest.fixture
def robot(shared: Path) -> str:
    return (shared / CHAPTER).read_text("utf-8")


def found_in(text: str) -> tuple[Diagnostic, ...]:
    return check_text(text, "kbot.xacro", config=Config())


def spoiled(text: str, old: str, new: str) -> tuple[str, tuple[Diagnostic, ...]]:
    """The text with a change, and its findings without the warnings that the text has anyway."""
    assert old in text
    changed = text.replace(old, new, 1)
    known = {(d.code, d.message) for d in found_in(text)}
    return changed, tuple(d for d in found_in(changed) if (d.code, d.message) not in known)


def line(text: str, words: str) -> int:
    return text[: text.index(words)].count("\n") + 1


@pytest.mark.parametrize(
    ("old", "new", "code", "message"),
    [
        ("base_wheel_gap)*reflect}", "base_wheel_gap))*reflect}", "X102", "one ')' too many"),
        ('ixx="${m*(3*r*r+h*h)/12}"', 'ixx="${m*(3*r*r+h*h))/12}"', "X102", "one ')' too many"),
        ('ixx="${m*(3*r*r+h*h)/12}"', 'ixx="${m*(3*r*r+h*h/12}"', "X102", "a '(' is not closed"),
        ('ixx="${m*(3*r*r+h*h)/12}"', 'ixx="${m(3*r*r+h*h)/12}"', "X104", "'m' is a number, not a function"),
    ],
)
def test_an_error_in_a_macro_is_one_finding_at_its_line(
    robot: str, old: str, new: str, code: str, message: str
) -> None:
    text, found = spoiled(robot, old, new)
    (error,) = found
    assert error.code == code
    assert message in error.message
    assert error.origin is not None
    assert error.origin.span.line == line(text, new)
    assert [call.kind for call in error.origin.stack][-1:] == ["macro"]


SHIPPED = Path(resolve_robot_path("kbot"))
EXPRESSIONS = [
    pytest.param(path, match, id=f"{path.name}:{path.read_text('utf-8')[: match.start()].count(chr(10)) + 1}")
    for path in sorted(SHIPPED.parent.glob("kbot*.xacro"))
    for match in re.finditer(r"\$\{[^}]*[-+*/][^}]*(?=\})", path.read_text("utf-8"))
]


@pytest.mark.parametrize(("path", "expression"), EXPRESSIONS)
def test_one_bracket_too_many_in_the_shipped_robot_is_one_finding(
    path: Path, expression: re.Match[str]
) -> None:
    text = path.read_text("utf-8")
    with unsaved({str(path): text[: expression.end()] + ")" + text[expression.end() :]}):
        found = check_file(str(SHIPPED), config=Config())
    assert [(d.code, d.is_error) for d in found] == [("X102", True)] * len(found)  # none in unused macros
    assert {d.origin.span.line for d in found if d.origin} <= {text[: expression.start()].count("\n") + 1}


def test_a_misspelt_attribute_is_one_error_with_its_fix() -> None:
    shape = '<visual><geometry><box sise="1 1 1"/></geometry></visual>'
    text = f'<robot name="r"><link name="a">{shape}</link></robot>'
    (error,) = (d for d in found_in(text) if d.code in {"U013", "U202"})
    assert (error.code, error.hint) == ("U013", "did you mean 'size'?")
    assert error.origin is not None
    assert error.origin.span.text == "sise"
    assert error.fix is not None
    assert apply_edits(text, error.fix.edits) == text.replace("sise", "size")


@pytest.mark.parametrize("attribute", ["radius", "name"])
def test_a_misspelt_attribute_in_a_macro_is_one_error(robot: str, attribute: str) -> None:
    old = {"radius": '<cylinder radius="', "name": '<link name="${prefix}_wheel"'}[attribute]
    new = old.replace(attribute, {"radius": "raduis", "name": "nmae"}[attribute])
    text, found = spoiled(robot, old, new)
    (error,) = (d for d in found if d.code in {"U013", "U015", "U202"})
    assert error.is_error
    assert error.fix is not None
    assert apply_edits(text, error.fix.edits).count(old) == robot.count(old)


def test_a_missing_call_has_no_consequences(robot: str) -> None:
    """The right wheel is missing: one error, and no finding about the drive, ground or unused names."""
    text = robot.replace('<xacro:wheel prefix="right"', '<xacro:whel prefix="right"')
    (error,) = [d for d in found_in(text) if d.is_error]
    assert error.code == "X121"
    assert not [d for d in found_in(text) if d.code[0] == "D" or d.code.startswith("S1")]


@pytest.mark.parametrize(
    ("old", "new", "message", "right"),
    [
        (
            'name="wheel_radius" value="0.035"',
            'name="wheel_radius" value="0,035"',
            "wheel_radius: '0,035' is text, not a number",
            'value="0.035"',
        ),
        (
            'name="caster_wheel_joint_offset" value="-0.06"',
            'name="caster_wheel_joint_offset" value="-6cm"',
            "caster_wheel_joint_offset: '-6cm' is text, not a number",
            'value="-0.06"',
        ),
        (
            'xyz="${caster_wheel_joint_offset} 0',
            'xyz="-${caster_wheel_joint_offset} 0',
            "caster_wheel_joint_offset is negative, so '-${caster_wheel_joint_offset}' has two minus signs",
            'xyz="${-caster_wheel_joint_offset} 0',
        ),
        ('d="0.01"', 'd="0,01"', "d: '0,01' is text, not a number", 'd="0.01"'),
        (
            '<box size="0.001 0.001 0.001" />',
            '<box size="0.001, 0.001, 0.001" />',
            "'size' of <box> has commas between its numbers",
            'size="0.001 0.001 0.001"',
        ),
        (
            'xyz="${caster_wheel_joint_offset} 0 -${',
            'xyz="${caster_wheel_joint_offset}, 0,-${',
            "'xyz' of <origin> needs 3 numbers, not 2",
            'xyz="${caster_wheel_joint_offset} 0 -${',
        ),
        (
            'xyz="0 0 ${wheel_radius + 0.005}"',
            'xyz="0 0 wheel_radius+0.005"',
            "'xyz' of <origin> is not a number: 'wheel_radius+0.005'",
            'xyz="0 0 ${wheel_radius+0.005}"',
        ),
        ('<mass value="${m}"/>', '<mass value="{m}"/>', "'value' of <mass> is not a number", 'value="${m}"'),
        (
            'name="wheel_joint_offset" value="0.02"',
            'name="wheel_joint_offset" value="wheel_radius/2"',
            "wheel_joint_offset: 'wheel_radius/2' is text, not a number",
            'value="${wheel_radius/2}"',
        ),
        (
            'name="caster_wheel_joint_offset" value="-0.06"',
            'name="caster_wheel_joint_offset" value="\N{MINUS SIGN}0.06"',
            "'\N{MINUS SIGN}' is not the minus sign of numbers",
            'value="-0.06"',
        ),
        (
            'name="wheel_joint_offset" value="0.02"',
            'name="wheel_joint_offset" value="${0,2*base_len}"',
            "wheel_joint_offset: '0,2*base_len' has several values: the comma separates them",
            'value="${0.2*base_len}"',
        ),
        (
            'name="sphere_inertia" params="m r"',
            'name="sphere_inertia" params="m,r"',
            "the parameters of the macro 'sphere_inertia' are separated by commas",
            'params="m r"',
        ),
        (
            '<xacro:property name="base_len"',
            '<property name="base_len"',
            "<property> is a tag of xacro without 'xacro:', so it has no effect",
            '<xacro:property name="base_len"',
        ),
    ],
)
def test_a_typing_mistake_is_one_error_with_a_safe_fix(
    robot: str, old: str, new: str, message: str, right: str
) -> None:
    text, found = spoiled(robot, old, new)
    (error,) = found
    assert error.is_error
    assert message in error.message
    assert error.origin is not None
    assert error.origin.span.line == line(text, new)
    assert error.fix is not None
    assert error.fix.safe
    assert right in apply_edits(text, error.fix.edits)
    assert not [d for d in found_in(fixed(text, "kbot.xacro", found_in, unsafe=False)[0]) if d.is_error]


@pytest.mark.parametrize("value", ["--0.0125", "1/0", "(0.05", "0.0.5", "1e", "5%", "nan", "inf", "-1e400"])
@pytest.mark.parametrize("property_", ["wheel_radius", "caster_wheel_radius"])
def test_a_malformed_number_is_one_error_at_its_property(robot: str, property_: str, value: str) -> None:
    written = f'name="{property_}" value="'
    text, found = spoiled(robot, written + dict(SIZES)[property_], written + value)
    (error,) = (d for d in found if d.is_error)
    assert error.message.startswith(f"{property_}: '{value}' is ")
    assert error.origin is not None
    assert error.origin.span.line == line(text, written)
    assert error.fix is None


@pytest.mark.parametrize("value", ["{n}", "m*n", "2*mass", "m and w", "m.x"])
def test_an_expression_with_unknown_names_has_no_suggestion(robot: str, value: str) -> None:
    _, found = spoiled(robot, '<mass value="${m}"/>', f'<mass value="{value}"/>')
    errors = [d for d in found if d.is_error]
    assert {(d.hint, d.fix) for d in errors} == {("", None)}


def test_a_macro_without_prefix_is_one_error(robot: str) -> None:
    start = robot.index('<xacro:macro name="wheel"')
    end = robot.index("</xacro:macro>", start)
    text = robot[:start] + "<" + robot[start + len("<xacro:") : end] + "</macro>" + robot[end + 14 :]
    (error,) = [d for d in found_in(text) if d.is_error]
    assert error.code == "S115"
    assert fixed(text, "kbot.xacro", found_in, unsafe=False)[0].count("xacro:macro") == robot.count(
        "xacro:macro"
    )


@pytest.mark.parametrize(
    ("property_", "metres", "millimetres"),
    [("base_width", "0.16", "160"), ("wheel_radius", "0.035", "35"), ("base_wheel_gap", "0.007", "7")],
)
def test_millimetres_are_recognized_at_the_property(
    robot: str, property_: str, metres: str, millimetres: str
) -> None:
    right, wrong = (f'name="{property_}" value="{value}"' for value in (metres, millimetres))
    text, found = spoiled(robot, right, wrong)
    (finding,) = found
    assert finding.code == "G113"
    assert finding.message == f"{property_}: {millimetres} m looks like millimetres"
    assert finding.hint == f"lengths are in metres: write {metres}"
    assert finding.fix is not None
    assert apply_edits(text, finding.fix.edits) == robot


@pytest.mark.parametrize(
    ("radius", "given", "message", "hint", "has_fix"),
    [
        ("50", {}, "r: 50 m looks like millimetres", "lengths are in metres: write 0.05", True),
        ("0.05", {"r": "50"}, "the given r: 50 m looks like millimetres", "write 0.05", False),
        ("${5*10}", {}, "'xyz' of <origin>: 50.04 m looks like millimetres", "lengths are in metres", False),
    ],
)
def test_only_a_written_length_has_a_suggestion(
    radius: str, given: dict[str, str], message: str, hint: str, has_fix: bool
) -> None:
    declared = f'<xacro:arg name="r" default="{radius}"/><xacro:property name="p" value="${{$(arg r)}}"/>'
    shape = '<visual><origin xyz="0 ${p + 0.04} 0"/><geometry><sphere radius="${p}"/></geometry></visual>'
    text = (
        f'<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">{declared}<link name="a">{shape}</link>'
        "</robot>"
    )
    found = check_text(text, "r.xacro", arguments=given, config=Config(select=("G113",)))
    first = found[0]
    assert first.message == message
    assert hint in first.hint
    assert [d.hint for d in found[1:]] == ["lengths are in metres"] * len(found[1:])
    assert bool(first.fix) == has_fix


def test_all_lengths_of_a_robot_in_millimetres_are_fixed(robot: str) -> None:
    text = robot
    for name, metres, millimetres in (
        ("base_width", "0.16", "160"),
        ("base_len", "0.16", "160"),
        ("wheel_radius", "0.035", "35"),
        ("wheel_joint_offset", "0.02", "20"),
        ("caster_wheel_radius", "0.0175", "17.5"),
        ("caster_wheel_joint_offset", "-0.06", "-60"),
    ):
        text = text.replace(f'name="{name}" value="{metres}"', f'name="{name}" value="{millimetres}"')

    def of_lengths(text: str) -> tuple[Diagnostic, ...]:
        return check_text(text, "kbot.xacro", config=Config(select=("G113",)))

    assert len(of_lengths(text)) == 6
    assert fixed(text, "kbot.xacro", of_lengths, unsafe=True)[0] == robot


def test_an_angle_of_90_from_a_property_is_taken_for_degrees(robot: str) -> None:
    turned = robot.replace('xyz="0 0 ${wheel_radius + 0.005}" rpy="0 0 0"', 'xyz="0 0 0.04" rpy="0 0 ${yaw}"')
    text = turned.replace("<xacro:macro", '<xacro:property name="yaw" value="90"/>\n<xacro:macro', 1)
    (finding,) = [d for d in found_in(text) if d.code == "J108"]
    assert "in degrees instead of radians?" in finding.message


def test_a_joint_that_is_defined_twice_is_not_a_second_parent(robot: str) -> None:
    _, found = spoiled(robot, 'prefix="right"', 'prefix="left"')
    assert sorted(d.code for d in found if d.is_error) == ["U004", "U005"]


def test_a_drive_wheel_on_a_fixed_joint_keeps_its_axis() -> None:
    macros = SHIPPED.with_name("kbot_macros.xacro")
    with unsaved({str(macros): macros.read_text("utf-8").replace("continuous", "fixed", 1)}):
        assert [d.code for d in check_file(str(SHIPPED), config=Config())] == ["D117"]


def test_a_material_of_an_included_file_that_is_not_well_formed_is_not_missing() -> None:
    macros = SHIPPED.with_name("kbot_macros.xacro")
    with unsaved({str(macros): macros.read_text("utf-8").replace('value="${m}"/>', 'value="${m}"/', 1)}):
        assert [d.code for d in check_file(str(SHIPPED), config=Config())] == ["P001"]


def test_names_of_links_follow_from_an_undefined_argument() -> None:
    """With the prefix unknown, the parent of `a` is unknown too."""
    text = (
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="base"/>'
        '<xacro:macro name="part" params="name parent"><link name="$(arg prefix)${name}"/>'
        '<joint name="${name}_joint" type="fixed"><parent link="$(arg prefix)${parent}"/>'
        '<child link="$(arg prefix)${name}"/></joint></xacro:macro>'
        '<xacro:part name="a" parent="base"/></robot>'
    )
    assert [d.code for d in found_in(text)] == ["X112"]


def test_an_argument_of_a_file_that_is_not_included_is_not_unused(tmp_path: Path) -> None:
    (tmp_path / "gazebo.xacro").write_text("<robot><gazebo><x>$(arg topic)</x></gazebo></robot>")
    text = (
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:arg name="topic" default="odom"/>'
        '<xacro:arg name="sim" default="false"/><xacro:if value="$(arg sim)">'
        '<xacro:include filename="gazebo.xacro"/></xacro:if><link name="base"/></robot>'
    )
    path = tmp_path / "robot.xacro"
    path.write_text(text)
    assert not check_file(str(path), config=Config(select=("S103",)))
    path.write_text(text.replace('<xacro:include filename="gazebo.xacro"/>', ""))
    assert [d.code for d in check_file(str(path), config=Config(select=("S103",)))] == ["S103"]
