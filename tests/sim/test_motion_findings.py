"""A run that differs from its commands or its odometry is reported, with the cause and its line."""

import json
from math import pi

import pytest

from kbot.cli.main import run
from kbot.kinematics.planar_pose import PlanarPose
from kbot.sim import Simulation
from kbot.sim.injected_faults import BlockedJoint, Kick, Slip
from kbot.sim.statics import grip, tipping
from kbot.sim.true_rolling import TrueRolling
from kbot.text import Severity

RADIUS, TRACK = 0.05, 0.3
WORLDS = ("empty", "boxes", "maze", "rooms", "corridor", "ramp:angle=10", "obstacle_course", "track")


def link(name, mass, shape, x=0.0, z=0.0, collides=True):
    """A link with a visual and a collision, and a centre of mass at x, 0, z."""
    geometry = f'<origin rpy="{pi / 2 if "cylinder" in shape else 0} 0 0"/><geometry>{shape}</geometry>'
    moment = mass * 0.001
    inertia = f'<inertia ixx="{moment}" iyy="{moment}" izz="{moment}" ixy="0" ixz="0" iyz="0"/>'
    return (
        f'<link name="{name}"><visual>{geometry}</visual>'
        + (f"<collision>{geometry}</collision>" if collides else "")
        + f'<inertial><origin xyz="{x} 0 {z}"/><mass value="{mass}"/>{inertia}</inertial></link>\n'
    )


def joint(name, kind, child, xyz, more=""):
    return (
        f'<joint name="{name}" type="{kind}"><parent link="base_link"/><child link="{child}"/>'
        f'<origin xyz="{xyz}"/>{more}</joint>\n'
    )


def cart(
    separation=TRACK,
    diameter=2 * RADIUS,
    limit="",
    caster_collides=True,
    caster_z=-0.03,
    mass=5.0,
    mass_x=0.0,
    mass_z=0.0,
    more="",
):
    """Wheels of radius 0.05 m 0.3 m apart, and a ball caster of radius 0.02 m behind them."""
    axis = '<axis xyz="0 1 0"/>'
    wheel = f'<cylinder radius="{RADIUS}" length="0.02"/>'
    return "".join(
        (
            '<robot name="cart">\n',
            link("base_link", mass, '<box size="0.3 0.2 0.04"/>', mass_x, mass_z),
            link("left", 0.3, wheel),
            link("right", 0.3, wheel),
            link("caster", 0.1, '<sphere radius="0.02"/>', collides=caster_collides),
            joint("left_joint", "continuous", "left", f"0.05 {TRACK / 2} 0", f"{axis}\n{limit}"),
            joint("right_joint", "continuous", "right", f"0.05 {-TRACK / 2} 0", f"{axis}\n{limit}"),
            joint("caster_joint", "fixed", "caster", f"-0.13 0 {caster_z}"),
            '<gazebo><plugin name="diff" filename="libgazebo_ros_diff_drive.so">\n',
            "<left_joint>left_joint</left_joint><right_joint>right_joint</right_joint>\n",
            f"<wheel_separation>{separation}</wheel_separation>\n",
            f"<wheel_diameter>{diameter}</wheel_diameter>\n",
            f"</plugin></gazebo>{more}\n</robot>\n",
        )
    )


def line_of(text, part):
    return next(number for number, line in enumerate(text.splitlines(), 1) if part in line)


def driven(robot, *commands, world="empty", **setup):
    """The simulation after commands (m/s, rad/s, s)."""
    simulation = Simulation(robot, world, **setup)
    for linear, angular, seconds in commands:
        simulation.cmd_vel(linear, angular)
        simulation.run(seconds)
    return simulation


def only(simulation):
    (found,) = simulation.findings
    return found


@pytest.mark.parametrize("world", WORLDS)
def test_a_good_robot_that_drives_freely_is_not_reported(sim, world, kbot_robot):
    simulation = driven(kbot_robot, (0.2, 0.0, 1.5), (0.0, 1.0, 3.0), (0.0, 0.0, 1.0), world=world)
    assert simulation.findings == ()
    assert not simulation.collided


def test_a_good_robot_is_not_reported_on_its_way_over_a_ramp(kbot_robot):
    """On the map the way over a slope is shorter than by odometry, which is no error of odometry."""
    simulation = driven(kbot_robot, (0.2, 0.0, 14.0), world="ramp:angle=15")
    assert simulation.findings == ()


def test_a_wrong_separation_is_reported_with_its_line_after_turns(urdf):
    """The wheels drive w b' / 2 for the declared b', so the robot turns by b' / b of what odometry reports:
    with b' = 0.27 m and b = 0.3 m, odometry is off by 1 - 0.27 / 0.3 = 10 % of what the wheels drive."""
    text = cart(separation=0.27)
    found = only(driven(urdf(text), (0.0, 1.0, 10.0)))
    assert (found.code, found.severity) == ("W301", Severity.WARNING)
    assert "odometry is 10 % off: " in found.message
    assert "(D105)" in found.message
    assert found.origin.span.line == line_of(text, "<wheel_separation>")
    assert found.hint


