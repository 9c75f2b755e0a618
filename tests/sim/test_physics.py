"""Bodies fall, swing, rest and slide as theory has it; what cannot be simulated says so at its line."""

from math import pi, sin, sqrt

import pytest

from kbot.sim import Simulation, SimulationDiverged
from kbot.sim.injected_faults import Kick
from kbot.text import DescriptionError, KbotError

G = 9.81

INERTIAL = (
    '<inertial><mass value="{m}"/><inertia ixx="{i}" iyy="{i}" izz="{i}" ixy="0" ixz="0" iyz="0"/></inertial>'
)


def solid(mass: float = 1.0, inertia: float = 0.01) -> str:
    return INERTIAL.format(m=mass, i=inertia)


def ball(radius: float = 0.1, mass: float = 1.0) -> str:
    return (
        f'<robot name="ball"><link name="ball">{solid(mass, 0.4 * mass * radius**2)}'
        f'<collision><geometry><sphere radius="{radius}"/></geometry></collision></link></robot>'
    )


def arm(joint: str = "", kind: str = "revolute", inertial: str | None = None) -> str:
    """A bob of 1 kg 0.5 m along x from a joint about y, one metre above a base welded to the world."""
    bob = '<inertial><origin xyz="0.5 0 0"/><mass value="1"/>'
    bob += '<inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial>'
    return (
        '<robot name="arm"><link name="world"/><link name="bob">'
        f"{bob if inertial is None else inertial}</link>"
        f'<joint name="hinge" type="{kind}"><parent link="world"/><child link="bob"/>'
        f'<origin xyz="0 0 1"/><axis xyz="0 1 0"/>{joint}</joint></robot>'
    )


def test_a_ball_is_put_on_the_ground_and_rests(urdf):
    sim = Simulation(urdf(ball(0.1)))
    assert sim.link_pose("ball").translation[2] == pytest.approx(0.1)
    sim.run(2.0)
    assert sim.link_pose("ball").translation[2] == pytest.approx(0.1, abs=2e-6)


def test_without_a_collision_a_robot_falls_freely_and_that_is_said(urdf):
    sim = Simulation(urdf(f'<robot name="stone"><link name="stone">{solid()}</link></robot>'))
    assert [d.code for d in sim.diagnostics] == ["W107"]
    sim.run(1.0)
    fallen = -sim.link_pose("stone").translation[2]
    assert fallen == pytest.approx(G / 2, rel=0.003)


def test_a_pendulum_has_its_period(urdf):
    """Small swings of a bob on a rod: 2 pi sqrt((I + m l^2) / (m g l))."""
    sim = Simulation(urdf(arm(kind="continuous")))
    period = 2 * pi * sqrt((1e-4 + 0.25) / (G * 0.5))
    sim.robots.first.set_joint("hinge", pi / 2 - 0.02)
    sim.run(3.0)
    sim.robots.first.release_joint("hinge")
    crossings = []
    before = sim.joint_positions["hinge"] - pi / 2
    while len(crossings) < 5:
        sim.step()
        now = sim.joint_positions["hinge"] - pi / 2
        if before < 0.0 <= now:
            crossings.append(sim.time)
        before = now
    measured = (crossings[-1] - crossings[0]) / 4
    assert measured == pytest.approx(period, rel=2e-3)


def test_a_pendulum_keeps_its_energy(urdf):
    """From level, without friction: never above where it began, and within 1 % after ten seconds."""
    sim = Simulation(urdf(arm(kind="continuous")))
    heights = []
    for _ in range(500):
        sim.run(0.02)
        speed, angle = sim.robots.first.body.joint_velocities["hinge"], sim.joint_positions["hinge"]
        heights.append(0.5 * (0.25 + 1e-4) * speed**2 - G * 0.5 * sin(angle))
    assert max(abs(h) for h in heights) < 0.05 * G * 0.5


def test_a_limit_stops_a_joint(urdf):
    limited = '<limit lower="-0.5" upper="0.5" effort="10" velocity="10"/>'
    sim = Simulation(urdf(arm(limited)))
    sim.run(3.0)
    assert sim.joint_positions["hinge"] == pytest.approx(0.5, abs=0.01)


