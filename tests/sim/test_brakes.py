"""Joints of a driving robot that nothing commands are held where they start. Passive joints move freely."""

from math import pi, sqrt

import pytest

from kbot.sim import Simulation
from kbot.text import Severity

from .test_motion_findings import cart, joint, line_of, link

ROUND = '<cylinder radius="0.02" length="0.02"/>'
LIMITED = '<limit lower="-2" upper="2" effort="50" velocity="2"/>'
ABOUT_Y = '<axis xyz="0 1 0"/>'
HARDWARE = (
    '<ros2_control name="c" type="system"><joint name="shoulder"><command_interface name="position"/></joint>'
    "</ros2_control>"
)


def bar(name, x=0.3, mass=1.0):
    """A link without collision with its mass at x ahead."""
    inertia = '<inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/>'
    inertial = f'<inertial><origin xyz="{x} 0 0"/><mass value="{mass}"/>{inertia}</inertial>'
    return f'<link name="{name}">{inertial}</link>\n'


def below(parent, text):
    """The joint with another parent than the cart's body."""
    return text.replace('parent link="base_link"', f'parent link="{parent}"')


def arm(kind="revolute", more=LIMITED):
    return bar("arm") + joint("shoulder", kind, "arm", "0 0 0.2", ABOUT_Y + more)


def braked(simulation):
    return [d for d in simulation.diagnostics if d.code == "W147"]


def test_an_arm_that_nothing_commands_is_held(urdf):
    """The arm's weight exerts 9.81 N x 0.3 m = 2.943 N m on the joint."""
    text = cart(more=arm())
    simulation = Simulation(urdf(text))
    simulation.run(3.0)
    assert simulation.joint_positions["shoulder"] == pytest.approx(0.0, abs=1e-4)
    effort = simulation.robots.first.body.joint_efforts["shoulder"]
    assert effort == pytest.approx(-9.81 * 0.3, rel=1e-3)
    (found,) = braked(simulation)
    assert found.severity is Severity.INFO
    assert found.origin.span.line == line_of(text, 'joint name="shoulder"')
    assert (
        found.message
        == "no controller commands 'shoulder': KBot holds 1 joint where it starts, as a brake does"
    )
    simulation.robots.first.release_joint("shoulder")
    simulation.run(1.0)
    assert simulation.joint_positions["shoulder"] > 0.5


def test_an_arm_is_held_while_the_robot_drives(urdf):
    simulation = Simulation(urdf(cart(more=arm())))
    simulation.cmd_vel(0.3, 0.0)
    simulation.run(5.0)
    assert simulation.joint_positions["shoulder"] == pytest.approx(0.0, abs=1e-2)
    assert simulation.findings == ()


def test_an_effort_limit_below_the_load_is_reported(urdf):
    """2.943 N m bend the joint, which holds 1 N m."""
    text = cart(more=arm(more=LIMITED.replace("50", "1").replace("<limit", "\n<limit")))
    simulation = Simulation(urdf(text))
    simulation.run(2.0)
    (found,) = simulation.findings
    assert (found.code, found.severity) == ("W306", Severity.WARNING)
    assert found.message == (
        "'shoulder' sags: its effort limit is 1 N m, but its load is 2.94 N m, 2.94 times as much"
    )
    assert found.origin.span.line == line_of(text, '<limit lower="-2"')


def test_a_command_takes_over_from_the_brake_and_a_reset_brings_it_back(urdf):
    simulation = Simulation(urdf(cart(more=arm())))
    simulation.robots.first.set_joint("shoulder", -0.5)
    simulation.run(2.0)
    assert simulation.joint_positions["shoulder"] == pytest.approx(-0.5, abs=1e-3)
    simulation.reset()
    simulation.run(1.0)
    assert simulation.joint_positions["shoulder"] == pytest.approx(0.0, abs=1e-4)


def test_a_joint_that_a_controller_commands_is_not_braked(urdf):
    held = Simulation(urdf(cart(more=arm() + HARDWARE)))
    assert not braked(held)
    plugin = '<plugin filename="gz-sim-joint-position-controller-system" name="gz::sim::systems::X">'
    plugin = f"<gazebo>{plugin}<joint_name>shoulder</joint_name></plugin></gazebo>"
    assert not braked(Simulation(urdf(cart(more=arm() + plugin))))