def test_a_wrong_separation_is_no_error_of_a_straight_drive(urdf):
    assert driven(urdf(cart(separation=0.27)), (0.2, 0.0, 10.0)).findings == ()


def test_a_wrong_radius_is_reported_with_its_line(urdf):
    """Odometry counts r' / r of the distance: with r' = 0.04 m and r = 0.05 m, 0.8 m of every metre."""
    text = cart(diameter=0.08)
    found = only(driven(urdf(text), (0.2, 0.0, 10.0)))
    assert "odometry is 20 % off: " in found.message
    assert "(D106)" in found.message
    assert found.origin.span.line == line_of(text, "<wheel_diameter>")


def test_a_limit_does_not_explain_why_a_robot_drives_too_far(urdf):
    """It drives r / r' = 0.05 / 0.04 of the command, less half of the 3 s in which it starts."""
    limit = "<max_linear_acceleration>0.1</max_linear_acceleration>"
    text = cart(diameter=0.08).replace("</plugin>", f"\n{limit}</plugin>")
    found = only(driven(urdf(text), (0.3, 0.0, 40.0)))
    assert found.code == "W301"
    assert "the robot drives 120 % of the commanded distance: " in found.message
    assert "(D106)" in found.message


@pytest.mark.parametrize(("separation", "is_reported"), [(0.3 * 1.015, False), (0.3 * 1.03, True)])
def test_only_differences_above_two_per_cent_are_reported(urdf, separation, is_reported):
    simulation = driven(urdf(cart(separation=separation)), (0.0, 1.0, 20.0))
    assert [found.code for found in simulation.findings] == ["W301"] * is_reported


def test_a_run_of_a_few_millimetres_is_not_reported(urdf):
    """Odometry is 20 % wrong, but by less than a centimetre."""
    assert driven(urdf(cart(diameter=0.08)), (0.02, 0.0, 2.0)).findings == ()


def test_a_collision_is_the_reason_and_not_the_robot(urdf):
    simulation = Simulation(urdf(cart(separation=0.27)))
    simulation.models.spawn_thing("box", "crate", x=0.8, size=(0.2, 2.0, 0.5))
    simulation.cmd_vel(0.3, 0.0)
    simulation.run(1.0)
    assert not simulation.collided
    simulation.run(9.0)
    assert simulation.collided
    for found in simulation.findings:
        assert found.severity is Severity.INFO
        assert "touched 'crate'" in found.message
        assert found.origin is None


def test_a_wall_holds_the_robot(kbot_robot):
    simulation = driven(kbot_robot, (0.3, 0.0, 15.0), world="corridor", start=PlanarPose(0.0, 0.0, pi / 2))
    assert simulation.collided
    still = next(found for found in simulation.findings if found.code == "W302")
    assert still.severity is Severity.INFO
    assert "touched 'left_wall'" in still.message


def test_a_wall_is_no_ground_on_which_a_part_drags(kbot_robot):
    """The robot hits the wall at 1 m/s, and its wheels slip while its body is pressed against the wall."""
    simulation = driven(kbot_robot, (1.0, 0.0, 4.0), world="corridor", start=PlanarPose(0.0, 0.0, pi / 2))
    assert simulation.collided
    now = grip(*simulation.engine.current(), simulation.robots.first, in_turn=False)
    assert "base_link" not in now.parts
    assert not any("drags on the ground" in found.message for found in simulation.findings)


def test_an_attachment_holds_the_robot(urdf):
    simulation = Simulation(urdf(cart()))
    simulation.models.spawn_thing("box", "crate", x=-0.5, size=(0.3, 0.3, 0.3))
    simulation.models.attach("base_link", "crate")
    simulation.cmd_vel(0.0, 2.0)
    simulation.run(6.0)
    for found in simulation.findings:
        assert found.severity is Severity.INFO
        assert "attached to something" in found.message or "touched 'crate'" in found.message


def test_a_reset_and_another_placement_clear_the_findings(urdf):
    simulation = driven(urdf(cart(diameter=0.08)), (0.2, 0.0, 5.0))
    assert simulation.findings
    state = simulation.state()
    simulation.reset()
    assert simulation.findings == ()
    simulation.restore(state)
    assert simulation.findings == ()
    simulation.run(5.0)
    assert simulation.findings
    simulation.models.set_pose(3.0, 0.0, 0.0)
    simulation.cmd_vel(0.0, 0.0)
    simulation.run(0.5)
    assert simulation.findings == ()


