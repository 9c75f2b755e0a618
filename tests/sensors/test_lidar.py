"""Lidar readings against the geometry of the world."""

import ast
import inspect
import math
from dataclasses import fields

import mujoco
import numpy as np
import pytest

from kbot.kinematics import PlanarPose, Transform
from kbot.messages.sensing import LaserScan, PointCloud2
from kbot.sensors import Lidar, Noise, scan_points
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.world.builders import box, cylinder, floor
from kbot.world.world import Body, Box, Cylinder, HeightField, Part, TriangleMesh, World

ROOM = World("room", (floor(), *(
    box(f"wall{i}", size, x, y)
    for i, (size, x, y) in enumerate([
        ((0.1, 6.0, 1.0), 2.05, 0.0), ((0.1, 6.0, 1.0), -1.05, 0.0),
        ((6.0, 0.1, 1.0), 0.0, 1.55), ((6.0, 0.1, 1.0), 0.0, -3.05),
    ])
)))  # fmt: skip
"""A room with inner faces at x = 2 and -1, y = 1.5 and -3."""

UP = Transform.from_xyz_rpy((0.0, 0.0, 0.1), (0.0, 0.0, 0.0))


def _room(angle, x=0.0, y=0.0):
    """The distance in m from a point to the room's walls."""
    c, s = math.cos(angle), math.sin(angle)
    along = ((2.0 - x) if c > 0 else (-1.0 - x)) / c if abs(c) > 1e-12 else math.inf
    across = ((1.5 - y) if s > 0 else (-3.0 - y)) / s if abs(s) > 1e-12 else math.inf
    return min(along, across)


def test_distances_in_a_room_are_exact_to_a_nanometre(robot):
    simulation = Simulation(robot, ROOM)
    lidar = simulation.add_sensor(Lidar(link="base_footprint", pose=UP, samples=720))
    distances = lidar.distances()
    angles = np.linspace(-math.pi, math.pi, 720)
    assert distances == pytest.approx([_room(a) for a in angles], abs=1e-9)


def test_type_checkers_know_all_arguments_of_a_lidar():
    code = ast.parse(inspect.getsource(inspect.getmodule(Lidar)))
    (values,) = (n for n in ast.walk(code) if isinstance(n, ast.ClassDef) and n.name == "LidarValues")
    known = {n.target.id: ast.unparse(n.annotation) for n in values.body if isinstance(n, ast.AnnAssign)}
    of_overloads = {"link": "str", "rows": "int"}
    assert known | of_overloads == {field.name: field.type for field in fields(Lidar)}


def test_lidar_sees_a_mesh_of_the_world(robot):
    import trimesh

    block = trimesh.creation.box((0.4, 1.0, 1.0))
    part = Part(TriangleMesh(block.vertices.copy(), block.faces.astype("int32")))
    wall = Body("wall", (part,), Transform.from_xyz_rpy((1.2, 0.0, 0.5), (0.0, 0.0, 0.0)))
    simulation = Simulation(robot, World("yard", (floor(), wall)))
    lidar = simulation.add_sensor(Lidar(link="base_footprint", pose=UP, samples=3))
    assert lidar.distances()[1] == pytest.approx(1.0)


def test_lidar_moves_with_its_robot(robot):
    simulation = Simulation(robot, ROOM)
    lidar = simulation.add_sensor(Lidar(link="base_footprint", pose=UP, samples=91, range_max=12.0))
    simulation.models.place(PlanarPose(0.7, -0.4, 0.6))
    angles = np.linspace(-math.pi, math.pi, 91)
    expected = [_room(a + 0.6, 0.7, -0.4) for a in angles]
    assert lidar.distances() == pytest.approx(expected, abs=1e-9)


def test_a_program_avoids_walls_by_a_sector_of_the_scan(robot):
    """At 0.2 m/s the robot turns 0.4 m before a wall, twice its length."""
    simulation = Simulation(robot, ROOM)
    lidar = simulation.add_sensor(Lidar(link="base_footprint", pose=UP, rate=20, range_max=1.0))
    simulation.run(0.1)
    nearest = []
    for _ in range(400):
        ahead = min(lidar.latest.sector(-0.5, 0.5))
        nearest.append(ahead)
        if ahead > 0.4:
            simulation.cmd_vel(0.2, 0.0)
        else:
            simulation.cmd_vel(0.0, 1.0)
        simulation.run(0.05)
    assert max(nearest) == math.inf  # at first no wall is within a metre
    assert min(nearest) > 0.3
    assert not simulation.collided
    assert simulation.findings == ()
    simulation.cmd_vel(0.3, 0.0)
    simulation.run(15.0)  # more than the room is long
    assert simulation.collided