def test_a_continuous_joint_in_an_arm_is_held_and_the_finding_names_eight_joints(urdf):
    """The roll joint carries its bar's weight to the side of its axis."""
    roll = bar("roll", x=0.0) + below(
        "arm", joint("turn", "continuous", "roll", "0.3 0 0", '<axis xyz="1 0 0"/>')
    )
    tip = bar("tip") + below("roll", joint("wrist", "revolute", "tip", "0.1 0.1 0", ABOUT_Y + LIMITED))
    fingers = "".join(
        bar(f"f{i}", mass=0.01)
        + below("tip", joint(f"j{i}", "prismatic", f"f{i}", "0 0 0", ABOUT_Y + LIMITED))
        for i in range(7)
    )
    simulation = Simulation(urdf(cart(mass=50.0, more=arm() + roll + tip + fingers)))
    (found,) = braked(simulation)
    assert "'shoulder', 'turn', 'wrist', 'j0'" in found.message
    assert found.message.endswith("'j4' and 2 more: KBot holds 10 joints where they start, as brakes do")
    simulation.run(2.0)
    assert max(map(abs, (simulation.joint_positions[name] for name in ("shoulder", "turn", "wrist")))) < 1e-3


def test_a_pendulum_on_a_cart_swings_freely(urdf):
    """A bob 0.3 m below a continuous joint, released at a = 0.1 rad:
    T = 2 pi sqrt((m l^2 + I) / (m g l)) (1 + a^2 / 16). The cart of 500 kg hardly moves."""
    bob = bar("bob").replace('xyz="0.3 0 0"', 'xyz="0 0 -0.3"')
    robot = urdf(cart(mass=500.0, more=bob + joint("pivot", "continuous", "bob", "0 0 0.5", ABOUT_Y)))
    simulation = Simulation(robot)
    assert not braked(simulation)
    simulation.run(1.0)
    simulation.robots.first.set_joint("pivot", 0.1)
    simulation.run(2.0)
    simulation.robots.first.release_joint("pivot")
    crossings, before = [], 0.1
    while len(crossings) < 5:
        simulation.step()
        now = simulation.joint_positions["pivot"]
        if before < 0.0 <= now:
            crossings.append(simulation.time)
        before = now
    period = 2 * pi * sqrt((0.09 + 1e-3) / (9.81 * 0.3)) * (1.0 + 0.01 / 16.0)
    assert (crossings[-1] - crossings[0]) / 4 == pytest.approx(period, rel=5e-3)


SWIVEL = joint("swivel", "revolute", "fork", "-0.2 0 -0.02", '<axis xyz="0 0 1"/>' + LIMITED)
TRAILING = bar("fork", x=0.0) + link("trailing_wheel", 0.1, ROUND)
ROLLS = below("fork", joint("rolls", "continuous", "trailing_wheel", "-0.03 0 -0.01", ABOUT_Y))


@pytest.mark.parametrize(
    "more",
    [
        TRAILING + SWIVEL + ROLLS,
        TRAILING + SWIVEL.replace("revolute", "prismatic") + ROLLS,
        (TRAILING + SWIVEL + ROLLS).replace("trailing_wheel", "t"),  # found by its shape on the ground
        bar("fan", x=0.0) + joint("spins", "continuous", "fan", "0 0 0.3", '<axis xyz="0 0 1"/>'),
        bar("fixed") + joint("shut", "revolute", "fixed", "0 0 0.3", ABOUT_Y + LIMITED.replace("2", "0", 2)),
    ],
)
def test_a_joint_on_which_the_robot_stands_or_that_spins_is_free(urdf, more):
    """A swivel of a trailing wheel, a suspension, a fan, and a joint without a range."""
    assert not braked(Simulation(urdf(cart(more=more))))


def test_a_mimic_joint_follows_a_joint_that_is_held(urdf):
    second = bar("second") + joint(
        "follower",
        "revolute",
        "second",
        "0 0.1 0.2",
        f'<axis xyz="0 0 1"/>{LIMITED}<mimic joint="shoulder"/>',
    )
    simulation = Simulation(urdf(cart(mass=20.0, more=arm() + second)))
    (found,) = braked(simulation)
    assert "follower" not in found.message
    simulation.run(1.0)
    assert simulation.joint_positions["follower"] == pytest.approx(0.0, abs=2e-3)