def test_too_little_effort_is_reported_at_the_limit(urdf):
    """Two motors of 0.001 N m pull with 2 x 0.001 / 0.05 = 0.04 N: 5.7 kg get 7 mm/s in a second."""
    text = cart(limit='<limit effort="0.0005" velocity="20"/>')
    found = only(driven(urdf(text), (0.3, 0.0, 4.0)))
    assert (found.code, found.severity) == ("W302", Severity.WARNING)
    assert "(D119)" in found.message
    assert found.origin.span.line == line_of(text, "<limit")


def test_a_velocity_limit_is_reported_at_the_limit(urdf):
    """1 rad/s on wheels of 0.05 m is 0.05 m/s, a tenth of the command."""
    text = cart(limit='<limit effort="5" velocity="1"/>')
    found = only(driven(urdf(text), (0.5, 0.0, 4.0)))
    assert found.code == "W302"
    assert "allow only 10 % of the commanded speed" in found.message
    assert "velocity limit of 1 rad/s" in found.message
    assert found.origin.span.line == line_of(text, "<limit")


@pytest.mark.parametrize(("damping", "friction"), [(0.2, 0.0), (0.0, 20.0), (0.2, 1.0), (5.0, 1.0)])
def test_damping_and_friction_do_not_slow_a_drive(urdf, damping, friction):
    """0.5 m/s x 4 s, because the start and the stop at 1 m/s^2 cancel. The tyres hold 1.4 N m, but at 10
    rad/s 0.2 N m s/rad alone need 2 N m."""
    text = cart(limit=f'<dynamics damping="{damping}" friction="{friction}"/>')
    simulation = driven(urdf(text), (0.5, 0.0, 4.0), (0.0, 0.0, 1.0))
    assert simulation.ground_truth.pose.x == pytest.approx(2.0, abs=1e-3)
    assert simulation.findings == ()


def test_damping_does_not_let_a_robot_climb_a_wall(urdf):
    """A blocked wheel has no damping that the motor must overcome."""
    world = urdf(cart(limit='<dynamics damping="2"/>'))
    simulation = Simulation(world, "corridor", start=PlanarPose(0.0, 0.0, pi / 2))
    simulation.cmd_vel(0.3, 0.0)
    simulation.run(15.0)
    assert simulation.collided
    assert simulation.link_pose("base_link").translation[2] < 0.06


@pytest.mark.parametrize(
    ("effort", "damping", "friction", "speed", "needed"),
    [(1.5, 0.2, 0.0, 7.5, 2.0), (1.5, 0.2, 1.0, 2.5, 3.0), (1.5, 0.0, 2.0, 0.0, 2.0)],
)
def test_an_effort_limit_below_damping_and_friction_limits_the_speed(
    urdf, effort, damping, friction, speed, needed
):
    """The motor turns its wheel at (effort - friction) / damping, and needs damping x 10 rad/s + friction."""
    text = cart(
        limit=f'<limit effort="{effort}" velocity="0"/><dynamics damping="{damping}" friction="{friction}"/>'
    )
    simulation = driven(urdf(text), (0.5, 0.0, 5.0))
    turns = simulation.robots.first.body.joint_velocities["left_joint"]
    assert turns == pytest.approx(speed, abs=1e-3)
    found = only(simulation)
    assert (found.code, found.severity) == ("W306" if speed else "W302", Severity.WARNING)
    assert found.message.endswith(
        "the effort limit of 'left_joint' is 1.5 N m, but at 10 rad/s its damping and friction need"
        f" {needed:g} N m, {needed / 1.5:.3g} times as much"
    )
    assert found.origin.span.line == line_of(text, "<limit")
    assert found.hint.startswith(f"write at least {needed:g} N m")


def test_a_plugin_s_torque_limit_is_reported_at_it(urdf):
    limit = "<max_wheel_torque>1.5</max_wheel_torque>"
    text = cart(limit='<dynamics damping="0.2"/>').replace("</plugin>", f"\n{limit}</plugin>")
    found = only(driven(urdf(text), (0.5, 0.0, 5.0)))
    assert found.code == "W306"
    assert "turns at 7.5 of the commanded 10 rad/s: the drive's torque limit of 'left_joint'" in found.message
    assert found.origin.span.line == line_of(text, limit)


def test_a_motor_that_is_weak_for_a_moment_is_an_info_about_the_distance(urdf):
    """0.05 N m at each wheel of 0.05 m pull with 2 N. They accelerate 5.7 kg, and the spin of the wheels,
    0.24 kg at the rim, at 0.34 m/s^2. Of 1.5 m the robot misses 0.3^2 / (2 x 0.34) = 0.13 m."""
    text = cart(limit='<limit effort="0.05" velocity="20"/>')
    assert driven(urdf(text), (0.3, 0.0, 2.0)).findings == ()
    found = only(driven(urdf(text), (0.3, 0.0, 5.0)))
    assert (found.code, found.severity) == ("W307", Severity.INFO)
    assert found.message.startswith(
        "the robot drives 90 % of the commanded distance in 4.5 s: the effort limit"
    )
    assert found.origin.span.line == line_of(text, "<limit")
    assert driven(urdf(text), (0.3, 0.0, 10.0)).findings == ()  # only 4 % is missing now


