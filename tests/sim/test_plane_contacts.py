"""Shapes touch planes where they do by geometry. docs/explanation/cylinder-on-a-plane.md describes why."""

import importlib.util
import sys
from math import pi
from pathlib import Path

import numpy as np
import pytest

from kbot import Simulation, Transform
from kbot.sensors.rays import Rays
from kbot.sim.engine.placing import PLANE_GROUP
from kbot.world import Body, Cylinder, Part, Plane, World
from kbot.world.builders import at, box, floor

BENCHMARK = Path(__file__).parents[2] / "benchmarks" / "bench_contacts.py"
spec = importlib.util.spec_from_file_location("bench_contacts", BENCHMARK)
contacts = sys.modules["bench_contacts"] = importlib.util.module_from_spec(spec)
spec.loader.exec_module(contacts)


@pytest.mark.parametrize("plane", [contacts.LEVEL, contacts.TILTED], ids=["level", "tilted"])
@pytest.mark.parametrize("name", contacts.CASES)
def test_the_distance_from_a_plane_is_the_analytic_one(name, plane):
    case = contacts.CASES[name]
    assert contacts.errors(contacts.model(case, plane), case, plane, 1500).max() <= case.limit


def test_the_poses_are_those_in_which_the_engines_own_cylinder_fails():
    """If this fails, MuJoCo is corrected: `plane_contacts.py` and the page about it can be removed."""
    deck = contacts.CASES["round deck"]
    assert contacts.errors(contacts.plain(deck, contacts.LEVEL), deck, contacts.LEVEL, 1500).max() > 0.1


def inertial(mass: float, size: float) -> str:
    moment = 0.4 * mass * size**2
    return (
        f'<inertial><mass value="{mass}"/><inertia ixx="{moment}" iyy="{moment}" izz="{moment}"'
        ' ixy="0" ixz="0" iyz="0"/></inertial>'
    )


def deck(radius: float, thickness: float, clearance: float) -> str:
    """A round plate `clearance` above the ground, between two wheels, with a caster in front and behind."""
    height, ball = clearance + thickness / 2.0, clearance / 2.0
    plate = f'<collision><geometry><cylinder radius="{radius}" length="{thickness}"/></geometry></collision>'
    parts = [f'<link name="base">{inertial(4, radius)}{plate}</link>']
    for name, y in (("left", radius + 0.02), ("right", -radius - 0.02)):
        parts.append(
            f'<link name="{name}_wheel">{inertial(0.5, 0.05)}<collision><origin rpy="{pi / 2} 0 0"/>'
            f'<geometry><cylinder radius="{2 * height}" length="0.02"/></geometry></collision></link>'
            f'<joint name="{name}_joint" type="continuous"><parent link="base"/><child link="{name}_wheel"/>'
            f'<origin xyz="0 {y} {height}"/><axis xyz="0 1 0"/></joint>'
        )
    for name, x in (("front", 0.8 * radius), ("rear", -0.8 * radius)):
        parts.append(
            f'<link name="{name}_caster">{inertial(0.1, ball)}<collision><geometry><sphere radius="{ball}"/>'
            f'</geometry></collision></link><joint name="{name}_joint" type="fixed"><parent link="base"/>'
            f'<child link="{name}_caster"/><origin xyz="{x} 0 {ball - height}"/></joint>'
        )
    return f'<robot name="deck">{"".join(parts)}</robot>'


@pytest.mark.parametrize(
    ("radius", "thickness", "clearance"),
    [(0.12, 0.006, 0.032), (0.1, 0.004, 0.02), (0.2, 0.01, 0.05), (0.15, 0.1, 0.03), (0.09, 0.003, 0.015)],
)
def test_a_robot_with_a_round_deck_turns_on_the_spot(urdf, radius, thickness, clearance):
    """Its deck is above the ground and touches nothing."""
    sim = Simulation(urdf(deck(radius, thickness, clearance)))
    start = sim.link_pose("base").translation
    sim.cmd_vel(0.0, 0.5)
    for _ in range(100):
        sim.run(0.05)
        assert sim.link_pose("base").translation == pytest.approx(start, abs=1e-4)
    assert sim.ground_truth.pose.yaw == pytest.approx(2.47, abs=0.03)
    assert sim.diagnostics == ()


CAN = Cylinder(0.05, 0.2)


def wall(x: float) -> Body:
    """A plane that is an obstacle, with its solid side beyond `x`."""
    return Body("wall", (Part(Plane()),), Transform.from_xyz_rpy((x, 0.0, 0.0), (0.0, -pi / 2.0, 0.0)))