def test_distances_to_a_pillar_are_those_of_a_circle(robot):
    simulation = Simulation(robot, World("pillar", (floor(), cylinder("pillar", 0.2, 1.0, 1.0, 0.0))))
    lidar = simulation.add_sensor(
        Lidar(link="base_footprint", pose=UP, samples=41, angle_min=-0.3, angle_max=0.3)
    )
    for angle, distance in zip(np.linspace(-0.3, 0.3, 41), lidar.distances(), strict=True):
        inside = 0.2**2 - math.sin(angle) ** 2
        expected = math.cos(angle) - math.sqrt(inside) if inside > 0 else math.inf
        assert distance == pytest.approx(expected, abs=1e-9)


def test_out_of_range_is_infinite_as_in_rep_117(robot):
    simulation = Simulation(robot, ROOM)
    spec = Lidar(link="base_footprint", pose=UP, samples=360, range_min=1.2, range_max=2.5, noise=Noise(0.01))
    lidar = simulation.add_sensor(spec)
    simulation.run(0.1)
    scan = lidar.latest
    for angle, value in zip(np.linspace(-math.pi, math.pi, 360), scan.ranges.tolist(), strict=True):
        true = _room(angle)
        if true < 1.2:
            assert value == -math.inf
        elif true > 2.5:
            assert value == math.inf
        else:
            assert abs(value - true) < 0.06
            assert 1.2 <= value <= 2.5


def test_lidar_sees_the_ground_but_not_its_own_robot(robot):
    simulation = Simulation(robot)
    inside = simulation.add_sensor(Lidar(link="base_link", name="inside"))
    assert np.isinf(inside.distances()).all()
    down = Transform.from_xyz_rpy((0.0, 0.0, 0.2), (0.0, math.pi / 2, 0.0))
    below = simulation.add_sensor(
        Lidar(link="base_footprint", name="below", pose=down, samples=1, angle_min=0)
    )
    assert below.distances() == pytest.approx([0.2], abs=1e-6)


def test_distances_equal_the_engines_rays(robot):
    simulation = Simulation(robot, "boxes:count=30")
    lidar = simulation.add_sensor(Lidar(link="base_footprint", pose=UP))
    model, data = simulation.engine.current()
    base = simulation.link_pose("base_footprint") @ UP
    for direction, distance in zip(lidar.spec.directions, lidar.distances(), strict=True):
        hit = np.zeros(1, dtype=np.int32)
        groups = None
        # start outside the robot's own body, which reaches at most 0.13 m
        start = base.translation + base.rotation @ direction * 0.13
        single = mujoco.mj_ray(model, data, start, base.rotation @ direction, groups, 1, -1, hit, None)
        if single >= 0 and single + 0.13 <= 10.0:
            assert distance == pytest.approx(single + 0.13, abs=1e-9)
        else:
            assert distance == math.inf


def test_scans_have_their_rate_stamps_and_frame(robot):
    simulation = Simulation(robot, ROOM)
    lidar = simulation.add_sensor(Lidar(link="base_footprint", pose=UP, rate=25.0))
    received = []
    simulation.bus.subscribe("/scan", LaserScan, received.append)
    simulation.run(1.0)
    assert [m.header.stamp.nanoseconds for m in received] == [40_000_000 * k for k in range(1, 26)]
    assert received[0].header.frame_id == "base_footprint"
    assert len(received[0].ranges) == 360
    assert received[0].angle_increment == pytest.approx(2 * math.pi / 359)
    assert lidar.latest is received[-1]


def test_latency_delays_readings(robot):
    simulation = Simulation(robot, ROOM)
    spec = Lidar(link="base_footprint", pose=UP, rate=10.0, latency=0.25)
    lidar = simulation.add_sensor(spec)
    received = []
    simulation.bus.subscribe(
        "scan", LaserScan, lambda m: received.append((m.header.stamp.seconds, simulation.clock.seconds))
    )
    with pytest.raises(KbotError, match=r"^scan has no reading yet: .* sim\.run\(0\.352\), or call"):
        _ = lidar.latest
    simulation.run(0.34)
    assert not lidar.has_reading
    simulation.run(0.36)
    assert received == [pytest.approx((k / 10, k / 10 + 0.25), abs=0.0021) for k in (1, 2, 3, 4)]


def test_noise_is_the_same_after_a_reset_and_differs_by_seed(robot):
    spec = Lidar(link="base_footprint", pose=UP, noise=Noise(stddev=0.02))

    def scans(simulation, lidar):
        simulation.run(0.3)
        return lidar.latest.ranges

    simulation = Simulation(robot, ROOM, seed=3)
    lidar = simulation.add_sensor(spec)
    first = scans(simulation, lidar)
    simulation.reset()
    assert not lidar.has_reading
    assert np.array_equal(scans(simulation, lidar), first)
    other = Simulation(robot, ROOM, seed=4)
    assert not np.array_equal(scans(other, other.add_sensor(spec)), first)
    off = first - np.array([_room(a) for a in np.linspace(-math.pi, math.pi, 360)])
    assert np.std(off) == pytest.approx(0.02, rel=4 / math.sqrt(2 * 360))