@pytest.mark.parametrize(
    ("limit", "command", "reported", "severity"),
    [
        ("max_linear_velocity>0.2", (0.3, 0.0), "drives 65 % of the commanded distance", Severity.WARNING),
        ("max_angular_velocity>0.25", (0.0, 0.5), "turns 49 % of the commanded angle", Severity.WARNING),
        ("max_linear_acceleration>0.1", (0.3, 0.0), "drives 66 % of the commanded distance", Severity.INFO),
        ("max_angular_jerk>0.1", (0.0, 0.5), "turns 49 % of the commanded angle", Severity.INFO),
    ],
)
def test_a_limit_below_a_steady_command_is_reported_at_it(urdf, limit, command, reported, severity):
    """At the last sample, 4.48 s, with 1 % for the servo: 0.2 / 0.3 less the start, 0.25 / 0.5, and of 1.344
    m 0.3^2 / 0.2 m = 0.45 m are missing. With a jerk of 0.1 rad/s^3, 0.5 rad/s takes 4.47 s, half of which is
    missing."""
    name = limit.partition(">")[0]
    text = cart().replace("</plugin>", f"\n<{limit}</{name}></plugin>")
    found = only(driven(urdf(text), (*command, 5.0)))
    assert (found.code, found.severity) == ("W307", severity)
    assert found.message.startswith(f"the robot {reported} in 4.5 s: diff limits it")
    assert name in found.message
    assert found.origin.span.line == line_of(text, f"<{limit}")


@pytest.mark.parametrize(
    "commands",
    [
        [(1.0, 0.0, 3.0)],  # the start takes 17 % of it
        [(0.3, 1.0, 5.0)],
        [(0.0, 2.9, 5.0)],
        [(0.0, 0.0, 1.33), (0.5, 0.0, 4.0)],
        [(1.0, 0.0, 2.0), (0.1, 0.0, 4.0)],  # braking takes it 0.4 m
        [(0.1, 0.0, 0.7), (-0.1, 0.0, 0.7)] * 4,
    ],
)
def test_an_ordinary_start_is_not_reported(urdf, commands):
    assert driven(urdf(cart()), *commands).findings == ()


def test_wheels_that_roll_sideways_are_reported(urdf):
    """The cart, turned by 90 degrees about z."""
    text = cart()
    for old, new in (
        (f'rpy="{pi / 2} 0 0"', f'rpy="0 {pi / 2} 0"'),
        ('<axis xyz="0 1 0"/>', '<axis xyz="-1 0 0"/>'),
        ('"0.05 0.15 0"', '"-0.15 0.05 0"'),
        ('"0.05 -0.15 0"', '"0.15 0.05 0"'),
        ('"-0.13 0 -0.03"', '"0 -0.13 -0.03"'),
    ):
        assert old in text
        text = text.replace(old, new)
    found = only(driven(urdf(text), (0.3, 0.0, 5.0)))
    assert (found.code, found.severity) == ("W307", Severity.WARNING)
    assert found.message == (
        "the robot drives 0 % of the commanded distance in 4.5 s: the wheels roll along +y of 'base_link':"
        " the robot drives there, but commands and odometry mean +x (D132)"
    )
    assert found.origin.span.line == line_of(text, '<origin xyz="-0.15 0.05 0"')


FAST = cart(limit='<limit effort="5" velocity="20"/>')
"""20 rad/s on wheels of 0.05 m, 0.3 m apart: 1 m/s, and 2 / 0.3 rad/s."""


@pytest.mark.parametrize(
    ("linear", "angular", "text", "hint"),
    [
        (
            250.0,
            0.0,
            "the command of 250 m/s since 0.1 s is far above the 1 m/s that",
            "250 mm/s are 0.25 m/s",
        ),
        (-250.0, 0.1, "the command of 250 m/s", "250 mm/s are 0.25 m/s"),
        (0.0, 90.0, "90 rad/s since 0.1 s is far above the 6.67 rad/s that", "90 degrees/s are 1.57 rad/s"),
        (1e5, 0.0, "the command of 100000 m/s", "command a lower speed, in m/s and rad/s"),
        (0.0, 1000.0, "the command of 1000 rad/s", "command a lower speed, in m/s and rad/s"),
    ],
)
def test_a_command_far_above_the_limit_is_reported_with_both_numbers(urdf, linear, angular, text, hint):
    found = only(driven(urdf(FAST), (linear, angular, 1.0)))
    assert found.code == "W305"
    assert text in found.message
    assert found.message.endswith("that the drive allows: 'left_joint' has a velocity limit of 20 rad/s")
    assert found.hint.endswith(hint)
    assert found.origin.span.line == line_of(FAST, "<limit")
    assert only(driven(urdf(FAST), (linear, angular, 4.0))).code == "W305"  # and not W302


