"""Values of expressions, listed beside them: through macros, includes and properties."""

from pathlib import Path

import pytest

from kbot.workbench.protocol import OpenSource, SetParameter, SourceText
from kbot.workbench.serve import open_session
from kbot.workbench.session.session import Session

ROBOT = """<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
<xacro:include filename="wheel.xacro"/>
<xacro:arg name="length" default="0.3"/>
<xacro:property name="third" value="${0.1 / 0.3}"/>
<xacro:property name="radius" value="${third / 2}"/>
<link name="base"><visual><geometry><box size="$(arg length) 0.2 ${third}"/></geometry></visual></link>
<xacro:wheel side="left" sign="${1 * 1}"/>
<xacro:wheel side="right" sign="-1"/>
</robot>
"""
WHEEL = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
<xacro:macro name="wheel" params="side sign">
<link name="${side}_wheel"/>
<joint name="${side}" type="fixed"><parent link="base"/><child link="${side}_wheel"/>
<origin xyz="0 ${sign * radius} 0"/></joint>
</xacro:macro>
</robot>
"""


@pytest.fixture
def session(tmp_path: Path) -> Session:
    (tmp_path / "robot.xacro").write_text(ROBOT)
    (tmp_path / "wheel.xacro").write_bytes(b"\xef\xbb\xbf" + WHEEL.replace("\n", "\r\n").encode())
    return open_session(str(tmp_path / "robot.xacro"), simulate=False)


def hint_values(session: Session, name: str) -> dict[str, tuple[str, ...]]:
    """Return the values at each text with a hint."""
    source = session.handle(OpenSource(str(Path(session.shown.file).with_name(name))), 1)[0]
    assert isinstance(source, SourceText)
    lines = source.text.split("\n")
    return {
        lines[at.line - 1][at.column - 1 : at.column - 1 + at.length]: hint.values
        for hint in source.hints
        for at in [hint.place]
    }


def test_an_expression_without_a_value_has_no_hint(tmp_path: Path) -> None:
    (tmp_path / "robot.xacro").write_text(
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:property name="a" value="1"/>'
        '<link name="base_${a}"><visual><origin xyz="0 0 ${a &lt; nope}"/>'
        '<geometry><sphere radius="${nope}"/></geometry></visual></link></robot>'
    )
    session = open_session(str(tmp_path / "robot.xacro"), simulate=False)
    assert hint_values(session, "robot.xacro") == {"base_${a}": ("base_1",)}


def test_an_expression_in_a_macro_has_a_value_for_each_call(session: Session) -> None:
    assert hint_values(session, "robot.xacro") == {
        "${0.1 / 0.3}": ("0.333333",),
        "${third / 2}": ("0.166667",),
        "$(arg length) 0.2 ${third}": ("0.3 0.2 0.333333",),
        "${1 * 1}": ("1",),
    }
    assert hint_values(session, "wheel.xacro") == {
        "${side}_wheel": ("left_wheel", "right_wheel"),
        "${side}": ("left", "right"),
        "0 ${sign * radius} 0": ("0 0.166667 0", "0 -0.166667 0"),
    }


def test_values_belong_to_the_displayed_text(session: Session) -> None:
    session.handle(SetParameter("arg", "length", 0.5), 1)
    session.adopt(session.read())
    assert hint_values(session, "robot.xacro")["$(arg length) 0.2 ${third}"] == ("0.5 0.2 0.333333",)
    file = Path(session.shown.file)
    file.write_text("<!-- saved, and not read yet -->" + file.read_text())
    assert hint_values(session, "robot.xacro") == {}


def test_only_a_few_values_of_many_calls_are_listed(tmp_path: Path) -> None:
    calls = "".join(f'<xacro:one n="{n}"/>' for n in range(9))
    (tmp_path / "robot.xacro").write_text(
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="base"/>'
        '<xacro:macro name="one" params="n"><link name="l${n}"/><joint name="j${n}" type="fixed">'
        f'<parent link="base"/><child link="l${{n}}"/></joint></xacro:macro>{calls}</robot>'
    )
    session = open_session(str(tmp_path / "robot.xacro"), simulate=False)
    source = session.handle(OpenSource(session.shown.file), 1)[0]
    assert isinstance(source, SourceText)
    assert next((hint.values, hint.more) for hint in source.hints) == (("l0", "l1", "l2", "l3"), True)
