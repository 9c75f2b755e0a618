"""Faults that are put into KBot, a package of three files with macros, are reported at their lines."""
# ruff: noqa: E501 - the replaced lines are quoted unchanged

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from kbot.checks import check_file
from kbot.checks.config import Config
from kbot.checks.fixes import fixed_includes
from kbot.model.load import resolve_robot_path
from kbot.text import Diagnostic
from kbot.text.edits import apply_edits

MAIN, MACROS, CONTROL = "kbot.xacro", "kbot_macros.xacro", "kbot_control.xacro"
WHEEL = '<xacro:cylinder_inertia m="${wheel_mass}" r="${wheel_radius}" h="${wheel_width}" rpy="${pi/2} 0 0"/>'
BASE = '<xacro:box_inertia m="${base_mass}" w="${base_len}" h="${base_height}" d="${base_width}"/>'
CASTER = (
    '<origin xyz="${caster_wheel_joint_offset} 0 ${-(caster_wheel_radius + base_height/2)}" rpy="0 0 0"/>'
)

MUTANTS = [
    ("height and depth exchanged", MAIN, BASE, BASE.replace('h="${base_height}" d="${base_width}"', 'h="${base_width}" d="${base_height}"'), "I112", MAIN, BASE[:30]),
    ("base too heavy", MAIN, 'm="${base_mass}"', 'm="90"', "I117", MAIN, 'm="90"'),
    ("wheels too heavy", MAIN, "${2600*pi", "${260000*pi", "I117", MACROS, "<xacro:cylinder_inertia m="),
    ("caster mount too high", MAIN, CASTER, CASTER.replace("base_height/2", "base_height/2 - 0.005"), "D112", MAIN, "${caster_wheel_joint_offset} 0"),
    ("caster ball too large", MAIN, 'value="${wheel_radius/2}"', 'value="${wheel_radius/2 + 0.003}"', "D112", MAIN, "${caster_wheel_joint_offset} 0"),
    ("footprint too low", MAIN, "${wheel_radius + base_height/2}", "${2*wheel_radius + base_height/2}", "D113", MAIN, "${-wheel_joint_offset} 0"),
    ("footprint off the axle", MAIN, "${-wheel_joint_offset} 0", "0 0", "D124", MACROS, "<origin xyz=\"${wheel_joint_offset}"),
    ("separation of a plugin", CONTROL, "<wheelSeparation>${wheel_separation}", "<wheelSeparation>${base_width}", "D105", CONTROL, "<wheelSeparation>"),
    ("diameter of a plugin", CONTROL, "${2*wheel_radius}", "${wheel_radius}", "D106", CONTROL, "<wheelDiameter>"),
    ("joint of a plugin", CONTROL, "<leftJoint>left_wheel_joint", "<leftJoint>left_wheel", "D101", CONTROL, "<leftJoint>"),
    ("frame of a plugin", CONTROL, "<robotBaseFrame>base_footprint", "<robotBaseFrame>base_footprnt", "D121", CONTROL, "<robotBaseFrame>"),
    ("caster with friction", CONTROL, "<mu1>0.0</mu1>\n    <mu2>0.0</mu2>", "<mu1>1.0</mu1>\n    <mu2>1.0</mu2>", "D118", MAIN, '<joint name="caster_wheel_joint"'),
    ("reference misspelt", CONTROL, '<gazebo reference="base_link">', '<gazebo reference="base_lnk">', "D103", CONTROL, "base_lnk"),
    ("wheel inertia not turned", MACROS, ' rpy="${pi/2} 0 0"/>\n    </link>', "/>\n    </link>", "I111", MACROS, "<inertia ixx=\"${m*(3*r*r+h*h)/12}\""),
    ("axes along x", MACROS, '<axis xyz="0 1 0"/>', '<axis xyz="1 0 0"/>', "D110", MACROS, "<axis"),
    ("axes opposed", MACROS, '<axis xyz="0 1 0"/>', '<axis xyz="0 ${reflect} 0"/>', "D108", MAIN, '<xacro:wheel prefix="right"'),
    ("axes backwards", MACROS, '<axis xyz="0 1 0"/>', '<axis xyz="0 -1 0"/>', "D109", MACROS, "<axis"),
    ("axis with rpy", MACROS, '<axis xyz="0 1 0"/>', '<axis xyz="0 1 0" rpy="0 0 0"/>', "U202", MACROS, "<axis"),
    ("wheels revolute", MACROS, 'type="continuous"', 'type="revolute"', "J103", MACROS, "<limit"),
    ("no effort", MACROS, 'effort="${wheel_effort}"', 'effort="0"', "J104", MACROS, "<limit"),
    ("wheel drawn in degrees", MACROS, 'rpy="${pi/2} 0 0"/>\n        <geometry>', 'rpy="90 0 0"/>\n        <geometry>', "J108", MACROS, 'rpy="90 0 0"'),
    ("material undefined", MACROS, '<material name="red">', '<material name="rd">', "G108", MAIN, '<material name="red"/>'),
]  # fmt: skip


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = Path(resolve_robot_path("kbot")).parents[1]
    shutil.copytree(folder, tmp_path / "kbot_description")
    monkeypatch.chdir(tmp_path)
    return tmp_path / "kbot_description" / "urdf"


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda m: m[0])
def test_a_mutant_is_found_at_its_line(mutant: tuple[str, ...], package: Path) -> None:
    _, file, old, new, code, found_in, words = mutant
    text = (package / file).read_text("utf-8")
    assert old in text
    (package / file).write_text(text.replace(old, new, 1), "utf-8")
    lines = (package / found_in).read_text("utf-8").splitlines()
    found = check_file(str(package / MAIN), config=Config())
    # if a macro is called once, the macro or its call may be at fault: the stack names the call
    places = {
        (d.code, Path(span.file).name, span.line)
        for d in found
        if d.origin
        for span in (d.origin.span, *(c.span for c in d.origin.stack if c.kind == "macro"))
    }
    expected = {(code, found_in, n) for n, line in enumerate(lines, 1) if words in line}
    assert expected & places, (expected, places)


