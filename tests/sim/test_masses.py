"""Bodies and links without mass: the robot is fixed to the world, or a joint is held, with a warning."""

import pytest

from kbot.kinematics.drive.drive import NoDrive
from kbot.sim import Simulation
from kbot.text import KbotError

SOLID = (
    '<inertial><mass value="1"/><inertia ixx="{0}" iyy="{0}" izz="{0}" ixy="0" ixz="0" iyz="0"/></inertial>'
)
BOB = SOLID.format(0.01).replace("<mass", '<origin xyz="0.5 0 0"/><mass')
LIMIT = '<limit lower="{0}" upper="3" effort="50" velocity="10"/>'


def arm(base: str = "", bob: str = BOB, lower: float = -3.0, more: str = "") -> str:
    """A bob below a hinge about y, 1 m above the root link `base`."""
    return (
        f'<robot name="arm"><link name="base">{base}</link>\n<link name="bob">{bob}</link>'
        '<joint name="hinge" type="revolute"><parent link="base"/><child link="bob"/>'
        f'<origin xyz="0 0 1"/><axis xyz="0 1 0"/>{LIMIT.format(lower)}</joint>{more}</robot>'
    )


def test_robot_whose_body_has_no_mass_is_fixed_to_the_world_with_a_warning(urdf):
    sim = Simulation(urdf(arm()))
    (reported,) = sim.diagnostics
    assert (reported.code, reported.is_error, reported.origin.span.line) == ("W101", False, 1)
    assert "'base'" in reported.message
    assert "fixed to the world" in reported.message
    sim.robots.first.set_joint("hinge", -0.5)
    sim.run(2.0)
    assert sim.link_pose("base").translation == pytest.approx((0.0, 0.0, 0.0), abs=0.0)
    assert sim.joint_positions["hinge"] == pytest.approx(-0.5, abs=0.1)
    with pytest.raises(KbotError, match="cannot drive"):
        sim.cmd_vel(0.1, 0.0)


def test_root_called_world_is_fixed_without_a_finding(urdf):
    sim = Simulation(urdf(arm().replace("base", "world")))
    assert sim.diagnostics == ()
    sim.run(1.0)
    assert sim.link_pose("world").translation == pytest.approx((0.0, 0.0, 0.0), abs=0.0)


def test_joint_of_a_link_without_mass_is_held_with_a_warning(urdf):
    """The joint is held at its start of 0.3 rad, the limit nearest to 0."""
    sim = Simulation(urdf(arm(bob="", lower=0.3)))
    assert [(d.code, d.origin.span.line) for d in sim.diagnostics] == [("W101", 1), ("W114", 2)]
    assert "joint 'hinge' cannot move" in sim.diagnostics[1].message
    sim.run(1.0)
    assert sim.joint_positions == {"hinge": 0.3}
    assert sim.robots.first.body.joint_velocities == {"hinge": 0.0}
    assert sim.link_pose("bob").is_close(Simulation(urdf(arm(lower=0.3))).link_pose("bob"))
    with pytest.raises(KbotError, match="'hinge' cannot move"):
        sim.robots.first.set_joint("hinge", 0.5)


def test_child_of_a_held_link_moves(urdf):
    more = (
        f'<link name="tip">{SOLID.format(0.01)}</link><joint name="wrist" type="continuous">'
        '<parent link="bob"/><child link="tip"/><axis xyz="0 0 1"/></joint>'
    )
    sim = Simulation(urdf(arm(bob="", more=more)))
    sim.robots.first.set_joint("wrist", 0.7)
    sim.run(2.0)
    assert sim.joint_positions == pytest.approx({"wrist": 0.7, "hinge": 0.0}, abs=1e-3)


def test_mimic_of_a_held_joint_stays_at_its_position(urdf):
    """Its position is 2 * 0.3 + 0.1 rad."""
    more = (
        f'<link name="tip">{SOLID.format(0.01)}</link><joint name="wrist" type="revolute">'
        '<parent link="base"/><child link="tip"/><axis xyz="0 0 1"/><limit lower="-3" upper="3"/>'
        '<mimic joint="hinge" multiplier="2" offset="0.1"/></joint>'
    )
    sim = Simulation(urdf(arm(bob="", lower=0.3, more=more)))
    sim.run(2.0)
    assert sim.joint_positions["wrist"] == pytest.approx(0.7, abs=1e-3)


CART = (
    '<robot name="cart"><link name="base_link">{body}<collision><geometry><box size="0.2 0.1 0.02"/>'
    "</geometry></collision></link>"
    + "".join(
        f'<link name="{side}_wheel">{{wheel}}<collision><geometry><cylinder radius="0.05" length="0.02"/>'
        f'</geometry></collision></link><joint name="{side}_wheel_joint" type="continuous">'
        f'<parent link="base_link"/><child link="{side}_wheel"/><origin xyz="0 {y} 0" rpy="-1.570796 0 0"/>'
        '<axis xyz="0 0 1"/></joint>'
        for side, y in (("left", 0.1), ("right", -0.1))
    )
    + "</robot>"
)


@pytest.mark.parametrize(
    ("body", "wheel", "why"),
    [
        ("", SOLID.format(0.001), "fixed to the world"),
        (SOLID.format(0.001), "", "'left_wheel' has no mass"),
    ],
)
def test_cart_with_a_massless_body_or_wheel_reports_why_it_cannot_drive(urdf, body, wheel, why):
    sim = Simulation(urdf(CART.format(body=body, wheel=wheel)))
    assert isinstance(sim.robots.first.drive, NoDrive)
    sim.run(0.5)
    with pytest.raises(KbotError, match=why):
        sim.cmd_vel(0.1, 0.0)
