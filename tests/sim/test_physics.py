"""Bodies fall, swing, rest and slide as theory predicts. Errors are reported at their line."""

from math import pi, sin, sqrt

import numpy as np
import pytest

from kbot.kinematics.planar_pose import PlanarPose
from kbot.sim import Simulation, SimulationDiverged
from kbot.sim.engine.geometry import distinct
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
    """A bob of 1 kg, 0.5 m along x from a joint about y, 1 m above a base that is welded to the world."""
    bob = '<inertial><origin xyz="0.5 0 0"/><mass value="1"/>'
    bob += '<inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial>'
    return (
        '<robot name="arm"><link name="world"/><link name="bob">'
        f"{bob if inertial is None else inertial}</link>"
        f'<joint name="hinge" type="{kind}"><parent link="world"/><child link="bob"/>'
        f'<origin xyz="0 0 1"/><axis xyz="0 1 0"/>{joint}</joint></robot>'
    )


def test_ball_is_placed_on_the_ground_and_rests(urdf):
    sim = Simulation(urdf(ball(0.1)))
    assert sim.link_pose("ball").translation[2] == pytest.approx(0.1)
    sim.run(2.0)
    assert sim.link_pose("ball").translation[2] == pytest.approx(0.1, abs=2e-6)


def test_robot_without_collisions_falls_with_a_warning(urdf):
    sim = Simulation(urdf(f'<robot name="stone"><link name="stone">{solid()}</link></robot>'))
    assert [d.code for d in sim.diagnostics] == ["W107"]
    sim.run(1.0)
    fallen = -sim.link_pose("stone").translation[2]
    assert fallen == pytest.approx(G / 2, rel=0.003)


def test_pendulum_has_its_period(urdf):
    """The period of small swings is 2 pi sqrt((I + m l^2) / (m g l))."""
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


def test_pendulum_keeps_its_energy(urdf):
    """Released at level without friction, it never rises above its start, and is within 1 % after 10 s."""
    sim = Simulation(urdf(arm(kind="continuous")))
    heights = []
    for _ in range(500):
        sim.run(0.02)
        speed, angle = sim.robots.first.body.joint_velocities["hinge"], sim.joint_positions["hinge"]
        heights.append(0.5 * (0.25 + 1e-4) * speed**2 - G * 0.5 * sin(angle))
    assert max(abs(h) for h in heights) < 0.05 * G * 0.5


def test_limit_stops_a_joint(urdf):
    limited = '<limit lower="-0.5" upper="0.5" effort="10" velocity="10"/>'
    sim = Simulation(urdf(arm(limited)))
    sim.run(3.0)
    assert sim.joint_positions["hinge"] == pytest.approx(0.5, abs=0.01)


def test_joint_whose_range_excludes_zero_starts_within_it(urdf):
    sim = Simulation(urdf(arm('<limit lower="0.3" upper="0.5" effort="10" velocity="10"/>')))
    assert sim.joint_positions["hinge"] == 0.3


def test_damping_slows_and_friction_holds(urdf):
    """The level bob exerts 4.905 N m on the joint: friction of 5 N m holds it, 4 N m does not."""
    for friction, moves in ((5.0, False), (4.0, True)):
        dynamics = f'<dynamics damping="0" friction="{friction}"/>'
        sim = Simulation(urdf(arm(dynamics, kind="continuous")))
        sim.run(1.0)
        assert (abs(sim.joint_positions["hinge"]) > 0.05) == moves


def test_held_joint_holds_within_its_effort(urdf):
    """4.905 N m are needed: 20 N m are enough, 2 N m are not."""
    for effort, holds in ((20.0, True), (2.0, False)):
        limited = f'<limit lower="-3" upper="3" effort="{effort}" velocity="10"/>'
        sim = Simulation(urdf(arm(limited)))
        sim.robots.first.set_joint("hinge", -0.5)
        sim.run(3.0)
        assert (abs(sim.joint_positions["hinge"] + 0.5) < 0.1) == holds


