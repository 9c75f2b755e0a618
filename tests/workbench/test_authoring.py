"""Changing the description from the page: values, edits, fixes, undo."""

from pathlib import Path

import pytest

from kbot.text import KbotError, read_source
from kbot.workbench.protocol import (
    ApplyFix,
    DropParameters,
    EditSource,
    KeepParameters,
    Redo,
    SetParameter,
    Undo,
)
from kbot.workbench.serve import open_session
from kbot.workbench.session.session import Session
from kbot.workbench.source.authoring import Editor
from kbot.workbench.source.overrides import Overrides
from kbot.xacro.packages import SHIPPED


@pytest.fixture
def session(xacro: Path) -> Session:
    return open_session(str(xacro), simulate=False)


def read_again(session: Session) -> None:
    session.adopt(session.read())


def wheel_height(session: Session) -> float:
    index = [link.name for link in session.scene.links].index("left_wheel")
    return session.state().poses[index * 7 + 2]


def values(session: Session) -> dict[str, tuple[float, float]]:
    return {p.name: (p.written, p.value) for p in session.shown.authoring.parameters().parameters}


def test_a_parameter_changes_the_robot_but_not_the_file(session: Session, xacro: Path) -> None:
    text, asked = xacro.read_text(), []
    session.wants_reading = lambda: asked.append(True)
    session.handle(SetParameter("arg", "wheel_radius", 0.05), 1)
    assert asked
    read_again(session)
    assert wheel_height(session) == pytest.approx(0.05)
    assert values(session)["wheel_radius"] == (0.035, 0.05)
    assert xacro.read_text() == text
    session.handle(DropParameters(), 1)
    read_again(session)
    assert wheel_height(session) == pytest.approx(0.035)


def test_a_property_changes_the_robot(tmp_path: Path) -> None:
    file = tmp_path / "r.xacro"
    file.write_text(
        """<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="r">
  <xacro:property name="high" value="1.5"/>
  <link name="a"/><link name="b"/>
  <joint name="j" type="fixed"><parent link="a"/><child link="b"/><origin xyz="0 0 ${high}"/></joint>
</robot>"""
    )
    session = open_session(str(file), simulate=False)
    session.handle(SetParameter("property", "high", 2.5), 1)
    read_again(session)
    assert session.state().poses[7 + 2] == pytest.approx(2.5)


def test_kept_values_are_written_and_can_be_undone(session: Session, xacro: Path) -> None:
    text = xacro.read_text()
    session.handle(SetParameter("arg", "wheel_radius", 0.05), 1)
    session.handle(SetParameter("arg", "base_len", 0.2), 1)
    session.handle(KeepParameters(), 1)
    read_again(session)
    changed = text.replace('"wheel_radius" default="0.035"', '"wheel_radius" default="0.05"')
    assert xacro.read_text() == changed.replace('"base_len" default="0.16"', '"base_len" default="0.2"')
    assert values(session)["wheel_radius"] == (0.05, 0.05)
    assert session.shown.authoring.parameters().undo == "new values of wheel_radius, base_len"
    kept = xacro.read_text()
    session.handle(Undo(), 1)
    assert xacro.read_text() == text
    with pytest.raises(KbotError, match="nothing to undo"):
        session.handle(Undo(), 1)
    assert session.shown.authoring.parameters().redo == "new values of wheel_radius, base_len"
    session.handle(Redo(), 1)
    assert xacro.read_text() == kept
    with pytest.raises(KbotError, match="nothing to redo"):
        session.handle(Redo(), 1)


def test_values_given_on_the_command_line_are_shown(xacro: Path) -> None:
    session = open_session(str(xacro), simulate=False, arguments={"wheel_radius": "0.04"})
    assert values(session)["wheel_radius"] == (0.035, 0.04)
    session.handle(SetParameter("arg", "wheel_radius", 0.06), 1)
    session.handle(DropParameters(), 1)
    read_again(session)
    assert wheel_height(session) == pytest.approx(0.04)


