"""`Trip.collided`, in worlds in which the robot must touch something, or cannot."""

import json
import math

import numpy as np
import pytest

from kbot.cli.main import main
from kbot.kinematics import PlanarPose
from kbot.model.load import load_robot
from kbot.navigation.simulated.collision_watch import CollisionWatch
from kbot.navigation.with_map.go_to import go_to
from kbot.sim import Simulation
from kbot.sim.engine.world_builder import owner
from kbot.sim.recipe import CONTROL_PERIOD
from kbot.world import World
from kbot.world.builders import at, box, cylinder, floor, slope
from kbot.world.occupancy import OccupancyGrid
from kbot.world.world import Body, Box, HeightField, Part, Sphere, TriangleMesh

FREE = OccupancyGrid(np.zeros((80, 80), np.int8), 0.05, PlanarPose(-2.0, -2.0))
"""A map without the objects of a world."""
AHEAD = PlanarPose(0.4, 0.0, 0.0)

WHEEL, REACH, PLATE = 0.03, 0.15, 0.1
"""For the robot `wide`: radius of the wheels, their distance from its middle, and height of its plate, in
m."""


def _link(name, mass, *shapes):
    inertia = '<inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/>'
    collisions = "".join(
        f'<collision><origin xyz="{xyz}" rpy="{rpy}"/><geometry>{shape}</geometry></collision>'
        for xyz, rpy, shape in shapes
    )
    return f'<link name="{name}"><inertial><mass value="{mass}"/>{inertia}</inertial>{collisions}</link>'


@pytest.fixture(scope="module")
def wide(tmp_path_factory):
    """A body 8 cm wide between wheels 30 cm apart, with a plate in front that is 10 cm above the ground."""
    wheels = "".join(
        _link(side, 0.1, ("0 0 0", f"{math.pi / 2} 0 0", f'<cylinder radius="{WHEEL}" length="0.02"/>'))
        + f'<joint name="{side}_joint" type="continuous"><parent link="base_link"/><child link="{side}"/>'
        f'<origin xyz="0 {y} 0"/><axis xyz="0 1 0"/></joint>'
        for side, y in (("left", REACH), ("right", -REACH))
    )
    body = _link(
        "base_link",
        2.0,
        ("0 0 0.01", "0 0 0", '<box size="0.1 0.08 0.04"/>'),
        ("0.1 0 0", "0 0 0", f'<sphere radius="{WHEEL}"/>'),
        ("-0.1 0 0", "0 0 0", f'<sphere radius="{WHEEL}"/>'),
        (f"0.1 0 {PLATE - WHEEL + 0.005}", "0 0 0", '<box size="0.2 0.04 0.01"/>'),
    )
    file = tmp_path_factory.mktemp("wide") / "wide.urdf"
    file.write_text(f'<robot name="wide">{body}{wheels}</robot>')
    return load_robot(str(file)).require()


@pytest.fixture(scope="module")
def kbot():
    return load_robot("kbot").require()


def _go(robot, *bodies, goal=AHEAD, timeout=None):
    return go_to(Simulation(robot, World("test", bodies)), goal, FREE, timeout)


def _plate_mesh():
    """A plate of 4 x 4 m whose upper face is at z = 0."""
    corners = np.array([(x, y, z) for z in (-0.05, 0.0) for x in (-2.0, 2.0) for y in (-2.0, 2.0)])
    faces = [
        (0, 1, 3),
        (0, 3, 2),
        (4, 6, 7),
        (4, 7, 5),
        (0, 4, 5),
        (0, 5, 1),
        (2, 3, 7),
        (2, 7, 6),
        (0, 2, 6),
    ]
    return TriangleMesh(corners, np.array([*faces, (0, 6, 4), (1, 5, 7), (1, 7, 3)], np.int32))


def _hills():
    x = np.linspace(-2.0, 2.0, 81)
    return HeightField(np.tile(0.02 + 0.01 * np.sin(4.0 * x), (81, 1)), (4.0, 4.0))


@pytest.mark.parametrize(
    "ground",
    [
        floor(),
        Body(
            "crate",
            (
                Part(
                    Box((4.0, 4.0, 0.1)),
                ),
            ),
            at(0.0, 0.0, -0.05),
        ),
        Body("statue", (Part(_plate_mesh()),)),
        Body("wall_of_hills", (Part(_hills()),)),
    ],
    ids=["plane", "box", "mesh", "height_field"],
)
def test_ground_of_any_shape_and_name_is_not_a_collision(kbot, ground):
    trip = _go(kbot, ground)
    assert trip.reached, trip.status
    assert not trip.collided


@pytest.mark.parametrize(
    "bodies",
    [
        (slope("ramp", 1.0, 1.0, math.radians(15.0), 0.2, 0.0, 0.0),),
        (box("sill", (0.03, 1.0, 0.012), 0.25, 0.0, ground=True),),
        (box("tile", (1.0, 1.0, 0.01), 0.75, 0.0),),
    ],
    ids=["ramp", "sill", "tile"],
)
def test_ramps_sills_and_tiles_are_ground(kbot, bodies):
    trip = _go(kbot, floor(), *bodies)
    assert trip.reached, trip.status
    assert not trip.collided