def test_mimic_joint_follows_its_leader(urdf):
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


def test_movable_box_is_pushed(kbot_robot):
    from kbot.world import Body, Box, Part, World
    from kbot.world.builders import at, floor

    crate = Body("crate", (Part(Box((0.1, 0.1, 0.1))),), at(0.4, 0.0, 0.05), mass=0.1)
    sim = Simulation(kbot_robot, world=World("yard", (floor(), crate)))
    sim.run(1.0)
    assert sim.models.body_poses()["crate"].translation == pytest.approx((0.4, 0.0, 0.05), abs=1e-5)
    sim.cmd_vel(0.2, 0.0)
    sim.run(3.0)
    assert sim.models.body_poses()["crate"].translation[0] > 0.45


def test_lower_friction_of_two_surfaces_applies(urdf):
    """On a slope of 10 degrees (tan = 0.18) a box rests with 0.3 on both sides, and slides if one is 0.1."""
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
        (arm('<limit lower="1" upper="-1" effort="1" velocity="1"/>'), "W109", "above its upper"),
        (
            arm('<mimic joint="nobody"/><limit lower="-1" upper="1" effort="1" velocity="1"/>'),
            "W108",
            "'nobody'",
        ),
    ],
)
def test_errors_of_a_description_are_reported_at_their_line(urdf, description, code, message):
    with pytest.raises(DescriptionError, match=message) as caught:
        Simulation(urdf(description))
    worst = caught.value.diagnostics[0]
    assert worst.code.startswith(code)
    assert worst.origin is not None
    assert worst.origin.span.line == 1
    assert worst.origin.span.column > 1


def test_impossible_inertia_is_replaced_by_the_nearest_with_a_warning(urdf):
    body = solid(1.0, 0.01).replace('izz="0.01"', 'izz="0.05"')
    collision = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'
    sim = Simulation(urdf(f'<robot name="r"><link name="base">{body}{collision}</link></robot>'))
    assert [d.code for d in sim.diagnostics] == ["W104"]
    assert "KBot adds 0.015" in sim.diagnostics[0].message


BEAM = '<collision><geometry><box size="0.4 0.2 0.1"/></geometry></collision>'


def test_negative_moment_is_replaced_with_a_warning_and_the_link_swings(urdf):
    """The nearest body to the moments -0.01, 0.02 and 0.03 is a rod. It has a thickness of a hundredth."""
    moments = '<inertia ixx="0.03" iyy="-0.01" izz="0.02" ixy="0" ixz="0" iyz="0"/>'
    inertial = f'<inertial><origin xyz="0.5 0 0"/><mass value="1"/>{moments}</inertial>'
    sim = Simulation(urdf(arm(kind="continuous", inertial=inertial)))
    (warning,) = (d for d in sim.diagnostics if d.code != "W107")
    assert (warning.code, warning.is_error) == ("W104", False)
    assert "smallest principal moment is -0.01 kg m^2" in warning.message
    assert warning.message.endswith("principal moments 6e-06, 0.03, 0.03 kg m^2")
    assert warning.origin.span.text == moments
    sim.run(0.5)
    assert sim.link_pose("bob").rpy[1] > 0.5


@pytest.mark.parametrize(
    ("shape", "inertia", "expected"),
    [
        # a box of m = 1.2 kg: m / 12 (b^2 + c^2)
        (BEAM, 0.0, "has no inertia. KBot uses that of a box around its shapes: 0.005, 0.017, 0.02 kg m^2"),
        (BEAM, -0.1, "above 0. KBot uses that of a box around its shapes: 0.005, 0.017, 0.02 kg m^2"),
        # a cube of water with an edge of (1.2 / 1000)^(1/3) m: m a^2 / 6
        ("", 0.0, "a cube of water: 0.002258, 0.002258, 0.002258 kg m^2"),
    ],
)
def test_moving_link_without_inertia_gets_that_of_its_shapes(urdf, shape, inertia, expected):
    sim = Simulation(urdf(arm(kind="continuous", inertial=solid(1.2, inertia) + shape)))
    (warning,) = (d for d in sim.diagnostics if d.code != "W107")
    assert (warning.code, warning.is_error) == ("W103", False)
    assert expected.removeprefix("has ") in warning.message
    sim.run(0.1)


