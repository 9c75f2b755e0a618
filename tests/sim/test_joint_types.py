"""Planar, floating and mimic joints move as theory predicts."""

import pytest

from kbot.sim import Simulation

MOMENT = 0.02


def link(name: str, mass: float = 1.0) -> str:
    inertia = f'<inertia ixx="{MOMENT}" iyy="{MOMENT}" izz="{MOMENT}" ixy="0" ixz="0" iyz="0"/>'
    return f'<link name="{name}"><inertial><mass value="{mass}"/>{inertia}</inertial></link>'


def joint(name: str, kind: str, child: str, inner: str = "") -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="world"/><child link="{child}"/>'
        f'<origin xyz="0 0 2"/>{inner}</joint>'
    )


def robot(*inner: str) -> str:
    return '<robot name="r"><link name="world"/>' + "".join(inner) + "</robot>"


def test_planar_joint_slides_in_its_plane_and_turns_about_its_axis(urdf):
    """With the axis tilted by 30 degrees about y, the link slides down the plane with a = g sin 30."""
    sim = Simulation(
        urdf(robot(link("puck"), joint("plane", "planar", "puck", '<axis xyz="0.5 0 0.8660254"/>')))
    )
    sim.run(0.5)
    place, (spin, _) = sim.link_pose("puck").translation, sim.robots.first.body.link_velocity("puck")
    distance = 9.81 * 0.5 * 0.5**2 / 2
    assert place.tolist() == pytest.approx([distance * 0.8660254, 0.0, 2.0 - distance * 0.5], abs=0.01)
    sim.disturbances.apply_body_wrench("puck", (0.0, 0.0, 0.0), 0.1, torque=(0.0, 0.1, 0.0))
    sim.run(0.1)
    assert sim.robots.first.body.link_velocity("puck")[0] == pytest.approx(spin, abs=1e-6), (
        "not about its own axis"
    )


def test_floating_joint_falls_freely_and_keeps_turning(urdf):
    sim = Simulation(urdf(robot(link("stone"), joint("free", "floating", "stone"))))
    sim.disturbances.apply_body_wrench("stone", (2.0, 0.0, 0.0), 0.1, torque=(0.0, 0.0, 0.01))
    sim.run(0.5)
    spin, _ = sim.robots.first.body.link_velocity("stone")
    x, y, z = sim.link_pose("stone").translation
    assert z == pytest.approx(2.0 - 9.81 * 0.5**2 / 2, abs=0.01)
    assert (x, y) == pytest.approx((0.2 * 0.05 + 0.2 * 0.4, 0.0), abs=1e-3)
    assert spin == pytest.approx((0.0, 0.0, 0.01 * 0.1 / MOMENT), abs=1e-4)


def test_mimic_joint_is_geared_to_its_leader(urdf):
    """A torque M on the leader of a pair with the ratio n accelerates it by M / (I + n^2 I)."""
    axis = '<axis xyz="0 0 1"/>'
    geared = '<mimic joint="leader" multiplier="-3" offset="0"/>'
    text = robot(
        link("a"), link("b"), joint("leader", "continuous", "a", axis),
        joint("follower", "continuous", "b", axis + geared),
    )  # fmt: skip
    sim = Simulation(urdf(text))
    sim.robots.first.command_joints({"leader": 0.2}, "effort")
    sim.run(0.5)
    rate = 0.2 / (MOMENT + 9 * MOMENT)
    assert sim.robots.first.body.joint_velocities["leader"] == pytest.approx(rate * 0.5, rel=0.01)
    assert sim.robots.first.body.joint_velocities["follower"] == pytest.approx(-3 * rate * 0.5, rel=0.01)
    assert sim.joint_positions["follower"] == pytest.approx(-3 * sim.joint_positions["leader"], abs=2e-3)