def test_a_command_far_above_the_controller_s_limit_is_reported_at_it(urdf):
    limit = "<max_linear_velocity>0.5</max_linear_velocity>"
    text = FAST.replace("</plugin>", f"\n{limit}</plugin>")
    found = only(driven(urdf(text), (200.0, 0.0, 1.0)))
    assert found.message.endswith("0.5 m/s that the drive allows: diff limits it with max_linear_velocity")
    assert found.origin.span.line == line_of(text, limit)


@pytest.mark.parametrize(
    "commands",
    [
        [(1.1, 0.0, 3.0)],
        [(3.0, 0.0, 3.0)],
        [(0.0, 12.0, 3.0)],
        [(250.0, 0.0, 0.3), (0.2, 0.0, 3.0)],
        [(30.0 - 0.01 * i, 0.0, 0.1) for i in range(18)],  # a gain times a large distance
        [(250.0, 0.0, 0.3), (0.0, 0.0, 0.3)] * 5,
    ],
)
def test_a_command_that_is_a_little_or_briefly_too_fast_is_not_reported(urdf, commands):
    assert "W305" not in [found.code for found in driven(urdf(FAST), *commands).findings]


def test_a_changing_command_that_stays_far_above_the_limit_is_reported(urdf):
    simulation = driven(urdf(FAST), *[(200.0 + i, 0.0, 0.1) for i in range(23)])
    assert only(simulation).code == "W305"
    simulation.reset()
    assert simulation.findings == ()


def test_wheels_in_the_air_are_reported_at_the_caster(urdf):
    """A caster 30 mm too low lifts the wheels: robot and wheels tilt, and at least one wheel hangs."""
    text = cart(caster_z=-0.06, mass=20.0)
    simulation = driven(urdf(text), (0.2, 0.5, 10.0))
    codes = [finding.code for finding in simulation.findings]
    assert len({"W301", "W302"} & set(codes)) == 1, "wheels that move nothing are one fault"
    found = simulation.findings[-1]
    assert found.code in ("W301", "W302")
    assert "caster" in found.message
    assert found.origin.span.line == line_of(text, '<link name="caster"')


def test_a_caster_without_collision_is_below_the_floor(urdf):
    text = cart(caster_collides=False)
    (found, *_) = driven(urdf(text), (0.0, 0.0, 2.0)).findings
    assert (found.code, found.severity) == ("W304", Severity.WARNING)
    assert found.message.startswith("'caster' reaches ")
    assert found.origin.span.line == line_of(text, '<link name="caster"')


def test_a_visual_below_the_floor_does_not_matter_if_the_link_has_a_collision(urdf):
    """Such as the marker at the origin of a robot's base_footprint."""
    shapes = (
        '<visual><geometry><box size="0.05 0.05 0.4"/></geometry></visual>'
        '<collision><origin xyz="0 0 0.1"/><geometry><sphere radius="0.01"/></geometry></collision>'
    )
    marker = (
        f'<link name="marker">{shapes}</link><joint name="marker_joint" type="fixed">'
        '<parent link="base_link"/><child link="marker"/></joint>'
    )
    assert driven(urdf(cart(more=marker)), (0.2, 0.0, 2.0)).findings == ()


def test_a_contact_that_is_too_soft_is_reported(urdf):
    """Springs of 500 N/m under wheels that carry most of 51 kg, 500 N, sink in by centimetres."""
    soft = "".join(
        f'<gazebo reference="{side}"><kp>500</kp><kd>10</kd></gazebo>' for side in ("left", "right")
    )
    robot = urdf(cart(mass=50.0, more=soft))
    assert driven(robot, (0.0, 0.0, 2.0)).findings == ()  # KBot's own contacts are stiff
    (found,) = driven(robot, (0.0, 0.0, 2.0), contacts="as-written").findings
    assert found.code == "W304"
    assert "its contact is too soft for the weight" in found.message


def test_a_robot_without_collisions_falls_through_the_floor(urdf):
    ball = '<sphere radius="0.1"/>'
    robot = urdf(f'<robot name="ball">{link("ball", 1.0, ball, collides=False)}</robot>')
    simulation = Simulation(robot)
    simulation.run(1.0)
    found = only(simulation)
    assert found.code == "W304"
    assert "no link has a <collision>" in found.message