def test_the_unchanged_robot_has_no_findings(package: Path) -> None:
    assert check_file(str(package / MAIN), config=Config()) == ()


def test_the_yaml_of_a_controller_is_compared_with_the_wheels(package: Path) -> None:
    path = package.parent / "config" / "kbot_controllers.yaml"
    text = path.read_text("utf-8")
    changed = text.replace("wheel_separation: 0.174", "wheel_separation: 0.15").replace(
        "wheel_radius: 0.035", "wheel_radius: 0.04"
    )
    path.write_text(
        changed.replace("left_wheel_names: [left_wheel_joint]", "left_wheel_names: [left_joint]"), "utf-8"
    )
    found = check_file(str(package / MAIN), {"control": "ros2_control"}, config=Config())
    lines = changed.splitlines()
    expected = {
        (code, Path(path).name, next(n for n, line in enumerate(lines, 1) if word in line))
        for code, word in (
            ("D105", "wheel_separation"),
            ("D106", "wheel_radius"),
            ("D101", "left_wheel_names"),
        )
    }
    assert expected == {
        (d.code, Path(d.origin.span.file).name, d.origin.span.line) for d in found if d.origin
    }


def test_a_macro_is_fixed_if_every_call_has_the_fault(package: Path) -> None:
    path = package / MACROS
    text = path.read_text("utf-8")
    broken = text.replace('<axis xyz="0 1 0"/>', '<axis xyz="0 1 0" rpy="0 0 0"/>')
    path.write_text(broken, "utf-8")
    main = str(package / MAIN)

    def check_main() -> tuple[Diagnostic, ...]:
        return check_file(main, config=Config())

    includes = fixed_includes(main, check_main(), check_main, unsafe=False)
    assert [f.title for f in includes.fixes] == ["remove rpy"]
    assert list(includes.texts.values()) == [(broken, text)]
    assert path.read_text("utf-8") == broken


def test_a_macro_is_not_edited_for_a_fault_of_one_call(package: Path) -> None:
    path, main = package / MACROS, package / MAIN
    text = path.read_text("utf-8")
    turned = text.replace('<axis xyz="0 1 0"/>', '<axis xyz="${axis}"/>').replace(
        'params="prefix reflect"', "params=\"prefix reflect axis:='0 1 0'\""
    )
    path.write_text(turned, "utf-8")
    main.write_text(
        main.read_text("utf-8").replace(
            'prefix="left" reflect="1"', 'prefix="left" reflect="1" axis="0 2 0"'
        ),
        "utf-8",
    )
    found = check_file(str(main), config=Config())
    (long,) = [d for d in found if d.code == "J107"]
    assert long.fix is None
    assert long.origin is not None
    assert Path(long.origin.span.file).name == MAIN


@pytest.mark.parametrize(
    ("file", "changes", "code", "hint"),
    [
        (CONTROL, [("${2*wheel_radius}", "${wheel_radius}")], "D106",
         "use twice the radius of the wheels: 0.07"),
        (CONTROL, [("<leftJoint>left", "<leftJoint>right"), ("<rightJoint>right", "<rightJoint>left")], "D107",
         "swap the names in <leftJoint> and <rightJoint>"),
        (MAIN, [('prefix="left" reflect="1"', 'prefix="left" reflect="-1"'),
                ('prefix="right" reflect="-1"', 'prefix="right" reflect="1"')], "D107",
         "y points left: swap the signs of the wheels' y coordinates"),
    ],
)  # fmt: skip
def test_a_hint_contains_the_value_to_write(
    file: str, changes: list[tuple[str, str]], code: str, hint: str, package: Path
) -> None:
    text = (package / file).read_text("utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    (package / file).write_text(text, "utf-8")
    found = [d for d in check_file(str(package / MAIN), config=Config()) if d.code == code]
    assert {d.hint for d in found} == {hint}


@pytest.mark.parametrize(("written", "has_fix"), [(" 0.15 ", True), ("${base_width}", False)])
def test_a_wrong_separation_is_fixed_if_it_is_a_number(package: Path, written: str, has_fix: bool) -> None:
    path = package / CONTROL
    right = "<wheelSeparation>${wheel_separation}<"
    path.write_text(
        path.read_text("utf-8").replace(right, f"<wheelSeparation>{written}<", 1),
        "utf-8",
    )
    (found,) = [d for d in check_file(str(package / MAIN), config=Config()) if d.code == "D105"]
    assert found.origin is not None
    assert found.origin.span.text == written.strip()
    assert bool(found.fix) == has_fix
    if found.fix is not None:
        assert not found.fix.safe
        text = apply_edits(path.read_text("utf-8"), found.fix.edits)
        assert "<wheelSeparation> 0.174 <" in text
