"""The scene that the page draws."""

import json
import struct
from pathlib import Path

import numpy as np
import pytest

from kbot.model.load import load_robot_text
from kbot.render.picture_scene import robot_alone, robot_in_world
from kbot.sim import Simulation
from kbot.workbench.meshes.store import MeshStore
from kbot.workbench.protocol import Scene
from kbot.workbench.scene.scene import OWN_COLOURS, build_scene
from kbot.world import load_world

TETRAHEDRON = """v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
f 1 3 2
f 1 2 4
f 1 4 3
f 2 3 4
"""


def scene_of(text: str, path: Path, meshes: MeshStore | None = None) -> Scene:
    robot = load_robot_text(f'<robot name="r">{text}</robot>', path / "r.urdf").require()
    return build_scene(
        robot, None, meshes or MeshStore(), 1, frame="world", on_ground=False, controls={}, others={}
    )


def test_an_inertia_is_shown_as_its_equivalent_box(tmp_path: Path) -> None:
    # a box of 0.1 x 0.2 x 0.3 m and 2 kg, rotated by 30 degrees about x
    x, y, z, m = 0.1, 0.2, 0.3, 2.0
    i = [m / 12 * v for v in (y * y + z * z, x * x + z * z, x * x + y * y)]
    scene = scene_of(
        f'<link name="a"><inertial><origin xyz="1 0 0" rpy="0.5235987755982988 0 0"/><mass value="{m}"/>'
        f'<inertia ixx="{i[0]}" ixy="0" ixz="0" iyy="{i[1]}" iyz="0" izz="{i[2]}"/></inertial></link>',
        tmp_path,
    )
    inertia = scene.links[0].inertia
    assert inertia is not None
    assert sorted(inertia.box) == pytest.approx([x, y, z])
    assert inertia.position == (1.0, 0.0, 0.0)
    turn = np.array(inertia.quaternion)
    axes = rotation(turn) @ np.diag(inertia.box)
    expected = rotation(np.array([np.sin(np.pi / 12), 0, 0, np.cos(np.pi / 12)])) @ np.diag([x, y, z])
    assert np.abs(axes @ axes.T - expected @ expected.T).max() < 1e-12


def rotation(q: np.ndarray) -> np.ndarray:
    x, y, z, w = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def test_the_grid_is_below_the_robot(tmp_path: Path) -> None:
    box = '<link name="a"><visual><geometry><box size="0.2 0.4 0.6"/></geometry></visual></link>'
    scene = scene_of(box, tmp_path)
    assert scene.ground == pytest.approx(-0.3)
    assert scene.radius == pytest.approx(np.sqrt(0.1**2 + 0.2**2 + 0.3**2))
    assert scene.centre == pytest.approx((0, 0, 0))
    lifted = scene_of(box.replace("<geometry>", '<origin xyz="0 0 1"/><geometry>'), tmp_path)
    assert lifted.ground == 0.0
    assert lifted.centre == pytest.approx((0, 0, 1))


def mesh_link(uri: str, scale: str = "") -> str:
    mesh = f'<mesh filename="{uri}" {scale}/>'
    return f'<link name="a"><visual><geometry>{mesh}</geometry></visual></link>'


def test_a_mesh_is_sent_unchanged_by_its_id(tmp_path: Path) -> None:
    (tmp_path / "t.obj").write_text(TETRAHEDRON)
    meshes = MeshStore()
    scene = scene_of(
        mesh_link(f"file://{tmp_path}/t.obj", 'scale="2 2 2"'),
        tmp_path,
        meshes,
    )
    (shape,) = scene.links[0].visuals
    assert (shape.kind, shape.size, shape.rgba) == ("mesh", (2.0, 2.0, 2.0), OWN_COLOURS)
    assert str(tmp_path) not in shape.mesh
    packed = meshes.packed(shape.mesh)
    assert packed is not None
    (length,) = struct.unpack_from("<I", packed)
    (head,) = json.loads(packed[4 : 4 + length])
    at = 4 + length
    vertices = np.frombuffer(packed, "<f4", head["vertices"] * 3, at).reshape(-1, 3)
    faces = np.frombuffer(packed, "<u4", head["triangles"] * 3, at + vertices.nbytes).reshape(-1, 3)
    assert head["triangles"] == 4
    a, b, c = vertices[faces].astype(float).transpose(1, 0, 2)
    assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6 == pytest.approx(1 / 6)
    assert meshes.packed("../t.obj") is None


def test_a_missing_mesh_is_skipped(tmp_path: Path) -> None:
    scene = scene_of(
        '<link name="a"><visual><geometry><mesh filename="package://no/t.obj"/></geometry></visual></link>',
        tmp_path,
    )
    assert scene.links[0].visuals == ()


def test_a_world_is_drawn_without_its_level_ground(tmp_path: Path) -> None:
    robot = load_robot_text('<robot name="r"><link name="a"/></robot>', tmp_path / "r.urdf").require()
    world = load_world("boxes")
    scene = build_scene(robot, world, MeshStore(), 1, frame="world", on_ground=True, controls={}, others={})
    assert {body.name for body in scene.bodies} == {b.name for b in world.bodies} - {world.bodies[0].name}
    assert {part.kind for body in scene.bodies for part in body.parts} == {"box", "cylinder"}


def test_colours_are_gazebos_in_a_world_and_rvizs_without_one(tmp_path: Path) -> None:
    shape = (
        '<visual><geometry><box size="1 1 1"/></geometry>'
        '<material name="m"><color rgba="0 1 0 1"/></material></visual>'
    )
    robot = load_robot_text(
        f'<robot name="r"><link name="a">{shape}</link>'
        '<gazebo reference="a"><material>Gazebo/Red</material></gazebo></robot>',
        tmp_path / "r.urdf",
    ).require()
    for world, rgba in ((None, (0.0, 1.0, 0.0, 1.0)), (load_world("empty"), (1.0, 0.0, 0.0, 1.0))):
        scene = build_scene(
            robot, world, MeshStore(), 1, frame="world", on_ground=True, controls={}, others={}
        )
        assert scene.links[0].visuals[0].rgba == rgba
    (alone,) = robot_alone(robot).links["a"]
    (simulated,) = robot_in_world(Simulation(robot)).links["a"]
    assert (alone.rgba, simulated.rgba) == ((0.0, 1.0, 0.0, 1.0), (1.0, 0.0, 0.0, 1.0))


def test_the_place_of_a_missing_mesh_is_in_the_picture(tmp_path: Path) -> None:
    scene = scene_of(
        '<link name="a"/><link name="b"><visual><geometry><mesh filename="package://no/t.obj"/></geometry>'
        '</visual></link><link name="c"><visual><geometry><box size="1 1 1"/></geometry></visual></link>'
        '<joint name="j" type="fixed"><parent link="a"/><child link="b"/><origin xyz="3 0 0"/></joint>'
        '<joint name="k" type="fixed"><parent link="a"/><child link="c"/></joint>',
        tmp_path,
    )
    # from -0.5 to 3 along x, 1 m wide and high
    assert scene.centre == pytest.approx((1.25, 0.0, 0.0))
    assert scene.radius == pytest.approx(np.sqrt(3.5**2 + 2) / 2)


def test_every_built_in_world_can_be_drawn(tmp_path: Path) -> None:
    robot = load_robot_text('<robot name="r"><link name="a"/></robot>', tmp_path / "r.urdf").require()
    for name in ("empty", "boxes"):
        build_scene(
            robot, load_world(name), MeshStore(), 1, frame="world", on_ground=True, controls={}, others={}
        )
