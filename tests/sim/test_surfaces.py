"""`<gazebo>` settings of links and joints are simulated: springs, self-collision, gravity, fixed joints."""

from math import pi

import pytest

from kbot.sim import Simulation
from kbot.world.sdf.materials import link_colours

INERTIA = '<inertia ixx="0.004" iyy="0.004" izz="0.004" ixy="0" ixz="0" iyz="0"/>'
BALL = (
    f'<inertial><mass value="2"/>{INERTIA}</inertial>'
    '<collision><geometry><sphere radius="0.1"/></geometry></collision>'
)
HANGING = (
    '<robot name="r"><link name="world"/><link name="a">{a}</link><link name="b">{b}</link>{more}</robot>'
)


def ball(extensions: str) -> str:
    return f'<robot name="ball"><link name="ball">{BALL}</link>{extensions}</robot>'


@pytest.mark.parametrize("kp", [1e4, 1e5])
def test_link_sinks_by_its_weight_over_kp_with_contacts_as_written(urdf, kp):
    """The link sinks in by m g / kp. With the recipe, contacts are always stiff."""
    tags = f'<gazebo reference="ball"><kp>{kp}</kp><kd>1</kd></gazebo>'
    heights = {}
    for contacts in ("as-written", "recipe"):
        sim = Simulation(urdf(ball(tags)), contacts=contacts)
        sim.run(2.0)
        heights[contacts] = sim.link_pose("ball").translation[2] - 0.1
    assert heights["as-written"] == pytest.approx(-2 * 9.81 / kp, rel=0.01)
    assert heights["recipe"] == pytest.approx(0.0, abs=2e-6)


def test_stiff_contact_with_little_damping_comes_to_rest(urdf):
    """With Gazebo's default of 1e12 N/m and little damping, the stiffness is limited by the time step."""
    sim = Simulation(
        urdf(ball('<gazebo reference="ball"><kp>1e12</kp><kd>1</kd></gazebo>')), contacts="as-written"
    )
    sim.run(1.0)
    assert sim.link_pose("ball").translation[2] == pytest.approx(0.1, abs=1e-4)


def test_friction_by_direction_is_reported(urdf):
    tags = '\n<gazebo reference="ball"><mu1>1</mu1><mu2>0.1</mu2></gazebo>'
    found = Simulation(urdf(ball(tags))).diagnostics
    assert [(d.code, d.origin.span.line) for d in found] == [("W136", 2)]


def test_friction_by_direction_is_one_finding_for_links_with_the_same_friction(urdf):
    tags = "".join(
        f'\n<gazebo reference="{link}"><mu1>{mu}</mu1><mu2>0.1</mu2></gazebo>'
        for link, mu in (("ball_a", 1), ("ball_b", 1), ("ball_c", 0.5))
    )
    joints = "".join(
        f'<link name="ball_{name}"/><joint name="{name}" type="fixed"><parent link="ball"/>'
        f'<child link="ball_{name}"/></joint>'
        for name in "abc"
    )
    found = Simulation(urdf(ball(joints + tags))).diagnostics
    lines = [[d.origin.span.line, *(r.origin.span.line for r in d.related)] for d in found]
    assert ([d.code for d in found], lines) == (["W136", "W136"], [[2, 3], [4]])


def two_arms(more: str) -> str:
    """Two balls side by side on separate hinges, which would swing into each other."""

    def hung(name: str, x: float, lean: float) -> str:
        return (
            f'<joint name="{name}_joint" type="continuous"><parent link="world"/><child link="{name}"/>'
            f'<origin xyz="{x} 0 2" rpy="0 {lean} 0"/><axis xyz="0 1 0"/></joint>'
        )

    bob = BALL.replace("<inertial>", '<inertial><origin xyz="0 0 -0.5"/>').replace(
        "<collision>", '<collision><origin xyz="0 0 -0.5"/>'
    )
    joints = hung("a", -0.1, 0.6) + hung("b", 0.1, 0.0)
    return HANGING.format(a=bob, b=bob, more=joints + more)


@pytest.mark.parametrize(
    ("tags", "meets"),
    [
        ("", False),
        ('<gazebo reference="a"><selfCollide>true</selfCollide></gazebo>', False),
        (
            '<gazebo reference="a"><selfCollide>true</selfCollide></gazebo>'
            '<gazebo reference="b"><selfCollide>1</selfCollide></gazebo>',
            True,
        ),
        ("<gazebo><self_collide>1</self_collide></gazebo>", True),
    ],
)
def test_links_with_self_collide_collide_with_each_other(urdf, tags, meets):
    """The swinging ball hits the resting one only with self-collision."""
    sim = Simulation(urdf(two_arms(tags)))
    sim.run(1.0)
    moved = max(abs(sim.joint_positions["b_joint"]), abs(sim.robots.first.body.joint_velocities["b_joint"]))
    assert (moved > 0.1) == meets


@pytest.mark.parametrize("off", ["<gravity>0</gravity>", "<turnGravityOff>true</turnGravityOff>"])
def test_link_without_gravity_does_not_fall(urdf, off):
    robot = urdf(two_arms(f'<gazebo reference="a">{off}</gazebo>'))
    sim = Simulation(robot)
    sim.run(0.5)
    assert sim.joint_positions["a_joint"] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    "tag",
    [
        "",
        "<preserveFixedJoint>true</preserveFixedJoint>",
        "<disableFixedJointLumping>true</disableFixedJointLumping>",
    ],
)
def test_links_on_fixed_joints_keep_their_frames(urdf, tag):
    """Gazebo merges such links by default. KBot keeps each link's frame, and they move as one body."""
    text = (
        f'<robot name="r"><link name="base">{BALL}</link><link name="tool"/>'
        '<joint name="mount" type="fixed"><parent link="base"/><child link="tool"/>'
        f'<origin xyz="0 0 0.3" rpy="0 0 {pi / 2}"/></joint><gazebo reference="mount">{tag}</gazebo></robot>'
    )
    sim = Simulation(urdf(text))
    sim.run(0.5)
    away = sim.link_pose("base").inverse() @ sim.link_pose("tool")
    assert away.translation.tolist() == pytest.approx([0, 0, 0.3])
    assert away.yaw == pytest.approx(pi / 2)


def test_gazebo_material_names_set_link_colours(urdf):
    robot = urdf(ball('<gazebo reference="ball"><material>Gazebo/Orange</material></gazebo>'))
    assert link_colours(robot) == {"ball": (1.0, 0.51, 0.0, 1.0)}
    unknown = urdf(ball('<gazebo reference="ball"><material>Mine/Own</material></gazebo>'))
    assert link_colours(unknown) == {}