def test_a_joint_whose_range_leaves_out_zero_starts_within(urdf):
    sim = Simulation(urdf(arm('<limit lower="0.3" upper="0.5" effort="10" velocity="10"/>')))
    assert sim.joint_positions["hinge"] == 0.3


def test_damping_slows_and_friction_holds(urdf):
    """Level, the bob weighs 4.905 N m on the joint: friction of 5 N m holds it, one of 4 does not."""
    for friction, moves in ((5.0, False), (4.0, True)):
        dynamics = f'<dynamics damping="0" friction="{friction}"/>'
        sim = Simulation(urdf(arm(dynamics, kind="continuous")))
        sim.run(1.0)
        assert (abs(sim.joint_positions["hinge"]) > 0.05) == moves


def test_a_held_joint_holds_within_its_effort(urdf):
    """4.905 N m are needed: 20 are enough, 2 are not."""
    for effort, holds in ((20.0, True), (2.0, False)):
        limited = f'<limit lower="-3" upper="3" effort="{effort}" velocity="10"/>'
        sim = Simulation(urdf(arm(limited)))
        sim.robots.first.set_joint("hinge", -0.5)
        sim.run(3.0)
        assert (abs(sim.joint_positions["hinge"] + 0.5) < 0.1) == holds


def test_a_mimic_joint_follows(urdf):
    second = (
        f'<link name="second">{solid(0.1, 1e-3)}</link><joint name="follower" type="revolute">'
        '<parent link="world"/><child link="second"/><axis xyz="0 0 1"/>'
        '<limit lower="-9" upper="9" effort="1" velocity="9"/>'
        '<mimic joint="hinge" multiplier="-2" offset="0.1"/></joint></robot>'
    )
    limited = '<limit lower="-3" upper="3" effort="50" velocity="10"/>'
    sim = Simulation(urdf(arm(limited).replace("</robot>", second)))
    sim.robots.first.set_joint("hinge", 0.4)
    sim.run(2.0)
    angle = sim.joint_positions["hinge"]
    assert sim.joint_positions["follower"] == pytest.approx(-2 * angle + 0.1, abs=2e-3)
    with pytest.raises(KbotError, match="mimics another"):
        sim.robots.first.set_joint("follower", 0.0)


@pytest.mark.parametrize("kind", ["planar", "floating", "prismatic", "continuous"])
def test_every_joint_type_simulates(urdf, kind):
    limited = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'
    sim = Simulation(urdf(arm(limited, kind=kind)))
    sim.run(0.2)
    height = sim.link_pose("bob").translation[2]
    falls = {"floating": True, "planar": True, "prismatic": False, "continuous": False}[kind]
    assert (height < 0.9) == falls


def test_a_box_that_can_move_is_pushed(kbot_robot):
    from kbot.world import Body, Box, Part, World
    from kbot.world.builders import at, floor

    crate = Body("crate", (Part(Box((0.1, 0.1, 0.1))),), at(0.4, 0.0, 0.05), mass=0.1)
    sim = Simulation(kbot_robot, world=World("yard", (floor(), crate)))
    sim.run(1.0)
    assert sim.models.body_poses()["crate"].translation == pytest.approx((0.4, 0.0, 0.05), abs=1e-5)
    sim.cmd_vel(0.2, 0.0)
    sim.run(3.0)
    assert sim.models.body_poses()["crate"].translation[0] > 0.45


def test_of_two_surfaces_the_slippier_counts(urdf):
    """A box on a slope of 10 degrees (tan = 0.18) stays with 0.3 on either side and slides with 0.1."""
    from kbot.world.builders import slope
    from kbot.world.world import Body, Part, World

    box = f'<robot name="box"><link name="box">{solid(1, 0.001)}<collision><geometry>'
    box += '<box size="0.1 0.1 0.1"/></geometry></collision></link></robot>'
    for friction, slides in ((0.1, True), (0.3, False)):
        plate = slope("plate", 4.0, 2.0, 10 * pi / 180, -2.0, 0.0, -0.3527 - 0.055)
        part = plate.parts[0]
        ground = Body("plate", (Part(part.shape, friction=friction, ground=True),), plate.pose)
        sim = Simulation(urdf(box), world=World("slope", (ground,)))
        sim.run(1.0)
        before = sim.link_pose("box").translation[0]
        sim.run(0.5)
        assert (abs(sim.link_pose("box").translation[0] - before) > 0.05) == slides