def test_a_robot_that_tips_is_reported_with_the_rule_that_explains_it(urdf):
    """The centre of mass is 0.3 m behind the axle and 0.17 m behind the caster."""
    text = cart(mass_x=-0.3, mass_z=0.2, mass=20.0)
    found = only(driven(urdf(text), (0.0, 0.0, 3.0)))
    assert (found.code, found.severity) == ("W303", Severity.WARNING)
    assert "(D115)" in found.message
    assert found.origin.span.line == line_of(text, '<link name="base_link"')


def test_a_robot_that_tips_onto_a_part_of_it_is_reported(urdf):
    """The centre of mass is ahead of the axle and behind the body's front edge, which is 0.1 m ahead of the
    axle and 0.02 m below it. The edge is on the ground at a = 18 degrees: 0.1 sin a + 0.02 cos a = 0.05."""
    text = cart(mass_x=0.12, mass=20.0)
    found = only(driven(urdf(text), (0.0, 0.0, 3.0)))
    assert (found.code, found.severity) == ("W303", Severity.WARNING)
    assert found.message.startswith("the robot leans by 18 degrees and rests on 'base_link': ")
    assert "(D115)" in found.message
    assert found.origin.span.line == line_of(text, '<link name="base_link"')


def test_a_part_that_drags_on_the_ground_is_the_reason_for_slip(urdf):
    """A box of 8 kg on a hinge drops to the ground. Its friction exceeds that of the wheels under 5.7 kg."""
    boom = link("boom", 0.1, '<box size="0.1 0.01 0.01"/>', collides=False)
    boom += joint("hinge", "continuous", "boom", "-0.06 0 0", '<axis xyz="0 1 0"/>')
    box = link("sled", 8.0, '<box size="0.02 0.02 0.02"/>')
    text = cart(more=boom + box + joint("s", "fixed", "sled", "-0.1 0 0").replace("base_link", "boom"))
    found = driven(urdf(text), (0.3, 0.0, 4.0)).findings[-1]
    assert found.code in ("W301", "W302")
    assert "'sled' drags on the ground" in found.message
    assert found.origin.span.line == line_of(text, '<link name="sled"')


def test_a_push_is_the_reason_for_a_fall(kbot_robot):
    simulation = Simulation(kbot_robot)
    simulation.run(1.0)
    # it flies for 2 x 2 / 9.81 = 0.4 s, in which it turns by 8 x 0.4 = 3.3 rad
    simulation.disturbances.schedule(Kick((0.0, 0.0, 2.0), (8.0, 0.0, 0.0)), at=1.4)
    simulation.run(0.75)
    found = simulation.findings[0]
    assert (found.code, found.severity) == ("W303", Severity.INFO)
    assert "the fault Kick acted on it" in found.message


def test_a_push_is_the_reason_for_wrong_odometry(urdf):
    simulation = Simulation(urdf(cart()))
    simulation.run(1.0)
    simulation.disturbances.apply_body_wrench("base_link", (0.0, 100.0, 0.0), 1.0)
    simulation.run(2.0)
    found = simulation.findings[-1]
    assert (found.code, found.severity) == ("W301", Severity.INFO)
    assert "a push acted on it" in found.message


@pytest.mark.parametrize(
    ("faults", "code"),
    [((Slip("left", 0.0),), "W301"), ((BlockedJoint("left_joint"), BlockedJoint("right_joint")), "W302")],
)
def test_an_injected_fault_is_the_reason(urdf, faults, code):
    simulation = Simulation(urdf(cart()))
    for fault in faults:
        simulation.disturbances.schedule(fault, at=1.0)
    simulation.cmd_vel(0.3, 0.0)
    simulation.run(2.0)
    simulation.cmd_vel(0.0, 1.0)
    simulation.run(4.0)
    found = only(simulation)
    assert (found.code, found.severity) == (code, Severity.INFO)
    assert f"the fault {type(faults[0]).__name__} acted on it" in found.message


def test_a_robot_that_spins_fast_is_not_reported(urdf):
    """10 rad/s, on wheels that hold: more than a turn between two looks."""
    simulation = driven(urdf(cart()), (0.0, 10.0, 10.0), (0.0, 0.0, 2.0))
    assert simulation.ground_truth.unwrapped_yaw > 14 * 2 * pi
    assert simulation.findings == ()