def test_measuring_does_not_change_the_simulation(robot):
    runs = []
    for with_lidar in (False, True):
        simulation = Simulation(robot, ROOM)
        if with_lidar:
            simulation.add_sensor(Lidar(link="base_footprint", pose=UP, rate=33.0))
        simulation.cmd_vel(0.2, 0.5)
        simulation.run(2.0)
        runs.append(simulation.state_sha256())
    assert runs[0] == runs[1]


def test_rows_of_beams_make_a_point_cloud(robot):
    simulation = Simulation(robot, ROOM)
    spec = Lidar(
        link="base_footprint",
        name="points",
        pose=UP,
        samples=90,
        rows=5,
        elevation_min=-0.3,
        elevation_max=0.3,
    )
    cloud = simulation.add_sensor(spec)
    points = cloud.points()
    assert points.shape == (5, 90, 3)
    finite = points[np.isfinite(points).all(axis=2)]
    x, y, z = (finite + np.array((0.0, 0.0, 0.1))).T
    # every point is on a wall, or on the ground
    off = np.min([abs(x - 2), abs(x + 1), abs(y - 1.5), abs(y + 3), abs(z)], axis=0)
    assert off.max() < 1e-6
    message = cloud.measure()
    assert isinstance(message, PointCloud2)
    assert (message.height, message.width, message.row_step) == (5, 90, 1080)
    back = np.frombuffer(message.data, "<f4").reshape(5, 90, 3)
    assert np.array_equal(back, points.astype("<f4"))
    assert [f.name for f in message.fields] == ["x", "y", "z"]


def test_scan_points_lie_on_the_walls(robot):
    simulation = Simulation(robot, ROOM)
    pose = Transform.from_xyz_rpy((0.05, -0.02, 0.1), (0.0, 0.0, 0.7))
    lidar = simulation.add_sensor(Lidar(link="base_footprint", pose=pose))
    x, y = scan_points(lidar.measure(), pose.matrix).T
    off = np.min([abs(x - 2), abs(x + 1), abs(y - 1.5), abs(y + 3)], axis=0)
    assert off.max() < 1e-6


@pytest.mark.parametrize(
    "numbers",
    [
        {"samples": 0}, {"samples": 100_000, "rows": 1000}, {"angle_min": math.nan},
        {"range_min": 2.0, "range_max": 1.0},
        {"rate": 0.0}, {"latency": -1.0}, {"elevation_max": 2.0}, {"link": "base_lnik"},
    ],
)  # fmt: skip
def test_invalid_lidar_settings_are_rejected(robot, numbers):
    with pytest.raises(KbotError) as error:
        Simulation(robot).add_sensor(Lidar(**{"link": "base_link", **numbers}))
    if "link" in numbers:
        assert "did you mean 'base_link'" in str(error.value)


def test_lidar_sees_robots_that_are_spawned_and_deleted(robot):
    simulation = Simulation(robot)
    low = Transform.from_xyz_rpy((0.0, 0.0, 0.04), (0.0, 0.0, 0.0))
    lidar = simulation.add_sensor(Lidar(link="base_footprint", pose=low, samples=1, angle_min=0.0))
    assert lidar.distances().tolist() == [math.inf]
    simulation.models.spawn_model(robot, "other", 1.0)
    # its plate reaches 0.10 m behind its axle
    assert lidar.distances() == pytest.approx([0.90], abs=1e-3)
    theirs = simulation.add_sensor(
        Lidar(link="base_footprint", name="theirs", robot="other", pose=low, samples=1, angle_min=math.pi)
    )
    # the first robot's plate reaches 0.06 m ahead of its axle
    assert theirs.distances() == pytest.approx([0.94], abs=1e-3)
    assert (theirs.topic, theirs.measure().header.frame_id) == ("/other/theirs", "other/base_footprint")
    simulation.models.delete_model("other")
    assert lidar.distances().tolist() == [math.inf]
    with pytest.raises(KbotError):
        theirs.measure()


