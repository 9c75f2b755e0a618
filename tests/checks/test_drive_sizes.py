"""What a property means follows from what reads it. Its name alone is not evidence.

The wheels have a radius of 0.035 m and are 0.174 m apart.
"""

from __future__ import annotations

import pytest

from kbot.checks import Config, check_text
from kbot.text import Diagnostic
from kbot.text.edits import apply_edits

INERTIAL = (
    '<inertial><mass value="{}"/>'
    '<inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial>'
)
BODY = '<visual><geometry><box size="0.2 0.1 0.05"/></geometry></visual>'


def rover(properties: str, left: str = "0.087", right: str = "-0.087", more: str = "") -> str:
    parts = [f'<link name="base">{INERTIAL.format(2)}{BODY}</link>']
    for side, y in (("left", left), ("right", right)):
        parts.append(
            f'<link name="{side}">{INERTIAL.format(0.1)}<visual><origin rpy="1.5707963 0 0"/><geometry>'
            '<cylinder radius="0.035" length="0.02"/></geometry></visual></link>'
            f'<joint name="{side}_joint" type="continuous"><parent link="base"/><child link="{side}"/>'
            f'<origin xyz="0 {y} 0"/><axis xyz="0 1 0"/></joint>'
        )
    head = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">'
    return "\n".join([head, properties, *parts, more, "</robot>"])


def properties(**values: str) -> str:
    return "\n".join(f'<xacro:property name="{name}" value="{value}"/>' for name, value in values.items())


def plugin(separation: str = "", diameter: str = "") -> str:
    sizes = f"<wheelSeparation>{separation}</wheelSeparation>" if separation else ""
    sizes += f"<wheelDiameter>{diameter}</wheelDiameter>" if diameter else ""
    joints = "<leftJoint>left_joint</leftJoint><rightJoint>right_joint</rightJoint>"
    return (
        f'<gazebo><plugin name="d" filename="libgazebo_ros_diff_drive.so">{joints}{sizes}</plugin></gazebo>'
    )


def findings(text: str) -> list[Diagnostic]:
    return [d for d in check_text(text, "r.xacro", config=Config()) if d.code in ("D105", "D106")]


def places(text: str) -> list[tuple[str, str]]:
    """The code of each finding, and the line that it points at."""
    return [(d.code, text.splitlines()[d.origin.span.line - 1]) for d in findings(text) if d.origin]


@pytest.mark.parametrize(
    "name", ["wheel_spacing", "wheel_track", "wheel_separation", "track_width", "wheel_distance"]
)
@pytest.mark.parametrize("formula", ["{0} + 0.067", "{0}*2 + 0.047", "offset"])
def test_property_that_places_the_wheels_is_not_a_separation(name: str, formula: str) -> None:
    """A gap of 0.02 m, used directly or through another property."""
    given = {name: "0.02", "offset": f"${{{name} + 0.067}}"}
    y = formula.format(name)
    assert findings(rover(properties(**given), f"${{{y}}}", f"${{-({y})}}")) == []


@pytest.mark.parametrize(
    ("name", "value"),
    [("wheel_spacing", "0.15"), ("track_width", "0.15"), ("wheelTrack", "0.15"), ("wheel_separation", "0.02"),
     ("wheel_radius", "0.3"), ("drive_wheel_radius", "0.05")],
)  # fmt: skip
def test_name_alone_is_not_evidence(name: str, value: str) -> None:
    """The name is not one that controllers read, or the value is not near the size."""
    assert findings(rover(properties(**{name: value}))) == []


@pytest.mark.parametrize(
    ("name", "value", "code"),
    [
        ("wheel_separation", "0.15", "D105"),
        ("wheel_radius", "0.05", "D106"),
        ("wheel_diameter", "0.1", "D106"),
    ],
)
def test_unused_property_with_the_name_and_nearly_the_value_of_a_size_is_reported(
    name: str, value: str, code: str
) -> None:
    text = rover(properties(**{name: value}))
    (found,) = findings(text)
    assert found.code == code
    assert found.message.startswith(f"unused property '{name}'")


@pytest.mark.parametrize(("name", "value"), [("wheel_separation", "0.15"), ("wheel_radius", "0.05")])
def test_property_that_something_else_reads_is_not_a_size_of_the_wheels(name: str, value: str) -> None:
    rod = f'<link name="rod"><visual><geometry><sphere radius="${{{name}}}"/></geometry></visual></link>'
    joint = '<joint name="rod_joint" type="fixed"><parent link="base"/><child link="rod"/></joint>'
    assert findings(rover(properties(**{name: value}), more=rod + joint)) == []


@pytest.mark.parametrize("written", ["${gap}", "${ gap }", "${passed_on}"])
def test_property_that_a_plugin_reads_is_reported_where_it_is_a_number(written: str) -> None:
    text = rover(properties(gap="0.15", passed_on="${gap}"), more=plugin(written))
    (found,) = findings(text)
    assert places(text) == [("D105", '<xacro:property name="gap" value="0.15"/>')]
    assert found.fix is not None
    assert not found.fix.safe
    assert findings(apply_edits(text, found.fix.edits)) == []


@pytest.mark.parametrize("written", ["${gap}", "${gap * 1}", "0.02"])
def test_fix_never_moves_the_wheels(written: str) -> None:
    """The property of the gap is exchanged with the separation: the plugin is wrong, not the gap."""
    text = rover(properties(gap="0.02"), "${gap + 0.067}", "${-(gap + 0.067)}", plugin(written))
    (found,) = findings(text)
    assert found.origin is not None
    assert found.origin.span.text == written
    assert found.fix is None or [edit.span.text for edit in found.fix.edits] == [written]
