"""Meshes on their way to the page: textured, very large, and missing ones."""

import json
import logging
import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from kbot.model.meshes import MeshPart, Texture, load_mesh
from kbot.sim import Simulation
from kbot.workbench.meshes import store
from kbot.workbench.meshes.simplify import simplify, triangle_count
from kbot.workbench.meshes.store import MeshStore
from kbot.workbench.protocol import FromServer, Refused
from kbot.workbench.serve import open_session, serving

from .conftest import until

URDF = """<robot name="r"><link name="a"><visual><geometry><mesh filename="{mesh}"/></geometry></visual>
<collision><geometry><mesh filename="{mesh}"/></geometry></collision></link></robot>"""

QUAD = (
    "mtllib quad.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
    "usemtl m\nf 1/1 2/2 3/3 4/4\n"
)


@pytest.fixture
def textured(tmp_path: Path) -> Path:
    """A square with an image from another folder of its package: red above, blue below."""
    (tmp_path / "package.xml").write_text("<package><name>p</name></package>")
    for folder in ("meshes", "textures"):
        (tmp_path / folder).mkdir()
    pixels = np.zeros((8, 8, 3), np.uint8)
    pixels[:4], pixels[4:] = (255, 0, 0), (0, 0, 255)
    Image.fromarray(pixels).save(tmp_path / "textures" / "t.png")
    (tmp_path / "meshes" / "quad.mtl").write_text("newmtl m\nKd 1 1 1\nmap_Kd ../textures/t.png\n")
    (tmp_path / "meshes" / "quad.obj").write_text(QUAD)
    return tmp_path / "meshes" / "quad.obj"


def test_a_texture_in_the_package_is_loaded_with_the_mesh(textured: Path) -> None:
    (part,) = load_mesh(str(textured)).parts
    assert part.texture is not None
    assert part.texture.image.size == (8, 8)
    assert part.rgba == pytest.approx((0.5, 0.0, 0.5, 1.0))  # the mean of equal parts of red and blue
    low = part.vertices[:, 1] < 0.5
    assert (part.texture.uv[low, 1] == 0.0).all()


def test_a_texture_outside_the_package_is_not_read(textured: Path) -> None:
    outside = textured.parents[2] / "secret.png"
    Image.new("RGB", (4, 4)).save(outside)
    (textured.parent / "quad.mtl").write_text("newmtl m\nKd 0 1 0\nmap_Kd ../../../secret.png\n")
    (part,) = load_mesh(str(textured)).parts
    assert part.texture is None


def test_a_packed_mesh_contains_its_texture(textured: Path) -> None:
    store = MeshStore()
    packed = store.packed(store.add_file(str(textured)))
    assert packed is not None
    (length,) = struct.unpack("<I", packed[:4])
    (head,) = json.loads(packed[4 : 4 + length])
    start = 4 + length + head["vertices"] * 12 + head["triangles"] * 12
    uv = np.frombuffer(packed, "<f4", head["vertices"] * 2, start).reshape(-1, 2)
    assert uv.min() == 0.0
    assert uv.max() == 1.0
    assert packed[start + uv.nbytes :][:4] == b"\x89PNG"
    assert len(packed) % 4 == 0


def test_a_very_large_mesh_keeps_its_shape_with_fewer_triangles() -> None:
    ball = trimesh.creation.icosphere(subdivisions=6)
    soup = ball.triangles.reshape(-1, 3)  # as in STL, no corner is shared
    (part,) = simplify((MeshPart(soup, np.arange(len(soup)).reshape(-1, 3), None),), 8000)
    assert 7000 < len(part.faces) <= 8100
    assert np.abs(np.linalg.norm(part.vertices, axis=1) - 1.0).max() < 0.005


def test_a_simplified_mesh_keeps_its_texture_coordinates() -> None:
    n = 60
    x, y = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n))
    vertices = np.stack([x, y, 0.05 * np.sin(6 * x)], axis=-1).reshape(-1, 3)
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).reshape(-1)
    faces = np.concatenate(
        [np.stack([corner, corner + 1, corner + n], 1), np.stack([corner + 1, corner + n + 1, corner + n], 1)]
    )
    texture = Texture(vertices[:, :2].copy(), Image.new("RGB", (4, 4)), None)
    (part,) = simplify((MeshPart(vertices, faces, None, texture),), 1500)
    assert part.texture is not None
    assert np.abs(part.texture.uv - part.vertices[:, :2]).max() < 0.06


