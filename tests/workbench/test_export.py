"""Pictures, models and trees of a robot, compared with an independent projection of the model."""

import io
import json
import struct
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image

from kbot.kinematics import FrameTree
from kbot.model.load import load_robot
from kbot.render.glb import Y_UP_FROM_Z_UP, glb
from kbot.render.look import FIELD_OF_VIEW, Look
from kbot.render.normals import creased
from kbot.render.picture import draw_picture
from kbot.render.picture_scene import PictureScene, robot_alone, robot_in_world
from kbot.render.tree import tree_svg
from kbot.sim import Simulation
from kbot.text import KbotError

from .projection import link_image, overlap

SVG = "{http://www.w3.org/2000/svg}"
JOINTS = {"left_wheel_joint": 0.7, "right_wheel_joint": -0.4}

ARM = """<robot name="arm">
  <link name="foot"><visual><geometry><box size="0.2 0.2 0.02"/></geometry></visual></link>
  <link name="upper"><visual><origin xyz="0 0 0.15"/><geometry><box size="0.03 0.05 0.3"/></geometry>
    <material name="r"><color rgba="1 0.5 0 0.5"/></material></visual></link>
  <link name="lower"><visual><origin xyz="0.1 0 0" rpy="0 1.5708 0"/>
    <geometry><cylinder radius="0.02" length="0.2"/></geometry></visual></link>
  <link name="hand"/>
  <joint name="shoulder" type="revolute"><origin xyz="0 0 0.01" rpy="0 0 0.5"/><axis xyz="0 2 0"/>
    <parent link="foot"/><child link="upper"/>
    <limit lower="-1.5" upper="1.5" effort="1" velocity="1"/></joint>
  <joint name="elbow" type="revolute"><origin xyz="0 0 0.3"/><axis xyz="1 1 0"/><mimic joint="shoulder"
    multiplier="-0.5" offset="0.2"/><parent link="upper"/><child link="lower"/>
    <limit lower="-1.5" upper="1.5" effort="1" velocity="1"/></joint>
  <joint name="slide" type="prismatic"><origin xyz="0.2 0 0" rpy="0.3 0 0"/><axis xyz="0 0 1"/>
    <parent link="lower"/><child link="hand"/><limit lower="0" upper="0.1" effort="1" velocity="1"/></joint>
</robot>"""


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    path = tmp_path / "arm.urdf"
    path.write_text(ARM)
    return path


def perspective(things: PictureScene, look: Look) -> np.ndarray:
    """`clip_from_world` (4, 4) by OpenGL's formulas, of a camera as `Look` describes it."""
    away = things.view_radius * 1.35 * 1.05 / np.sin(np.radians(16.0)) / min(1.0, look.aspect)
    world = np.eye(4)
    world[:3, :3] = look.axes.T
    world[:3, 3] = -look.axes.T @ (things.centre + look.towards_eye * away)
    near, far, f = away / 100.0, away * 200.0, 1.0 / np.tan(FIELD_OF_VIEW / 2.0)
    clip = np.zeros((4, 4))
    clip[0, 0], clip[1, 1], clip[3, 2] = f / look.aspect, f, -1.0
    clip[2, 2], clip[2, 3] = (far + near) / (near - far), 2.0 * far * near / (near - far)
    return clip @ world


def opened(data: bytes) -> np.ndarray:
    image = Image.open(io.BytesIO(data))
    assert image.format == "PNG"
    return np.asarray(image)


@pytest.mark.parametrize(("azimuth", "elevation"), [(215.0, 28.0), (30.0, -20.0), (90.0, 90.0)])
def test_a_transparent_picture_covers_what_the_model_covers(
    xacro: Path, azimuth: float, elevation: float
) -> None:
    robot = load_robot(str(xacro)).require()
    look = Look(400, 300, azimuth, elevation, transparent=True)
    things = robot_alone(robot, JOINTS)
    image = opened(draw_picture(things, look))
    assert image.shape == (300, 400, 4)
    expected = link_image(robot, perspective(things, look), 400, 300, joints=JOINTS) >= 0
    assert overlap(image[..., 3] > 127, expected) > 0.985


def test_a_displaced_picture_fails_the_same_measure(xacro: Path) -> None:
    robot = load_robot(str(xacro)).require()
    look = Look(400, 300, transparent=True)
    things = robot_alone(robot)
    image = opened(draw_picture(things, look))
    clip = perspective(things, look)
    clip = clip @ np.array([[1, 0, 0, 0.002], [0, 1, 0, 0], [0, 0, 1, 0.002], [0, 0, 0, 1]])
    assert overlap(image[..., 3] > 127, link_image(robot, clip, 400, 300) >= 0) < 0.985