@pytest.mark.parametrize(
    ("description", "code", "message"),
    [
        (arm(inertial=solid(-1.0)), "W10", "bob"),
        (arm(inertial=solid(1.0, -0.1)), "W103", "negative moment"),
        (arm(inertial=solid(1.0, 0.0)), "W103", "no inertia"),
        (arm('<limit lower="1" upper="-1" effort="1" velocity="1"/>'), "W109", "above its upper"),
        (
            arm('<mimic joint="nobody"/><limit lower="-1" upper="1" effort="1" velocity="1"/>'),
            "W108",
            "'nobody'",
        ),
    ],
)
def test_what_cannot_be_simulated_is_said_at_its_line(urdf, description, code, message):
    with pytest.raises(DescriptionError, match=message) as caught:
        Simulation(urdf(description))
    worst = caught.value.diagnostics[0]
    assert worst.code.startswith(code)
    assert worst.origin is not None
    assert worst.origin.span.line == 1
    assert worst.origin.span.column > 1


def test_an_inertia_that_no_body_has_is_simulated_as_the_nearest_and_said(urdf):
    body = solid(1.0, 0.01).replace('izz="0.01"', 'izz="0.05"')
    collision = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'
    sim = Simulation(urdf(f'<robot name="r"><link name="base">{body}{collision}</link></robot>'))
    assert [d.code for d in sim.diagnostics] == ["W104"]
    assert "KBot adds 0.015" in sim.diagnostics[0].message


def test_a_missing_mesh_is_said_and_the_rest_simulated(urdf):
    mesh = '<collision><geometry><mesh filename="package://nowhere/part.stl"/></geometry></collision></link>'
    sim = Simulation(urdf(ball().replace("</link>", mesh)))
    assert "W106" in [d.code for d in sim.diagnostics]
    sim.run(0.1)


def test_a_run_that_diverges_stops_and_says_where(urdf):
    sim = Simulation(urdf(arm(kind="continuous")))
    sim.run(0.1)
    sim.engine.data.qvel[0] = float("nan")
    with pytest.raises(SimulationDiverged, match="link 'bob' flew off") as caught:
        sim.run(1.0)
    assert "between 0.100 s and 0.120 s" in str(caught.value)
    assert caught.value.diagnostics[0].origin is not None
    with pytest.raises(SimulationDiverged):
        sim.step()
    sim.reset()
    sim.run(1.0)
    assert abs(sim.joint_positions["hinge"]) < 10


def test_a_run_that_diverges_is_told_before_anyone_looks_at_it(urdf):
    """A timer within the control period, as a sensor has one, is not called any more."""
    sim = Simulation(urdf(arm(kind="continuous")))
    sim.clock.every(100.0, lambda: sim.link_pose("bob"))
    sim.engine.data.qvel[0] = float("nan")
    with pytest.raises(SimulationDiverged, match=r"between 0\.000 s and 0\.010 s"):
        sim.run(1.0)


def test_a_run_that_has_diverged_is_not_kicked(urdf):
    sim = Simulation(urdf(ball()))
    said = []
    sim.engine.data.qpos[2] = float("nan")
    sim.journal.write = lambda what, values: said.append(what)
    refused = "the run has diverged: reset it first"
    with pytest.raises(KbotError, match=refused):
        sim.models.set_twist((1.0, 0.0, 0.0))
    with pytest.raises(KbotError, match=refused):
        sim.disturbances.schedule(Kick((1.0, 0.0, 0.0)), at=sim.time)
    assert said == []
    sim.journal.write = None
    sim.reset()
    sim.models.set_twist((1.0, 0.0, 0.0))
    assert sim.ground_truth.twist.x == 1.0