def test_a_large_mesh_is_simplified_with_a_note_at_its_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(store, "MOST_TRIANGLES", 1000)
    monkeypatch.setattr(store, "simplify", lambda parts: simplify(parts, 800))
    trimesh.creation.icosphere(subdivisions=4).export(tmp_path / "ball.stl")
    file = tmp_path / "r.urdf"
    file.write_text(URDF.format(mesh="ball.stl"))
    session = open_session(str(file), simulate=False)
    (note,) = [found for found in session.findings().findings if found.code == "F007"]
    assert (note.severity, note.place and note.place.line) == ("info", 1)
    assert "5,120 triangles" in note.message
    packed = session.meshes.packed(session.scene.links[0].visuals[0].mesh)
    assert packed is not None
    (length,) = struct.unpack("<I", packed[:4])
    assert json.loads(packed[4 : 4 + length])[0]["triangles"] <= 820
    assert triangle_count(load_mesh(str(tmp_path / "ball.stl")).parts) == 5120  # for physics and checks


def test_a_mesh_that_goes_missing_later_is_reported_again(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    trimesh.creation.box((1, 1, 1)).export(tmp_path / "box.stl")
    file = tmp_path / "r.urdf"
    file.write_text(URDF.format(mesh="box.stl"))
    session = open_session(str(file), simulate=False)
    assert session.missing_meshes() == []
    with caplog.at_level(logging.WARNING), serving(session):
        file.write_text(URDF.format(mesh="bxo.stl"))
        until(lambda: caplog.messages)
    assert any("bxo.stl" in message and "r.urdf:1" in message for message in caplog.messages)


def shown_meshes(description: Path, mesh: str, package_path: tuple[str, ...] = ()) -> tuple[int, list[str]]:
    """Return how many of the description's two parts the page can draw, and the codes of the findings."""
    description.parent.mkdir(parents=True, exist_ok=True)
    description.write_text(URDF.format(mesh=mesh))
    session = open_session(str(description), simulate=False, package_path=package_path)
    (link,) = session.scene.links
    codes = [found.code for found in session.findings().findings]
    assert all(session.meshes.packed(shape.mesh) for shape in (*link.visuals, *link.collisions))
    return len(link.visuals) + len(link.collisions), codes


def make_package(folder: Path, name: str) -> Path:
    folder.mkdir(parents=True)
    (folder / "package.xml").write_text(f"<package><name>{name}</name></package>")
    (folder / "meshes").mkdir()
    trimesh.creation.box((1, 1, 1)).export(folder / "meshes" / "box.stl")
    return folder


@pytest.fixture
def elsewhere(tmp_path: Path) -> Path:
    """A mesh outside any package."""
    folder = tmp_path / "far" / "away"
    folder.mkdir(parents=True)
    trimesh.creation.box((1, 1, 1)).export(folder / "secret.stl")
    return folder / "secret.stl"


@pytest.fixture
def own(tmp_path: Path) -> Path:
    return make_package(tmp_path / "ws" / "robot", "robot")


@pytest.mark.parametrize(
    "mesh",
    [
        "file://{elsewhere}",
        "{elsewhere}",
        "../../../far/away/secret.stl",
        "package://robot/../../far/away/secret.stl",
        "package://robot/%2e%2e/%2e%2e/far/away/secret.stl",
        "file://{own}/meshes/../../../far/away/secret.stl",
        "package://robot/meshes/linked.stl",
        "https://127.0.0.1:9/secret.stl",
    ],
)
def test_a_mesh_outside_packages_is_not_sent_to_the_page(own: Path, elsewhere: Path, mesh: str) -> None:
    (own / "meshes" / "linked.stl").symlink_to(elsewhere)
    shown, codes = shown_meshes(own / "urdf" / "r.urdf", mesh.format(own=own, elsewhere=elsewhere))
    assert shown == 0
    assert codes.count("F008") == 1


@pytest.mark.parametrize(
    "mesh",
    [
        "package://robot/meshes/box.stl",
        "file://{own}/meshes/box.stl",
        "{own}/meshes/box.stl",
        "../meshes/box.stl",
    ],
)
def test_a_mesh_of_the_own_package_is_shown_for_every_form_of_address(own: Path, mesh: str) -> None:
    shown, codes = shown_meshes(own / "urdf" / "r.urdf", mesh.format(own=own))
    assert shown == 2
    assert "F008" not in codes


def test_a_mesh_of_a_package_on_the_path_is_shown(own: Path, tmp_path: Path) -> None:
    parts = make_package(tmp_path / "other" / "place" / "parts", "parts")
    file = own / "urdf" / "r.urdf"
    assert shown_meshes(file, f"file://{parts}/meshes/box.stl")[0] == 0
    assert shown_meshes(file, f"file://{parts}/meshes/box.stl", (str(parts),))[0] == 2


def test_a_package_installed_with_symlinks_is_shown(own: Path, tmp_path: Path) -> None:
    source = make_package(tmp_path / "src" / "deep" / "parts", "parts")
    share = tmp_path / "install" / "share" / "parts"
    (share / "meshes").mkdir(parents=True)
    (share / "package.xml").symlink_to(source / "package.xml")
    (share / "meshes" / "box.stl").symlink_to(source / "meshes" / "box.stl")
    shown, codes = shown_meshes(
        own / "urdf" / "r.urdf", "package://parts/meshes/box.stl", (str(share.parents[1]),)
    )
    assert shown == 2
    assert "F008" not in codes


def test_a_mesh_outside_packages_is_not_in_a_saved_model(own: Path, elsewhere: Path) -> None:
    file = own / "urdf" / "r.urdf"
    file.parent.mkdir()
    file.write_text(URDF.format(mesh=f"file://{elsewhere}"))
    robot, _ = open_session(str(file), simulate=False).standing()
    (visual,) = robot.links["a"].visuals
    assert visual.geometry.path is None


def test_another_robots_meshes_outside_packages_are_not_sent(own: Path, elsewhere: Path) -> None:
    simulations: list[Simulation] = []
    session = open_session("kbot", simulate=True, package_path=(str(own),), on_start=simulations.append)
    findings_seen: list[FromServer] = []
    session.announce = findings_seen.append
    from_own = '<visual><geometry><mesh filename="package://robot/meshes/box.stl"/></geometry></visual>'
    text = URDF.replace("<collision>", f"{from_own}<collision>").format(mesh=f"file://{elsewhere}")
    (file := own / "guest.urdf").write_text(text)
    simulations[0].models.spawn_model(str(file), "guest", x=1.0)
    session.advance(0.02)
    guest = next(body for body in session.scene.bodies if body.name == "guest/a")
    (part,) = guest.parts
    assert session.meshes.packed(part.mesh) is not None
    (refused,) = (message.reason for message in findings_seen if isinstance(message, Refused))
    assert refused.startswith(f"guest/a: the mesh file://{elsewhere} is outside")
    assert session.missing_meshes() == [refused]


def test_very_large_meshes_are_simplified_in_the_worker(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Simplifying takes seconds, in which the page would not be answered."""
    trimesh.creation.icosphere(subdivisions=7, radius=0.1).export(tmp_path / "ball.stl")
    file = tmp_path / "robot.urdf"
    file.write_text('<robot name="r"><link name="base"/></robot>')
    session = open_session(str(file), simulate=False)
    file.write_text(
        '<robot name="r"><link name="base"><visual><geometry><mesh filename="ball.stl"/></geometry></visual>'
        "</link></robot>"
    )
    reading = session.read()
    monkeypatch.setattr("kbot.workbench.meshes.store.simplify", None)
    session.adopt(reading)
    (note,) = [found for found in session.findings().findings if found.code == "F007"]
    assert "327,680 triangles. The page draws" in note.message