@pytest.mark.parametrize(
    "obstacle",
    [
        cylinder("post", 0.02, 0.3, 0.3, 0.0),
        cylinder("bollard", 0.02, 0.025, 0.3, 0.0),
        box("ground", (0.1, 0.5, 0.05), 0.3, 0.0, ground=True),
    ],
    ids=["post", "lower_than_the_axle", "named_ground"],
)
def test_driving_against_an_obstacle_is_a_collision(kbot, obstacle):
    trip = _go(kbot, floor(), obstacle, timeout=3.0)
    assert not trip.reached
    assert trip.collided


@pytest.mark.parametrize(("beside", "collided"), [(REACH, True), (REACH + 0.03, False)])
def test_a_wheel_against_a_post_is_a_collision(wide, beside, collided):
    """The body is 8 cm wide and ends 10 cm from the post. The wheel and the post are 2 cm wide."""
    trip = _go(wide, floor(), cylinder("post", 0.01, 0.3, 0.15, beside), timeout=3.0)
    assert trip.collided is collided


@pytest.mark.parametrize(("top", "collided"), [(PLATE + 0.0001, True), (PLATE - 0.005, False)])
def test_a_surface_above_the_axles_is_not_ground(wide, top, collided):
    """A table reaches under the plate in front of the robot, and the robot backs up from it."""
    table = box("table", (0.1, 0.04, 0.01), 0.19, 0.0, top - 0.005)
    assert _go(wide, floor(), table, goal=PlanarPose(-0.05, 0.0, 0.0), timeout=0.2).collided is collided


def test_pushing_a_light_box_is_a_collision(kbot):
    light = Body(
        "box",
        (
            Part(
                Box((0.05, 0.05, 0.05)),
            ),
        ),
        at(0.25, 0.0, 0.025),
        mass=0.01,
    )
    trip = _go(kbot, floor(), light)
    assert trip.reached, trip.status
    assert trip.collided


def test_a_touch_shorter_than_a_control_period_is_a_collision(wide):
    """A weightless ball flies past the front edge of the plate at 3 m/s, and grazes it by 1 mm."""
    ball = Body("ball", (Part(Sphere(0.01)),), at(0.209, 0.3, PLATE + 0.005), mass=0.001, weightless=1.0)
    simulation = Simulation(wide, World("test", (floor(), ball)))
    simulation.models.set_model_state("ball", ball.pose, linear=(0.0, -3.0, 0.0))
    model = simulation.engine.model
    number = next(g for g in range(model.ngeom) if owner(model, g) == "/ball")
    touched = []
    simulation.stepping.watchers.append(
        lambda _, data: touched.append(bool((data.contact.geom == number).any()))
    )
    trip = go_to(simulation, PlanarPose(), FREE)
    assert 0 < sum(touched) < CONTROL_PERIOD / simulation.timestep
    assert trip.collided


def test_another_robot_that_hits_the_robot_is_a_collision(kbot):
    simulation = Simulation(kbot)
    other = simulation.models.spawn_model(kbot, "other", 0.6, 0.0, math.pi)
    other.cmd_vel(0.3, 0.0)
    assert go_to(simulation, AHEAD, FREE, timeout=2.0).collided


def test_another_robot_beside_the_robot_is_not_a_collision(kbot):
    simulation = Simulation(kbot)
    simulation.models.spawn_model(kbot, "other", 0.0, 1.0, 0.0)
    trip = go_to(simulation, AHEAD, FREE)
    assert trip.reached, trip.status
    assert not trip.collided


def test_watching_for_collisions_does_not_change_the_run_and_ends_with_the_goal(kbot):
    watched, plain = (Simulation(kbot, "boxes") for _ in range(2))
    watch = CollisionWatch(watched)
    for simulation in (watched, plain):
        simulation.cmd_vel(0.3, 0.4)
        simulation.run(2.0)
    assert watched.state_sha256() == plain.state_sha256()
    watch.close()
    go_to(watched, AHEAD, FREE)
    assert watched.stepping.watchers == []


@pytest.mark.parametrize(("x", "collided"), [(0.03, True), (-3.0, False)])
def test_the_json_report_of_a_goal_says_whether_it_collided(tmp_path, capsys, x, collided):
    """A ball falls from 0.5 m, on the robot or far behind it."""
    (tmp_path / "w.sdf").write_text(
        '<sdf version="1.9"><world name="w"><model name="floor"><static>true</static><link name="l">'
        '<collision name="c"><geometry><plane/></geometry></collision></link></model>'
        f'<model name="ball"><pose>{x} 0 0.5 0 0 0</pose><link name="l">'
        '<inertial><mass>0.001</mass></inertial><collision name="c"><geometry><sphere><radius>0.02</radius>'
        "</sphere></geometry></collision></link></model></world></sdf>"
    )
    words = ["sim", "kbot", "--headless", "--world", str(tmp_path / "w.sdf"), "--goto", "0.2,0,0"]
    for more in ([], ["--json"]):
        with pytest.raises(SystemExit) as ended:
            main([*words, *more])
        assert not ended.value.code
    text, brace, report = capsys.readouterr().out.partition("{")
    assert ("contact     with more than the ground" in text) is collided
    assert ("contact     only with the ground" in text) is not collided
    assert json.loads(brace + report)["navigation"]["collided"] is collided