def test_flat_inertia_is_accepted_despite_rounding(urdf):
    """Its largest moment is the sum of the others, like that of a plate. The engine rounds it to more."""
    moments = '<inertia ixx="88e-6" ixy="-1e-6" iyy="28e-6" izz="116e-6" ixz="0" iyz="0"/>'
    inertial = f'<inertial><mass value="0.02"/>{moments}</inertial>'
    sim = Simulation(urdf(arm(kind="continuous", inertial=inertial)))
    assert [d.code for d in sim.diagnostics] == []


def test_link_of_hardly_any_mass_on_a_body_is_ignored(urdf):
    """Exports of CAD programs contain links of 1e-15 kg."""
    speck = f'<link name="speck">{solid(4e-15, 1e-27)}</link><joint name="glue" type="fixed">'
    speck += '<parent link="ball"/><child link="speck"/></joint></robot>'
    sim = Simulation(urdf(ball().replace("</robot>", speck)))
    assert sim.diagnostics == ()


def test_missing_mesh_is_reported_and_the_rest_simulated(urdf):
    mesh = '<collision><geometry><mesh filename="package://nowhere/part.stl"/></geometry></collision></link>'
    sim = Simulation(urdf(ball().replace("</link>", mesh)))
    assert "W106" in [d.code for d in sim.diagnostics]
    sim.run(0.1)


def test_diverged_run_stops_and_names_the_link(urdf):
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


def test_divergence_is_reported_before_timers_are_called(urdf):
    """A timer within the control period, such as that of a sensor, is not called after the divergence."""
    sim = Simulation(urdf(arm(kind="continuous")))
    sim.clock.every(100.0, lambda: sim.link_pose("bob"))
    sim.engine.data.qvel[0] = float("nan")
    with pytest.raises(SimulationDiverged, match=r"between 0\.000 s and 0\.010 s"):
        sim.run(1.0)


def test_diverged_run_rejects_kicks(urdf):
    sim = Simulation(urdf(ball()))
    reported = []
    sim.engine.data.qpos[2] = float("nan")
    sim.journal.write = lambda what, values: reported.append(what)
    refused = "the run has diverged: reset it first"
    with pytest.raises(KbotError, match=refused):
        sim.models.set_twist((1.0, 0.0, 0.0))
    with pytest.raises(KbotError, match=refused):
        sim.disturbances.schedule(Kick((1.0, 0.0, 0.0)), at=sim.time)
    assert reported == []
    sim.journal.write = None
    sim.reset()
    sim.models.set_twist((1.0, 0.0, 0.0))
    assert sim.ground_truth.twist.x == 1.0


def test_kick_due_during_divergence_does_not_hide_the_error(urdf):
    sim = Simulation(urdf(ball()))
    sim.disturbances.schedule(Kick((1.0, 0.0, 0.0)), at=0.004)
    sim.engine.data.qvel[0] = float("nan")
    with pytest.raises(SimulationDiverged):
        sim.run(0.1)


def test_speed_whose_square_overflows_is_a_divergence(urdf):
    """A force accelerates the bob to 2e202 m/s in the last step before the speeds are checked."""
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
def test_invalid_options_are_rejected(kbot_robot, options, message):
    with pytest.raises(KbotError, match=message):
        Simulation(kbot_robot, **options)


