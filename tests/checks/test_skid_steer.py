"""How far a skid steer turns, compared with closed forms, simulations and values that makers measured."""

from __future__ import annotations

import re
from math import sqrt

import pytest

from kbot.checks import Config, check_text
from kbot.checks.rules.skid_steer import WheelLoad, turning_separation, wheel_loads
from kbot.model.load import load_robot_text
from kbot.sim import Simulation
from kbot.text import Diagnostic


def separation(axles: dict[float, float], track: float) -> float:
    """The separation that a robot needs whose axles at x each bear a load, shared by two wheels."""
    wheels = [
        WheelLoad(x, side * track / 2.0, side, load / 2.0) for x, load in axles.items() for side in (1, -1)
    ]
    return turning_separation(wheels)


@pytest.mark.parametrize(
    ("wheelbase", "track", "multiplier"),
    [
        (0.512, 0.5708, 1.875),  # Husky, husky_control/config/control.yaml
        (0.262, 0.37559, 1.5),  # Jackal, jackal_control/config/control.yaml
    ],
)
def test_the_separation_is_near_the_multipliers_that_makers_tuned(wheelbase, track, multiplier):
    needed = separation({wheelbase / 2.0: 1.0, -wheelbase / 2.0: 1.0}, track)
    assert needed / track == pytest.approx(multiplier, rel=0.05)


@pytest.mark.parametrize("middle", [0.0, 0.3])
def test_two_equal_axles_have_a_closed_form_wherever_the_base_link_is(middle):
    """The robot makes 0.25^2 / (0.2^2 + 0.25^2) of a turn."""
    needed = separation({middle + 0.2: 1.0, middle - 0.2: 1.0}, 0.5)
    assert needed == pytest.approx(0.5 * 0.1025 / 0.0625, rel=1e-3)


def test_a_third_axle_in_the_middle_helps_to_turn():
    """With a = b moments balance where 2 (2s - 1) = sqrt((1 - s)^2 + s^2), which is 14 s^2 - 14 s + 3 = 0."""
    needed = separation({0.25: 1.0, 0.0: 1.0, -0.25: 1.0}, 0.5)
    assert needed == pytest.approx(0.5 / (0.5 + 1.0 / 28.0**0.5), rel=1e-3)


def test_wheels_on_one_axle_turn_as_commanded():
    assert separation({0.1: 1.0}, 0.4) == pytest.approx(0.4)


@pytest.mark.parametrize("heavier", [1.0, -1.0])
@pytest.mark.parametrize(("share", "holds"), [(1.02, True), (0.9, False)])
def test_an_axle_that_bears_enough_holds(heavier, share, holds):
    """The other axle, at 2a, slides sideways with its whole friction R. The axle holds if each of its wheels
    can bear R/2 sideways and R a/b lengthwise, the couple that keeps the other from turning it:
    F / R >= sqrt(1 + 4 (a/b)^2)."""
    a, b = 0.1, 0.11
    load = share * sqrt(1.0 + 4.0 * (a / b) ** 2)
    needed = separation({heavier * a: load, -heavier * a: 1.0}, 2.0 * b)
    assert (needed == pytest.approx(2.0 * b, rel=2e-3)) is holds
    assert holds or needed > 2.1 * b


CORNERS = [(0.1, 0.11), (0.1, -0.11), (-0.1, 0.11), (-0.1, -0.11)]


def test_loads_follow_the_law_of_the_lever():
    """A centre of mass 0.04 m in front of the middle of axles at +-0.1 m: 0.7 and 0.3 of the weight."""
    assert wheel_loads(CORNERS, (0.04, 0.0)) == pytest.approx([0.35, 0.35, 0.15, 0.15])
    assert wheel_loads(CORNERS, (0.0, 0.0)) == pytest.approx([0.25] * 4)


@pytest.mark.parametrize(("places", "center"), [(CORNERS, (0.2, 0.0)), (CORNERS[:2], (0.1, 0.0))])
def test_loads_that_statics_does_not_give_are_unknown(places, center):
    """The robot tips over, or its wheels are on one line."""
    assert wheel_loads(places, center) is None