def test_a_kick_that_comes_as_a_run_diverges_leaves_it_to_say_so(urdf):
    sim = Simulation(urdf(ball()))
    sim.disturbances.schedule(Kick((1.0, 0.0, 0.0)), at=0.004)
    sim.engine.data.qvel[0] = float("nan")
    with pytest.raises(SimulationDiverged):
        sim.run(0.1)


def test_a_speed_whose_square_is_no_number_is_a_run_that_diverges(urdf):
    """A force thrusts the bob to 2e202 m/s in the last step before the speeds are looked at."""
    sim = Simulation(urdf(arm(kind="prismatic")))
    sim.run(0.018)
    sim.engine.data.qfrc_applied[0] = 1e205
    with pytest.raises(SimulationDiverged, match="link 'bob' flew off"):
        sim.run(0.002)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"timestep": 0.0}, "step"),
        ({"timestep": float("nan")}, "step"),
        ({"seed": -1}, "seed"),
        ({"contacts": "as_writen"}, "did you mean 'as-written'"),
        ({"world": "emty"}, "did you mean 'empty'"),
    ],
)
def test_bad_options_are_refused(kbot_robot, options, message):
    with pytest.raises(KbotError, match=message):
        Simulation(kbot_robot, **options)


@pytest.mark.parametrize("seconds", [-1.0, float("nan"), float("inf")])
def test_a_time_that_is_none_is_refused(sim, seconds):
    with pytest.raises(KbotError, match="time to run"):
        sim.run(seconds)


def test_unknown_joints_and_links_are_named_with_the_nearest(sim):
    with pytest.raises(KbotError, match="did you mean 'left_wheel_joint'"):
        sim.robots.first.set_joint("left_wheel_joit", 0.0)
    with pytest.raises(KbotError, match="drives the robot"):
        sim.robots.first.set_joint("left_wheel_joint", 0.0)
    with pytest.raises(KbotError, match="did you mean 'left_wheel'"):
        sim.link_pose("lef_wheel")


def test_a_robot_is_put_upon_a_height_field_and_drives_on_it(kbot_robot):
    """A plain of 0.5 m that rises by one in ten along x: half a metre on it is 5 cm higher."""
    import numpy as np

    from kbot.world.world import Body, HeightField, Part, World

    heights = np.tile(0.5 + 0.1 * np.linspace(-4.0, 4.0, 81), (41, 1)) - 0.1
    field = Body("field", (Part(HeightField(heights, (8.0, 4.0)), ground=True),))
    sim = Simulation(kbot_robot, world=World("hill", (field,)))
    assert sim.link_pose("base_footprint").translation[2] == pytest.approx(0.4 + 0.03, abs=0.01)
    sim.run(1.0)
    before = sim.link_pose("base_footprint").translation
    assert before[2] == pytest.approx(0.4 + 0.1 * before[0], abs=0.005)
    sim.cmd_vel(0.2, 0.0)
    sim.run(3.0)
    after = sim.link_pose("base_footprint").translation
    assert after[0] - before[0] == pytest.approx(0.55, abs=0.08)
    assert after[2] - before[2] == pytest.approx(0.1 * (after[0] - before[0]), abs=0.003)


def test_the_engine_has_meshes_of_the_same_points_once(kbot_robot):
    import trimesh

    from kbot.world import Body, Part, TriangleMesh, World
    from kbot.world.builders import at, floor

    ball, block = trimesh.creation.icosphere(1), trimesh.creation.box((1, 1, 1))
    bodies = (
        Body(
            f"{i}", (Part(TriangleMesh(solid.vertices.copy(), solid.faces.astype("int32"))),), at(i, 3.0, 2.0)
        )
        for i, solid in enumerate((ball, ball, block))
    )
    sim = Simulation(kbot_robot, world=World("yard", (floor(), *bodies)))
    assert sim.engine.model.nmesh == 2


def test_a_start_inside_something_is_said(kbot_robot):
    from kbot.world.builders import box, floor
    from kbot.world.world import World

    world = World("full", (floor(), box("rock", (0.3, 0.3, 0.3), 0.0, 0.0)))
    sim = Simulation(kbot_robot, world=world)
    assert [d.code for d in sim.diagnostics] == ["W111"]
    assert "overlaps 'rock'" in sim.diagnostics[0].message