def _strewn(random, count, lean=0.0, moving=0):
    """Random boxes and pillars on 8 x 8 m, leaning up to `lean` rad. The first `moving` bodies can move."""
    bodies = [floor()]
    while len(bodies) <= count:
        x, y = random.uniform(-4, 4, 2).tolist()
        if math.hypot(x, y) < 0.9:
            continue
        name = f"thing{len(bodies)}"
        pose = Transform.from_xyz_rpy((x, y, 0.2), (*random.uniform(-lean, lean, 2), random.uniform(-3, 3)))
        size = random.uniform(0.05, 0.7, 3)
        shape = Cylinder(size[0] / 4, 0.4) if len(bodies) % 5 == 0 else Box((*size[:2].tolist(), 0.4))
        mass = 1.0 if len(bodies) <= moving else None
        bodies.append(Body(name, (Part(shape),), pose, mass=mass))
    return World("strewn", tuple(bodies))


def _engine_distances(simulation, lidar):
    """Distances by the engine's rays, without the robot's links."""
    model, data = simulation.engine.current()
    pose = simulation.link_pose(lidar.spec.link) @ lidar.spec.pose
    own = [b for b in range(model.nbody) if model.body(b).name.startswith("kbot/")]
    kept = model.geom_group.copy()
    model.geom_group[np.isin(model.geom_bodyid, own)] = 4
    seen, hit = np.array([1, 1, 1, 1, 0, 1], dtype=np.uint8), np.zeros(1, dtype=np.int32)
    found = []
    for direction in lidar.spec.directions @ pose.rotation.T:
        distance = mujoco.mj_ray(model, data, pose.translation, direction, seen, 1, -1, hit)
        found.append(distance if 0.0 <= distance <= lidar.spec.range_max else math.inf)
    model.geom_group[:] = kept
    return np.array(found)


@pytest.mark.parametrize("count", [12, 120])
@pytest.mark.parametrize("lean", [0.0, 0.6])
@pytest.mark.parametrize("moving", [0, 4])
@pytest.mark.parametrize(
    "beams",
    [{}, {"angle_min": -1.0, "angle_max": 2.5}, {"angle_min": 3.0, "angle_max": -3.0}, {"samples": 1},
     {"angle_min": 0.0, "angle_max": 2 * math.pi}, {"rows": 5, "elevation_min": -0.3, "elevation_max": 0.3}],
)  # fmt: skip
def test_all_ray_methods_equal_the_engines_rays(robot, count, lean, moving, beams):
    simulation = Simulation(robot, _strewn(np.random.default_rng(count), count, lean, moving))
    spec = Lidar(link="base_link", pose=UP, **{"samples": 97, "range_max": 5.0, **beams})
    lidar = simulation.add_sensor(spec)
    for x, y, yaw in [(0.0, 0.0, 0.0), (0.2, -0.3, 2.9)]:
        simulation.models.set_pose(x, y, yaw)
        simulation.run(0.2)
        measured = lidar._beams.rays.cast(*lidar._place(), spec.range_max)
        expected = _engine_distances(simulation, lidar)
        assert (np.isfinite(measured) == np.isfinite(expected)).all()
        hit = np.isfinite(expected)
        assert hit.any() or len(hit) == 1
        assert np.abs(measured[hit] - expected[hit]).max(initial=0.0) < 1e-9


def test_lidar_inside_a_box_sees_its_faces(robot):
    boxes = [box(f"b{i}", (0.1, 0.1, 0.3), 3.0 + 0.2 * i, 4.0) for i in range(60)]
    room = Body(
        "room", (Part(Box((4.0, 2.0, 2.0)), solid=True),), Transform.from_xyz_rpy((0, 0, 1.5), (0, 0, 0))
    )
    simulation = Simulation(robot, World("inside", (floor(), room, *boxes)))
    lidar = simulation.add_sensor(
        Lidar(link="base_footprint", pose=Transform.from_xyz_rpy((0, 0, 1.0), (0, 0, 0)), samples=5)
    )
    # the faces of the box are 2 m ahead and behind, and 1 m to the sides
    assert lidar.distances() == pytest.approx([2.0, 1.0, 2.0, 1.0, 2.0], abs=1e-9)


def test_lidar_sees_a_height_field(robot):
    """The field rises by 1 in 2 from x = 1 m. A level beam 0.1 m above the floor hits it 0.2 m further on."""
    x = np.linspace(-5.0, 5.0, 101)
    heights = np.tile(np.maximum(0.0, (x - 1.0) / 2.0), (11, 1))
    hill = Body("hill", (Part(HeightField(heights, (10.0, 10.0)), ground=True),))
    simulation = Simulation(robot, World("hill", (hill,)))
    lidar = simulation.add_sensor(
        Lidar(link="base_footprint", pose=UP, samples=1, angle_min=0.0, angle_max=0.0)
    )
    assert lidar.distances() == pytest.approx([1.2], abs=2e-3)


def test_an_unknown_link_is_refused_with_the_names_of_some_links():
    with pytest.raises(KbotError, match="robot 'kbot' has no link 'base': choose from "):
        Simulation("kbot").add_sensor(Lidar(link="base"))