@pytest.mark.parametrize(
    ("command", "start"),
    [
        ((1000.0, 0.0), "reaching 1000 m/s takes 1000 s with KBot's default limit of 1 m/s^2"),
        ((0.0, 1e6), "reaching 1e+06 rad/s takes 1.25e+05 s with KBot's default limit of 8 rad/s^2"),
    ],
)
@pytest.mark.parametrize("seconds", [6.0, 14.0])
def test_an_extreme_command_is_the_cause_and_not_a_wheel(urdf, command, start, seconds):
    """Without a limit of speed the drive accelerates with KBot's default of 1 m/s^2 and 8 rad/s^2. After
    14 s the robot drives 14 m/s, or spins, bounces and flies."""
    simulation = driven(urdf(cart()), (*command, seconds))
    (first, *_) = (found for found in simulation.findings if found.code == "W302")
    assert first.message.endswith(start)
    for found in simulation.findings:
        assert found.code != "W309"
        assert found.origin is None
        assert "lower" not in found.hint or found.hint == "command a lower speed, in m/s and rad/s"


def test_a_small_fault_is_not_the_cause_of_a_large_error(urdf):
    """Ice on one wheel, and a separation that is 3 % off: it explains 3 % of the error of a turn."""
    ice = '<gazebo reference="left"><mu1>0.001</mu1></gazebo>'
    text = cart(separation=0.309, more=ice)
    found = driven(urdf(text), (0.0, 2.0, 5.0)).findings[-1]
    assert found.code == "W301"
    assert "(D105)" not in found.message
    assert "coefficient of friction of 'left'" in found.message
    assert found.origin.span.line == line_of(text, '<link name="left"')


def test_several_axles_are_the_cause_and_not_a_separation(urdf):
    """A wheel separation that is 2 % too small explains 2 % of the heading. The robot is heavy at the front:
    its front axle holds, the rear axle slides, and the middle of all wheels circles around the front axle,
    5 cm ahead, which odometry does not know."""
    axis = '<axis xyz="0 1 0"/>'
    rear = "".join(
        link(name, 0.3, f'<cylinder radius="{RADIUS}" length="0.02"/>')
        + joint(f"{name}_joint", "continuous", name, f"-0.05 {y} 0", axis)
        for name, y in (("rear_left", TRACK / 2), ("rear_right", -TRACK / 2))
    )
    names = "<left_joint>rear_left_joint</left_joint><right_joint>rear_right_joint</right_joint>"
    text = cart(separation=TRACK * 0.98, mass_x=0.045, caster_z=0.02, more=rear)
    text = text.replace("</plugin>", f"{names}<num_wheel_pairs>2</num_wheel_pairs></plugin>")
    found = only(driven(urdf(text), (0.0, 0.5, 8.0)))
    assert (found.code, found.severity) == ("W301", Severity.INFO)
    assert "a turn drags the wheels of 2 axles across the ground" in found.message
    assert "(D105)" not in found.message


@pytest.mark.parametrize(
    ("setup", "edit", "odometry", "true"),
    [
        ({}, ("", ""), (0.3, 0.0, 0.0), (0.3, 0.0, 0.0)),
        ({"separation": 0.27}, ("", ""), (0.0, 0.0, 1.0), (0.0, 0.0, 0.9)),
        ({"diameter": 0.08}, ("", ""), (0.8, 0.0, 0.0), (1.0, 0.0, 0.0)),
        ({"diameter": 0.08}, ("", ""), (0.0, 0.0, 0.8), (0.0, 0.0, 1.0)),
        ({}, ('xyz="0 1 0"', 'xyz="0 -1 0"'), (0.5, 0.0, 0.0), (-0.5, 0.0, 0.0)),
    ],
)
def test_the_true_sizes_and_axes_give_the_motion_without_slip(urdf, setup, edit, odometry, true):
    """b' / b of the turn, r / r' of everything, and the other direction if a positive speed drives
    backwards."""
    robot = Simulation(urdf(cart(**setup).replace(*edit))).robots.first
    forward, left, turn = TrueRolling(robot).motion(odometry)
    assert (forward, left, turn) == pytest.approx(true, abs=1e-9)


def test_the_acceleration_that_tips_follows_from_the_supports(urdf):
    """The centre of mass is (0.6 x 0.05 - 0.1 x 0.13) / 5.7 = 3 mm ahead of the base, 47 mm behind the axle,
    and 0.1 x 0.03 / 5.7 = 0.5 mm below it, 49.5 mm above the ground: 9.81 x 47.0 / 49.5 = 9.32 m/s^2."""
    tips, off = tipping(Simulation(urdf(cart())).robots.first)
    assert (tips, off) == pytest.approx((9.32, 0.0470), rel=2e-3)