def rover(x: float = 0.0, y: float = 0.0, given: float = 0.22, more: str = "", lift: float = 0.0) -> str:
    """A skid steer of 5.2 kg with wheels in the CORNERS. Its body of 4 kg has its centre of mass at x, y."""
    inertia = '<inertia ixx="0.02" iyy="0.03" izz="0.04" ixy="0" ixz="0" iyz="0"/>'
    parts = [
        f'<link name="base_link"><inertial><origin xyz="{x} {y} 0"/><mass value="4"/>{inertia}</inertial>'
        "</link>"
    ]
    tags = {1: "", -1: ""}
    for name, (along, across) in zip(("fl", "fr", "rl", "rr"), CORNERS, strict=True):
        parts.append(
            f'<link name="{name}"><inertial><mass value="0.3"/>'
            '<inertia ixx="0.0003" iyy="0.0004" izz="0.0003" ixy="0" ixz="0" iyz="0"/></inertial>'
            '<collision><origin rpy="1.5707963 0 0"/><geometry><cylinder radius="0.05" length="0.03"/>'
            f'</geometry></collision></link><joint name="{name}_joint" type="continuous">'
            '<parent link="base_link"/>'
            f'<child link="{name}"/><origin xyz="{along} {across} {lift * (name == "rr")}"/>'
            '<axis xyz="0 1 0"/></joint>'
        )
        side = "left" if across > 0.0 else "right"
        tags[1 if across > 0.0 else -1] += f"<{side}_joint>{name}_joint</{side}_joint>"
    parts.append(
        '<gazebo><plugin name="dd" filename="libgazebo_ros_diff_drive.so">'
        f"<num_wheel_pairs>2</num_wheel_pairs>{tags[1]}{tags[-1]}<wheel_separation>{given}</wheel_separation>"
        f"<wheel_diameter>0.1</wheel_diameter></plugin></gazebo>{more}"
    )
    return f'<robot name="rover">{"".join(parts)}</robot>'


def findings(text: str) -> list[Diagnostic]:
    return [d for d in check_text(text, "rover.urdf", config=Config()) if d.code == "D126"]


def turned_share(text: str) -> float:
    """The steady turning rate in a simulation, as a share of the commanded 0.5 rad/s."""
    sim = Simulation(load_robot_text(text, "rover.urdf").require())
    sim.cmd_vel(0.0, 0.5)
    sim.run(1.0)
    before = sim.ground_truth.pose.yaw
    sim.cmd_vel(0.0, 0.5)
    sim.run(1.0)
    return (sim.ground_truth.pose.yaw - before) / 0.5


@pytest.mark.parametrize(
    ("x", "y"), [(0.0, 0.0), (0.02, 0.0), (0.04, 0.0), (-0.03, 0.0), (0.0, 0.03), (0.03, 0.03)]
)
def test_finding_and_hint_agree_with_a_simulation(x, y):
    (found,) = findings(rover(x, y))
    share = 1.0 - float(re.search(r"about (\d+) % less", found.message)[1]) / 100.0
    assert turned_share(rover(x, y)) == pytest.approx(share, abs=0.01)
    needed = float(re.fullmatch(r"set the separation to ([\d.]+) m; then measure a turn", found.hint)[1])
    assert turned_share(rover(x, y, needed)) == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("x", [0.05, -0.05, 0.08])
def test_nothing_is_reported_if_one_axle_holds(x):
    """4 kg at 0.05 m and 1.2 kg of wheels: the axles bear 2.25 to 1, more than sqrt(1 + 4 (10/11)^2)."""
    assert not findings(rover(x))
    assert turned_share(rover(x)) == pytest.approx(1.0, abs=0.01)


CASTER = (
    '<link name="caster_wheel"><inertial><mass value="0.1"/><inertia ixx="1e-5" iyy="1e-5" izz="1e-5" '
    'ixy="0" ixz="0" iyz="0"/></inertial><collision><geometry><sphere radius="0.02"/></geometry>'
    '</collision></link><joint name="caster_wheel_joint" type="fixed"><parent link="base_link"/>'
    '<child link="caster_wheel"/><origin xyz="-0.2 0 -0.03"/></joint>'
)
SLIPPERY = '<gazebo reference="fl"><mu1>0.1</mu1><mu2>0.1</mu2></gazebo>'


@pytest.mark.parametrize(
    "text",
    [rover(more=CASTER), rover(more=SLIPPERY), rover(lift=0.002)],
    ids=["caster", "unequal friction", "a wheel in the air"],
)
def test_nothing_is_reported_if_the_loads_or_frictions_are_not_known(text):
    assert findings(rover())
    assert not findings(text)


def test_no_separation_is_recommended_if_none_helps():
    """The wheels of the heavy side hold the robot, whatever the speeds of the wheels."""
    (found,) = findings(rover(y=0.1))
    assert found.hint.startswith("load the wheels of both sides equally")
    assert turned_share(rover(y=0.1)) < 0.05
    assert turned_share(rover(y=0.1, given=0.88)) < 0.05