CHOICES = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="r">
  <xacro:arg name="tall" default="true"/>
  <xacro:property name="wide" value="False"/>
  <xacro:property name="high" value="9"/>
  <xacro:if value="$(arg tall)"><xacro:property name="high" value="1.5"/></xacro:if>
  <xacro:unless value="$(arg tall)"><xacro:property name="high" value="0.5"/></xacro:unless>
  <link name="a"/><link name="b"/>
  <joint name="j" type="fixed"><parent link="a"/><child link="b"/>
    <origin xyz="${3 if wide else 1} 0 ${high}"/></joint>
</robot>"""


def choices(tmp_path: Path) -> Session:
    (tmp_path / "r.xacro").write_text(CHOICES)
    return open_session(str(tmp_path / "r.xacro"), simulate=False)


def test_the_definition_in_effect_is_changed(tmp_path: Path) -> None:
    session = choices(tmp_path)
    assert values(session)["high"] == (1.5, 1.5)
    session.handle(SetParameter("property", "high", 2.5), 1)
    session.handle(KeepParameters(), 1)
    assert Path(session.shown.file).read_text() == CHOICES.replace('"1.5"', '"2.5"')


def test_booleans_keep_their_spelling(tmp_path: Path) -> None:
    session = choices(tmp_path)
    truths = {p.name for p in session.shown.authoring.parameters().parameters if p.is_truth}
    assert truths == {"tall", "wide"}
    assert values(session)["tall"] == (1.0, 1.0)
    session.handle(SetParameter("arg", "tall", 0.0), 1)
    session.handle(SetParameter("property", "wide", 1.0), 1)
    read_again(session)
    assert session.state().poses[7 : 7 + 3] == pytest.approx((3.0, 0.0, 0.5))
    assert values(session)["high"] == (0.5, 0.5)
    session.handle(KeepParameters(), 1)
    kept = CHOICES.replace('"true"', '"false"').replace('"False"', '"True"')
    assert Path(session.shown.file).read_text() == kept


def test_an_unknown_parameter_is_refused(session: Session) -> None:
    for kind, name in (("arg", "control"), ("property", "wheel_radius"), ("arg", "nothing")):
        with pytest.raises(KbotError, match="plain number"):
            session.handle(SetParameter(kind, name, 1.0), 1)


def test_a_number_is_edited_in_place(session: Session, xacro: Path) -> None:
    text = xacro.read_text()
    line = 1 + text[: text.index("0.035")].count("\n")
    column = text.splitlines()[line - 1].index("0.035") + 1
    session.handle(EditSource(str(xacro), line, column, "0.035", "0.045"), 1)
    assert xacro.read_text() == text.replace("0.035", "0.045")
    with pytest.raises(KbotError, match="has changed"):
        session.handle(EditSource(str(xacro), line, column, "0.035", "0.055"), 1)
    for bad in ('0"/><link name="x', "<", "a\nb", "&lt;"):
        with pytest.raises(KbotError, match="cannot contain"):
            session.handle(EditSource(str(xacro), line, column, "0.045", bad), 1)
    for bad in ("abc", "1 2", "nan", "1e999", "1_0", "0x10", "", "${}"):
        with pytest.raises(KbotError, match="neither a finite number"):
            session.handle(EditSource(str(xacro), line, column, "0.045", bad), 1)
    assert xacro.read_text() == text.replace("0.035", "0.045")
    was = "0.045"
    for good in ("-.5e-1", "3.", "${2 * pi}", "$(arg base_len)"):
        session.handle(EditSource(str(xacro), line, column, was, good), 1)
        was = good
    assert xacro.read_text() == text.replace("0.035", "$(arg base_len)")
    with pytest.raises(KbotError, match="not part of this description"):
        session.handle(EditSource("/etc/hostname", 1, 1, "a", "b"), 1)
    with pytest.raises(KbotError, match="has no line"):
        session.handle(EditSource(str(xacro), 100_000, 1, "", "1"), 1)


def test_the_robot_that_ships_is_not_changed() -> None:
    file = str(Path(SHIPPED) / "kbot_description" / "urdf" / "kbot.xacro")
    text = read_source(file).text
    with pytest.raises(KbotError, match="ships with KBot"):
        Editor(lambda files: None).replace(file, 1, 1, "<", "1")
    assert read_source(file).text == text


def test_a_fix_is_applied(session: Session, xacro: Path) -> None:
    macros = xacro.with_name("kbot_macros.xacro")
    good = macros.read_text()
    macros.write_text(good.replace('<axis xyz="0 1 0"/>', '<axis xyz="0 1 0" rpy="0 0 0"/>'))
    read_again(session)
    findings = session.findings()
    index = next(i for i, finding in enumerate(findings.findings) if finding.fix and "rpy" in finding.message)
    with pytest.raises(KbotError, match="Look at the new list"):
        session.handle(ApplyFix(findings.serial - 1, index), 1)
    session.handle(ApplyFix(findings.serial, index), 1)
    assert macros.read_text() == good
    read_again(session)
    assert not any("rpy" in finding.message for finding in session.findings().findings)


def test_a_slider_writes_no_needless_digits(session: Session, xacro: Path) -> None:
    session.handle(SetParameter("arg", "base_width", 1 / 3), 1)
    assert session.shown.authoring.overrides.arguments["base_width"] == "0.333333333"


def test_overrides_replace_command_line_values() -> None:
    overrides = Overrides({"a": "1", "b": "x"})
    overrides.set("arg", "a", "2")
    overrides.set("property", "c", "3.5")
    assert overrides.arguments == {"a": "2", "b": "x"}
    assert overrides.properties == {"c": "3.5"}
    assert overrides.value("arg", "a", 7.0) == 2.0
    assert overrides.value("arg", "b", 7.0) == 7.0
    assert overrides.value("arg", "c", 7.0) == 7.0


MEASURED = """<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:arg name="reach" default="0.2"/>
  <xacro:property name="radius" value="0.05"/>
  <xacro:property name="gap" value="0.01"/>
  <xacro:property name="tilt" value="0.3"/>
  <xacro:property name="load" value="2.0"/>
  <xacro:property name="scale" value="3.0"/>
  <xacro:property name="both" value="0.5"/>
  <xacro:property name="density" value="900"/>
  <xacro:property name="offset" value="0.1"/>
  <xacro:property name="half" value="${-(radius + gap) / 2}"/>
  <xacro:macro name="part" params="name side size:=1">
    <link name="${name}">
      <visual><origin xyz="${half} ${side * offset} $(arg reach)" rpy="0 ${tilt} 0"/>
        <geometry><sphere radius="${size}"/></geometry></visual>
      <inertial><mass value="${load + density * radius * both}"/>
        <inertia ixx="${load}" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
    </link>
  </xacro:macro>
  <xacro:part name="a" side="1" size="${2 * radius}"/>
  <xacro:part name="b" side="-1" size="${scale * 0.01}"/>
  <joint name="j" type="fixed"><parent link="a"/><child link="b"/>
    <origin xyz="${both} 0 0" rpy="${both} 0 0"/></joint>
</robot>"""


def test_values_have_the_unit_of_the_attributes_that_they_end_in(tmp_path: Path) -> None:
    """Through macros, arguments and other properties. `both` is a length and an angle, and factors such as
    `scale` and `density` have units of their own."""
    (tmp_path / "r.xacro").write_text(MEASURED)
    session = open_session(str(tmp_path / "r.xacro"), simulate=False)
    units = {p.name: p.unit for p in session.shown.authoring.parameters().parameters}
    assert units == {
        "reach": "m",
        "radius": "m",
        "gap": "m",
        "tilt": "rad",
        "load": "kg",
        "scale": "",
        "offset": "m",
        "both": "",
        "density": "",
    }