def test_the_friction_of_contacts_is_what_tyres_push_and_parts_drag(urdf):
    """All of the weight is on tyres and caster with a coefficient of friction of 1: together 9.81 m/s^2. The
    caster, 0.18 m behind the axle, bears 0.047 / 0.18 of it."""
    robot = urdf(cart(more='<gazebo reference="base_link"><mu1>1</mu1></gazebo>'))
    simulation = Simulation(robot, contacts="as-written")
    simulation.run(2.0)
    now = grip(*simulation.engine.current(), simulation.robots.first, in_turn=False)
    assert now.push + now.drag == pytest.approx(9.81, rel=0.01)
    assert now.drag == pytest.approx(9.81 * 0.047 / 0.18, rel=0.02)
    assert now.parts == ("caster",)
    assert now.missing(1.0) == 0.0
    assert now.missing(10.0) == pytest.approx(1.0 - (now.push - now.drag) / 10.0)
    in_turn = grip(*simulation.engine.current(), simulation.robots.first, in_turn=True)
    assert in_turn.drag == pytest.approx(now.drag * 0.18 / (TRACK / 2), rel=0.02)


def test_exchanged_sides_explain_all_of_the_error(urdf):
    """The robot turns to the other side, so that the heading is off by twice the turn."""
    text = cart().replace(
        "<left_joint>left_joint</left_joint><right_joint>right_joint</right_joint>",
        "\n<left_joint>right_joint</left_joint><right_joint>left_joint</right_joint>",
    )
    found = only(driven(urdf(text), (0.0, 1.0, 5.0)))
    assert "(D107)" in found.message
    assert found.origin.span.line == line_of(text, "<left_joint>right")


def test_an_unknown_cause_is_said_to_be_unknown(urdf):
    """The engine's wheels are 5 % larger than those of the description, which no rule can know."""
    simulation = Simulation(urdf(cart()))
    model = simulation.engine.model
    for side in ("left", "right"):
        geoms = model.geom_bodyid == simulation.robots.first.body.index(side)
        model.geom_size[geoms, 0] *= 1.05
    simulation.cmd_vel(0.2, 0.0)
    simulation.run(8.0)
    found = simulation.findings[-1]
    assert found.code == "W301"
    assert found.message.endswith("the wheels slip, and the cause is not known")
    assert found.origin is None


@pytest.mark.parametrize("period", [0.1, 0.2, 0.46, 0.5])
def test_a_command_that_is_switched_on_and_off_is_not_reported(urdf, period):
    simulation = driven(urdf(cart()), *[(0.2, 0.0, period / 2), (0.0, 0.0, period / 2)] * 40)
    assert simulation.findings == ()


@pytest.mark.parametrize("wait", [3.0, 3.2, 3.4, 3.55])
def test_a_command_after_a_pause_is_not_reported(kbot_robot, wait):
    sim = Simulation(kbot_robot)
    sim.run(wait)
    sim.cmd_vel(0.36, 0.0)
    sim.run(0.4)  # less than a sample: it may begin just before one
    sim.cmd_vel(0.0, 0.0)
    sim.run(3.0)
    assert sim.findings == ()


def test_ice_is_reported_at_the_wheel(urdf):
    ice = "".join(f'<gazebo reference="{side}"><mu1>0.001</mu1></gazebo>' for side in ("left", "right"))
    text = cart(more=ice)
    (*_, found) = driven(urdf(text), (0.3, 0.0, 3.0), (0.0, 2.0, 5.0)).findings
    assert "coefficient of friction of 'left' is only 0.001" in found.message
    assert found.origin.span.line == line_of(text, '<link name="left"')


def test_scrubbing_casters_are_reported_with_contacts_as_written(urdf):
    """A fixed caster with the default friction drags: with KBot's own contacts it slides freely."""
    text = cart(more='<gazebo reference="base_link"><mu1>1</mu1></gazebo>')
    robot = urdf(text)
    commands = ((0.0, 1.0, 10.0), (0.2, 0.5, 10.0))
    assert driven(robot, *commands).findings == ()
    (found,) = driven(robot, *commands, contacts="as-written").findings
    assert found.code == "W301"
    assert "(D118)" in found.message


def test_findings_are_printed_and_in_the_json_report(tmp_path, capsys):
    file = tmp_path / "cart.urdf"
    file.write_text(cart(separation=0.27))
    words = ["sim", str(file), "--headless", "--duration", "10", "--cmd-vel", "0,1"]
    assert run(words) == 0
    line = line_of(file.read_text(), "<wheel_separation>")
    assert f"{file}:{line}:19: warning: odometry is " in capsys.readouterr().err
    assert run([*words, "--json"]) == 0
    (found,) = json.loads(capsys.readouterr().out)["findings"]
    assert (found["code"], found["file"], found["line"]) == ("W301", str(file), line)


def test_the_watch_does_not_change_the_run(kbot_robot):
    watched, plain = Simulation(kbot_robot, "boxes"), Simulation(kbot_robot, "boxes")
    for simulation in (watched, plain):
        simulation.cmd_vel(0.3, 0.4)
        for _ in range(100):
            simulation.run(0.02)
            if simulation is watched:
                assert simulation.findings is not None
                assert simulation.collided in (True, False)
    assert watched.state_sha256() == plain.state_sha256()