@pytest.mark.parametrize("seconds", [-1.0, float("nan"), float("inf")])
def test_invalid_time_is_rejected(sim, seconds):
    with pytest.raises(KbotError, match="time to run"):
        sim.run(seconds)


def test_unknown_joints_and_links_get_a_suggestion(sim):
    with pytest.raises(KbotError, match="did you mean 'left_wheel_joint'"):
        sim.robots.first.set_joint("left_wheel_joit", 0.0)
    with pytest.raises(KbotError, match="drives the robot"):
        sim.robots.first.set_joint("left_wheel_joint", 0.0)
    with pytest.raises(KbotError, match="did you mean 'left_wheel'"):
        sim.link_pose("lef_wheel")


def test_robot_starts_and_drives_on_a_height_field(kbot_robot):
    """The ground is at 0.5 m and rises by 1 in 10 along x: 0.5 m further it is 5 cm higher."""
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


def test_equal_meshes_are_stored_once(kbot_robot):
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


def test_start_inside_an_object_is_reported(kbot_robot):
    from kbot.world.builders import box, floor
    from kbot.world.world import World

    world = World("full", (floor(), box("rock", (0.3, 0.3, 0.3), 0.0, 0.0)))
    sim = Simulation(kbot_robot, world=world, start=PlanarPose())
    assert [d.code for d in sim.diagnostics] == ["W111"]
    assert "overlaps 'rock'" in sim.diagnostics[0].message


def test_robot_without_a_given_start_is_moved_out_of_an_object(kbot_robot):
    """The box ends at y = 0.1, so the nearest free places are beside it, half of the robot's width away."""
    from kbot.world.builders import box, floor
    from kbot.world.world import World

    world = World("full", (floor(), box("rock", (6.0, 0.6, 0.3), 0.0, -0.2)))
    sim = Simulation(kbot_robot, world=world)
    assert [d.code for d in sim.diagnostics] == ["W111"]
    message = sim.diagnostics[0].message
    assert f"overlaps 'rock' of the world at 0, 0. It starts at {sim.start.x:.2f}" in message
    assert sim.start.x == pytest.approx(0.0, abs=0.1)
    assert 0.15 < sim.start.y < 0.31
    sim.run(0.2)
    pose = sim.ground_truth.pose
    assert (pose.x, pose.y) == pytest.approx((sim.start.x, sim.start.y), abs=1e-3)


def test_robot_without_a_free_place_stays(kbot_robot):
    from kbot.world.builders import box, floor
    from kbot.world.world import World

    sim = Simulation(kbot_robot, world=World("full", (floor(), box("rock", (30.0, 30.0, 3.0), 0.0, 0.0))))
    assert sim.start == PlanarPose()
    assert [d.code for d in sim.diagnostics] == ["W111"]


def test_robot_starts_on_a_floor_that_is_a_mesh(kbot_robot):
    """A block of 4 m with its top 5 cm above 0, such as the floor of a warehouse."""
    import trimesh

    from kbot.world.builders import floor
    from kbot.world.world import Body, Part, TriangleMesh, World

    block = trimesh.creation.box((4.0, 4.0, 0.1))
    mesh = TriangleMesh(block.vertices.copy(), block.faces.astype("int32"))
    for start in (None, PlanarPose(1.0, 0.5, 0.3)):
        sim = Simulation(kbot_robot, world=World("hall", (floor(), Body("slab", (Part(mesh),)))), start=start)
        assert sim.diagnostics == ()
        assert sim.start == (start or PlanarPose())
        sim.run(0.5)
        assert sim.robots.first.body.link_pose(kbot_robot.root).translation[2] == pytest.approx(
            0.05, abs=2e-3
        )


def test_the_points_of_a_mesh_are_those_of_numpy_unique() -> None:
    points = np.random.default_rng(1).integers(-3, 3, (500, 3)) / 4
    assert np.array_equal(distinct(points), np.unique(points, axis=0))
    assert len(distinct(points[:0])) == 0