def test_an_opaque_picture_shows_the_robot_on_the_floor(xacro: Path) -> None:
    robot = load_robot(str(xacro)).require()
    looks = [Look(400, 300, 270.0, 89.0, theme=theme) for theme in ("dark", "light")]
    things = robot_alone(robot)
    dark, light = (opened(draw_picture(things, look)).astype(int) for look in looks)
    assert dark.shape == (300, 400, 3)
    index = list(robot.links).index("base_link")
    plate = link_image(robot, perspective(things, looks[0]), 400, 300) == index
    for image in (dark, light):
        r, g, b = np.median(image[plate], axis=0)
        assert b > 120  # KBot's plate is blue
        assert max(r, g) < 60
    assert dark[5, 5].max() < 90
    assert light[5, 5].min() > 200


def test_a_line_painted_on_the_floor_is_in_the_picture() -> None:
    """The line of the track goes through the start, along x: its pixels are black on a white floor."""
    scene = robot_in_world(Simulation("kbot", world="track"))
    drawn = draw_picture(scene, Look(240, 150, elevation=60.0, theme="light"))
    line = np.asarray(Image.open(io.BytesIO(drawn)).convert("L"))[-20:] < 60  # the nearest part of the floor
    assert 20 < line.sum() < 500


def test_without_opengl_the_error_says_what_to_install(xacro: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing(width: int, height: int) -> None:
        raise KbotError("cameras need off-screen OpenGL, which is not available: install it")

    monkeypatch.setattr("kbot.render.offscreen._context", nothing)
    with pytest.raises(KbotError, match="pictures need off-screen OpenGL, which is not available"):
        draw_picture(robot_alone(load_robot(str(xacro)).require()), Look(40, 30))


@pytest.mark.parametrize("size", [(1, 1), (1, 30), (30, 1)])
def test_a_picture_may_be_one_pixel_wide_or_high(xacro: Path, size: tuple[int, int]) -> None:
    image = opened(draw_picture(robot_alone(load_robot(str(xacro)).require()), Look(*size)))
    assert image.shape == (size[1], size[0], 3)


@pytest.mark.parametrize("transparent", [False, True])
def test_the_bands_of_a_picture_have_no_seams(
    xacro: Path, transparent: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A picture that is mixed row by row has the same pixels as one that is mixed at once."""
    things = robot_alone(load_robot(str(xacro)).require())
    look = Look(80, 60, elevation=5.0, transparent=transparent)
    pictures = []
    for pixels in (1, 80 * 60):
        monkeypatch.setattr("kbot.render.picture._BAND_PIXELS", pixels)
        pictures.append(opened(draw_picture(things, look)))
    assert (pictures[0] == pictures[1]).all()


@pytest.mark.parametrize("size", [(0, 10), (10, 0), (10_000, 10)])
def test_invalid_picture_sizes_are_refused(size: tuple[int, int]) -> None:
    with pytest.raises(KbotError, match="width and height must be 1 to 8192 pixels"):
        Look(*size)


def read_glb(data: bytes) -> dict:
    magic, version, total, length, kind = struct.unpack("<4sIII4s", data[:20])
    assert (magic, version, total, kind) == (b"glTF", 2, len(data), b"JSON")
    return json.loads(data[20 : 20 + length])


def test_the_nodes_of_a_glb_file_are_the_links(arm: Path) -> None:
    robot = load_robot(str(arm)).require()
    nodes = read_glb(glb(robot))["nodes"]
    children = {n["name"]: {nodes[i]["name"] for i in n.get("children", ())} for n in nodes}
    assert {"upper"} <= children["foot"]
    assert {"lower"} <= children["upper"]
    assert {"hand"} <= children["lower"]
    assert children["hand"] == set()


def test_a_glb_file_is_y_up_and_has_the_given_joint_positions(arm: Path) -> None:
    robot, joints = load_robot(str(arm)).require(), {"shoulder": 0.6, "slide": 0.05}
    scene = trimesh.load_scene(io.BytesIO(glb(robot, joints)), file_type="glb")
    for name, pose in FrameTree(robot).poses(joints).items():
        matrix, _ = scene.graph[name]
        assert matrix == pytest.approx(Y_UP_FROM_Z_UP @ pose.matrix, abs=1e-6)
    # glTF: y is up and the front faces +z. REP 103: z is up and the front faces +x
    up, ahead = Y_UP_FROM_Z_UP @ (0, 0, 1, 1), Y_UP_FROM_Z_UP @ (1, 0, 0, 1)
    assert up == pytest.approx((0, 1, 0, 1))
    assert ahead == pytest.approx((0, 0, 1, 1))
    assert np.linalg.det(Y_UP_FROM_Z_UP) == pytest.approx(1.0)


def test_colours_of_a_glb_file_are_linear_with_opacity(arm: Path) -> None:
    document = read_glb(glb(load_robot(str(arm)).require()))
    (material,) = [m for m in document["materials"] if m["name"] == "upper/visual_0"]
    # sRGB 0.5 is 0.2140 in linear light (IEC 61966-2-1)
    assert material["pbrMetallicRoughness"]["baseColorFactor"] == pytest.approx([1, 0.214, 0, 0.5], abs=0.003)
    assert material["alphaMode"] == "BLEND"


def test_normals_are_sharp_at_edges_and_smooth_elsewhere() -> None:
    box = trimesh.creation.box((1, 2, 3))
    _, normals, faces, was = creased(box.vertices, box.faces)
    assert len(normals) == 24
    assert np.abs(normals).max(axis=1) == pytest.approx(1.0)
    assert (was[faces] == box.faces).all()
    ball = trimesh.creation.icosphere(subdivisions=3)
    vertices, normals, _, _ = creased(ball.vertices, ball.faces)
    assert len(vertices) == len(ball.vertices)
    assert np.einsum("ij,ij->i", vertices, normals).min() > 0.999


def test_the_tree_contains_every_link_and_joint_once(arm: Path) -> None:
    root = ET.fromstring(tree_svg(load_robot(str(arm)).require()))
    tips = [group.find(f"{SVG}title").text for group in root.iter(f"{SVG}g")]
    assert sorted(tips) == sorted(
        ["foot", "upper", "lower", "hand", "shoulder: revolute", "elbow: revolute", "slide: prismatic"]
    )
    left = {g.get("id"): float(g.find(f"{SVG}rect").get("x")) for g in root.iter(f"{SVG}g") if g.get("id")}
    assert left["foot"] < left["upper"] < left["lower"] < left["hand"]


SHAPES = {
    "a triangle": "<mesh filename='{}'/>",
    "no box": "<box size='0 0 0'/>",
    "a line": "<box size='1 0 0'/>",
    "a sheet": "<box size='1 1 0'/>",
    "no ball": "<sphere radius='0'/>",
    "a hair": "<cylinder radius='0' length='1'/>",
    "a speck": "<box size='1e-300 1e-300 1e-300'/>",
}


@pytest.mark.parametrize("shape", SHAPES)
def test_shapes_without_volume_are_drawn_if_visible(tmp_path: Path, shape: str) -> None:
    file = tmp_path / "triangle.stl"
    trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]).export(file)
    urdf = tmp_path / "odd.urdf"
    flat = SHAPES[shape].format(file)
    body = "<visual><origin xyz='0 0 1'/><geometry><box size='0.1 0.1 0.1'/></geometry></visual>"
    urdf.write_text(
        f"<robot name='odd'><link name='a'>{body}<visual><geometry>{flat}</geometry></visual></link></robot>"
    )
    robot = load_robot(str(urdf)).require()
    look = Look(64, 64, azimuth=-90.0, elevation=90.0, transparent=True)
    covered = (
        np.asarray(Image.open(io.BytesIO(draw_picture(robot_alone(robot), look))))[..., 3].mean() / 255.0
    )
    assert (covered > 0.05) == (shape in ("a triangle", "a sheet"))
    assert trimesh.load(io.BytesIO(glb(robot)), file_type="glb").geometry


@pytest.mark.parametrize("kind", ["png", "glb"])
def test_too_many_triangles_in_all_visuals_are_an_error(
    kind: str, tmp_path: Path, measured_kbot: Callable[..., Any]
) -> None:
    """250,001 triangles in a mesh that two visuals show."""
    triangle = struct.pack("<12fH", 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0)
    (tmp_path / "a.stl").write_bytes(bytes(80) + struct.pack("<I", 250_001) + triangle * 250_001)
    visual = '<visual><geometry><mesh filename="a.stl"/></geometry></visual>'
    (tmp_path / "a.urdf").write_text(f'<robot name="a"><link name="base">{visual * 2}</link></robot>')
    result = measured_kbot("export", "a.urdf", "--to", kind)
    assert result.status == 2
    message = "the visuals of the robot have more than 500000 triangles. The link 'base' exceeds the limit"
    assert message in result.err
    assert result.cpu_s < 5
    assert result.peak_bytes < 400e6
    assert not list(tmp_path.glob(f"a.{kind}"))