def with_body(body: Body) -> Simulation:
    return Simulation("kbot", world=World("hall", (floor(), body)))


@pytest.mark.parametrize("spin", [0.0, 1.0, 5.0])
@pytest.mark.parametrize("shape", [CAN, Cylinder(0.12, 0.006)], ids=["can", "plate"])
def test_a_dropped_cylinder_lands_and_stands(shape, spin):
    height = shape.length / 2.0
    sim = with_body(Body("thing", (Part(shape),), at(1.0, 1.0, height + 0.05), mass=1.0))
    engine = sim.engine
    engine.data.qvel[engine.model.joint("/thing").dofadr[0] + 5] = spin
    sim.run(1.0)
    for _ in range(40):
        sim.run(0.1)
        pose = sim.models.body_poses()["thing"]
        assert pose.translation == pytest.approx((1.0, 1.0, height), abs=1e-5)
        assert pose.rotation[2, 2] == pytest.approx(1.0, abs=1e-9)


def test_a_cylinder_on_its_side_rolls_without_losing_speed():
    """Rolling is a rotation of v / r about the axis. Nothing slows it down."""
    on_side = Transform.from_xyz_rpy((1.0, 1.0, 0.05), (pi / 2.0, 0.0, 0.0))
    sim = with_body(Body("can", (Part(CAN),), on_side, mass=1.0))
    start = int(sim.engine.model.joint("/can").dofadr[0])
    velocity = sim.engine.data.qvel[start : start + 6]
    velocity[:] = 0.5, 0.0, 0.0, 0.0, 0.0, -0.5 / 0.05  # in the body's frame, whose z axis is -y of the world
    sim.run(4.0)
    assert sim.models.body_poses()["can"].translation == pytest.approx((3.0, 1.0, 0.05), abs=1e-4)


def test_a_cylinder_has_its_own_mass_and_inertia():
    """Solid cylinder of 1 kg: m r^2 / 2 about its axis, m (3 r^2 + l^2) / 12 across it."""
    sim = with_body(Body("can", (Part(CAN),), at(1.0, 1.0, 0.1), mass=1.0))
    body = sim.engine.model.body("/can")
    assert body.mass == pytest.approx(1.0)
    across = (3.0 * 0.05**2 + 0.2**2) / 12.0
    assert body.inertia == pytest.approx((across, across, 0.05**2 / 2.0))


def shapes_for_planes(world: World) -> int:
    model = Simulation("kbot", world=world).engine.model
    return int((model.geom_group == PLANE_GROUP).sum())


def test_only_cylinders_that_can_meet_a_plane_have_shapes_for_it():
    """The wheels of KBot are cylinders, but spheres on the ground. Fixed cylinders meet no plane."""
    can = Body("can", (Part(CAN),), at(1.0, 1.0, 0.1), mass=1.0)
    slab = box("slab", (4.0, 4.0, 0.1), 0.0, 0.0, ground=True)
    pillar = Body("pillar", (Part(CAN),), at(1.0, 1.0, 0.1))
    assert shapes_for_planes(World("fixed", (floor(), pillar))) == 0
    assert shapes_for_planes(World("without_plane", (slab, can))) == 0
    assert shapes_for_planes(World("with_plane", (floor(), can))) == 3
    assert shapes_for_planes(World("with_wall", (floor(), wall(3.0)))) == 6  # three of each wheel


def test_a_wheel_does_not_pass_through_a_plane_that_is_a_wall():
    sim = Simulation("kbot", world=World("with_wall", (floor(), wall(0.5))))
    sim.cmd_vel(0.3, 0.0)
    sim.run(4.0)
    model, data = sim.engine.current()
    moving = [geom for geom in range(model.ngeom) if model.geom_bodyid[geom] and model.geom_contype[geom]]
    reach = max(data.geom_xpos[geom][0] for geom in moving)
    assert 0.3 < reach < 0.5


def test_rays_do_not_hit_shapes_for_planes():
    """From its middle, a ray leaves the can at its surface, not at the box inside it."""
    sim = with_body(Body("can", (Part(CAN),), at(1.0, 1.0, 0.1), mass=1.0))
    rays = Rays("kbot", np.array([[1.0, 0.0, 0.0], [0.0, 0.6, 0.8]]))
    distances = rays.cast(*sim.engine.current(), np.array([1.0, 1.0, 0.1]), np.eye(3), 10.0)
    assert distances == pytest.approx([0.05, 0.05 / 0.6])
