"""One wrong number of an inertial gives one finding, regardless of its consequences. Two give two
findings."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kbot.checks import Config, check_file, check_text

ONLY = Config(
    select=("I102", "I103", "I104", "I105", "I107", "I108", "I109", "I110", "I111", "I112", "I113", "I117")
)
Moments = tuple[float, float, float]
sizes = st.sampled_from([0.02, 0.05, 0.11, 0.3])
densities = st.sampled_from([200.0, 1000.0, 2700.0, 7850.0])
factors = st.sampled_from([30.0, 100.0, 1e3, 1e6])


def box(size: Moments, mass: float) -> Moments:
    """Principal moments of a solid box: m (b^2 + c^2) / 12 and so on, kg m^2."""
    x, y, z = (s * s for s in size)
    return mass * (y + z) / 12.0, mass * (x + z) / 12.0, mass * (x + y) / 12.0


def wheel(radius: float, width: float, mass: float) -> Moments:
    """Principal moments of a solid cylinder along y: m r^2 / 2 and m (3 r^2 + w^2) / 12, kg m^2."""
    across = mass * (3.0 * radius**2 + width**2) / 12.0
    return across, mass * radius**2 / 2.0, across


def inertial(mass: float, moments: Moments) -> str:
    x, y, z = moments
    return (
        f'<inertial><mass value="{mass!r}"/>'
        f'<inertia ixx="{x!r}" ixy="0" ixz="0" iyy="{y!r}" iyz="0" izz="{z!r}"/></inertial>'
    )


def codes(text: str, config: Config = ONLY) -> list[str]:
    return sorted(d.code for d in check_text(text, "robot.urdf", config=config))


def on_a_box(size: Moments, mass: float, moments: Moments, config: Config = ONLY) -> list[str]:
    """The codes of the findings for a robot with one turning link, a box."""
    shape = f'<geometry><box size="{size[0]} {size[1]} {size[2]}"/></geometry>'
    return codes(
        '<robot name="r"><link name="base"/><link name="arm">'
        f"<visual>{shape}</visual><collision>{shape}</collision>{inertial(mass, moments)}</link>"
        '<joint name="j" type="continuous"><parent link="base"/><child link="arm"/>'
        '<axis xyz="0 0 1"/></joint></robot>',
        config,
    )


def on_a_wheel(radius: float, width: float, mass: float, moments: Moments) -> list[str]:
    """The codes of the findings for a robot with two wheels, of which the left one has these values."""
    shape = (
        f'<origin xyz="0 0 0" rpy="{math.pi / 2} 0 0"/>'
        f'<geometry><cylinder radius="{radius}" length="{width}"/></geometry>'
    )
    good = 1000.0 * math.pi * radius**2 * width
    chassis = '<visual><geometry><box size="0.4 0.3 0.1"/></geometry></visual>'
    text = f'<robot name="r"><link name="base">{chassis}</link>'
    for name, y, own in (
        ("left", 0.3, inertial(mass, moments)),
        ("right", -0.3, inertial(good, wheel(radius, width, good))),
    ):
        text += (
            f'<link name="{name}_wheel"><visual>{shape}</visual><collision>{shape}</collision>{own}</link>'
            f'<joint name="{name}_joint" type="continuous"><parent link="base"/><child link="{name}_wheel"/>'
            f'<origin xyz="0 {y} 0" rpy="0 0 0"/><axis xyz="0 1 0"/></joint>'
        )
    return codes(text + "</robot>")


def replaced(moments: Moments, index: int, value: float) -> Moments:
    values = list(moments)
    values[index] = value
    return values[0], values[1], values[2]


@given(st.tuples(sizes, sizes, sizes), densities)
@settings(max_examples=30, deadline=None)
def test_a_valid_body_has_no_finding(size: Moments, density: float) -> None:
    mass = density * math.prod(size)
    assert on_a_box(size, mass, box(size, mass)) == []


@given(st.tuples(sizes, sizes, sizes), densities, st.integers(0, 2), factors)
@settings(max_examples=60, deadline=None)
def test_one_moment_that_is_too_large_is_reported_once_as_i105(
    size: Moments, density: float, index: int, factor: float
) -> None:
    mass = density * math.prod(size)
    moments = box(size, mass)
    # large enough to be more than the other two together (triangle inequality)
    too_large = replaced(moments, index, factor * sum(moments))
    assert on_a_box(size, mass, too_large) == ["I105"]


@given(st.tuples(sizes, sizes, sizes), densities, factors)
@settings(max_examples=60, deadline=None)
def test_a_tensor_in_other_units_is_reported_once(size: Moments, density: float, factor: float) -> None:
    mass = density * math.prod(size)
    x, y, z = box(size, mass)
    (code,) = on_a_box(size, mass, (x * factor, y * factor, z * factor))
    assert code in ("I107", "I108")


@given(st.tuples(sizes, sizes, sizes), st.sampled_from([1e-6, 1e-3, 1e3, 1e6]))
@settings(max_examples=60, deadline=None)
def test_a_wrong_mass_is_reported_once_as_a_density(size: Moments, factor: float) -> None:
    mass = 1000.0 * math.prod(size)
    assert on_a_box(size, mass * factor, box(size, mass)) == ["I117"]


@given(sizes, sizes, st.sampled_from([0, 2]), factors)
@settings(max_examples=60, deadline=None)
def test_one_wrong_moment_across_a_wheel_is_reported_once(
    radius: float, width: float, index: int, factor: float
) -> None:
    mass = 1000.0 * math.pi * radius**2 * width
    moments = wheel(radius, width, mass)
    for value in (factor * sum(moments), moments[index] / factor):
        (code,) = on_a_wheel(radius, width, mass, replaced(moments, index, value))
        assert code in ("I105", "I111")


@given(sizes, sizes, factors)
@settings(max_examples=40, deadline=None)
def test_one_wrong_moment_about_a_wheels_axle_is_reported_once(
    radius: float, width: float, factor: float
) -> None:
    mass = 1000.0 * math.pi * radius**2 * width
    moments = wheel(radius, width, mass)
    assert on_a_wheel(radius, width, mass, replaced(moments, 1, factor * sum(moments))) == ["I105"]


def test_two_wrong_numbers_are_two_findings() -> None:
    size, mass = (0.1, 0.1, 0.1), 1.0
    x, y, z = box(size, mass)
    assert on_a_box(size, mass, (1e6 * x, 1e6 * y, 3e6 * z)) == ["I105", "I108"]  # units, and one moment
    assert on_a_box(size, 1e-6, (x, y, 3.0 * z)) == ["I105", "I117"]  # the mass, and one moment
    assert on_a_box(size, 1e-6, (1e6 * x, 1e6 * y, 1e6 * z)) == ["I108", "I117"]  # neither fits the shape


@pytest.mark.parametrize("factor", [1e3, 1e6])
def test_units_and_an_uneven_wheel_are_two_findings(factor: float) -> None:
    radius, width, mass = 0.05, 0.02, 0.2
    x, y, z = wheel(radius, width, mass)
    assert on_a_wheel(radius, width, mass, (factor * x, factor * y, factor * 1.5 * z)) == ["I108", "I111"]


def test_consequences_are_reported_if_the_rule_of_their_cause_is_ignored() -> None:
    size, mass = (0.1, 0.1, 0.1), 1.0
    x, y, z = box(size, mass)
    without = Config(select=ONLY.select, ignore=("I105", "I117"))
    assert on_a_box(size, mass, (x, y, 1e6 * z), without) == ["I108"]
    assert on_a_box(size, 1e-6, (x, y, z), without) == ["I108"]
    assert on_a_box(size, 1e6, (x, y, z), without) == ["I109"]


@pytest.mark.parametrize(
    ("part", "cause"),
    [('<xacro:whel side="1"/>', "X121"), ('<xacro:include filename="gone.xacro"/>', "X117")],
)
def test_consequences_of_a_missing_part_are_not_reported(tmp_path: Path, part: str, cause: str) -> None:
    """A drive with a missing right wheel lacks a joint, but there is only one error to fix."""
    file = tmp_path / "robot.xacro"
    file.write_text(
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">'
        '<xacro:macro name="wheel" params="side"><link name="wheel_${side}"/><joint '
        'name="wheel_${side}_joint" type="continuous"><parent link="base"/><child link="wheel_${side}"/>'
        '<axis xyz="0 1 0"/></joint>'
        f'</xacro:macro><link name="base"/><xacro:wheel side="-1"/>{part}<gazebo><plugin name="drive" '
        'filename="libgazebo_ros_diff_drive.so"><leftJoint>wheel_1_joint</leftJoint>'
        "<rightJoint>wheel_-1_joint</rightJoint></plugin></gazebo></robot>"
    )
    errors = [found.code for found in check_file(str(file)) if found.is_error]
    assert errors == [cause]
    file.write_text(file.read_text().replace(part, ""))
    assert [found.code for found in check_file(str(file)) if found.is_error] == ["D101"]


def _wheel(name: str, x: float, y: float, shape: str) -> str:
    return (
        f'<link name="{name}">{shape}</link><joint name="{name}_joint" type="continuous">'
        f'<parent link="base"/><child link="{name}"/><origin xyz="{x} {y} 0"/><axis xyz="0 1 0"/></joint>'
    )


def test_a_drive_with_missing_wheels_is_not_judged(tmp_path: Path) -> None:
    """The shapes of the wheels that the plugin names are in a file that is missing."""
    cylinder = '<geometry><cylinder radius="0.05" length="0.02"/></geometry><origin rpy="1.5707963 0 0"/>'
    shape = f"<visual>{cylinder}</visual><collision>{cylinder}</collision>"
    wheels = _wheel("left", 0.1, 0.15, shape) + _wheel("right", 0.1, -0.15, shape)
    wheels += _wheel("rear_left", -0.1, 0.15, "<xacro:tyre/>") + _wheel(
        "rear_right", -0.1, -0.15, "<xacro:tyre/>"
    )
    file = tmp_path / "rover.xacro"
    file.write_text(
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:include filename="tyre.xacro"/>'
        f'<link name="base"/>{wheels}<gazebo><plugin name="drive" filename="libgazebo_ros_diff_drive.so">'
        "<left_joint>rear_left_joint</left_joint><right_joint>rear_right_joint</right_joint>"
        "</plugin></gazebo></robot>"
    )
    codes = {found.code for found in check_file(str(file))}
    assert "X117" in codes
    assert not codes & {"D105", "D106", "D107", "D108", "D109", "W134"}
