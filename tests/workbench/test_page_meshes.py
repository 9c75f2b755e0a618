"""Mesh files of every format in the picture, and their changes on disk."""

import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from kbot.model.load import load_robot
from kbot.workbench.serve import open_session

from .conftest import until
from .pictures import id_image, screenshot
from .projection import link_image, overlap
from .served import served

OpenPage = Callable[..., Any]

SIZE = (0.2, 0.1, 0.05)
"""Of the brick that each file holds, m."""
RIGHT = 0.985
MATERIALS = "newmtl red\nKd 1 0 0\n\nnewmtl glass\nKd 0 0 1\nd 0.25\n\nnewmtl fog\nKd 1 1 1\nTr 0.75\n"
COLLADA = """<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="centimeter" meter="0.01"/><up_axis>Y_UP</up_axis></asset>
<library_effects><effect id="e"><profile_COMMON><technique sid="t"><phong>
<diffuse><color>0 1 0 1</color></diffuse></phong></technique></profile_COMMON></effect></library_effects>
<library_materials><material id="m"><instance_effect url="#e"/></material></library_materials>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="24">{numbers}</float_array><technique_common>
<accessor source="#a" count="8" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="12" material="s"><input semantic="VERTEX" source="#v" offset="0"/>
<p>{corners}</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="w"><node><instance_geometry url="#g">
<bind_material><technique_common>
<instance_material symbol="s" target="#m"/></technique_common></bind_material></instance_geometry></node>
</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#w"/></scene></COLLADA>"""


def brick(folder: Path, name: str, factor: float = 1.0) -> None:
    """Return a brick in a file, as programs write it."""
    box = trimesh.creation.box([size * factor for size in SIZE])
    numbers = " ".join(str(100 * value) for value in box.vertices.ravel())
    corners = " ".join(map(str, box.faces.ravel()))
    binary = trimesh.exchange.stl.export_stl(box)
    obj = "".join(f"v {x} {y} {z}\n" for x, y, z in box.vertices)
    faces = "".join(f"f {a} {b} {c}\n" for a, b, c in box.faces + 1)
    gltf = trimesh.exchange.gltf.export_gltf(trimesh.Scene(box)) if name.endswith(".gltf") else {}
    content = {
        "binary.stl": lambda: binary,
        "solid.stl": lambda: b"solid of a program that does not know better".ljust(80) + binary[80:],
        "ascii.stl": lambda: trimesh.exchange.stl.export_stl_ascii(box).replace("\n", "\r\n").encode(),
        "red.obj": lambda: f"mtllib all.mtl\n{obj}usemtl red\n{faces}".encode(),
        "glass.obj": lambda: f"mtllib all.mtl\n{obj}usemtl glass\n{faces}".encode(),
        "fog.obj": lambda: f"mtllib all.mtl\n{obj}usemtl fog\n{faces}".encode(),
        "green.dae": lambda: COLLADA.format(numbers=numbers, corners=corners).encode(),
        "one.glb": lambda: trimesh.exchange.gltf.export_glb(trimesh.Scene(box)),
        "two.gltf": lambda: gltf["model.gltf"],
    }[name]()
    for other in gltf.keys() - {"model.gltf"}:
        (folder / other).write_bytes(gltf[other])
    (folder / "all.mtl").write_text(MATERIALS)
    (folder / name).write_bytes(content)


FILES = ("binary.stl", "solid.stl", "ascii.stl", "red.obj", "green.dae", "one.glb", "two.gltf")


def wall(shapes: dict[str, str]) -> str:
    """Return a robot of links next to each other, each with a shape."""
    text = "<link name='base'/>"
    for count, (name, shape) in enumerate(shapes.items()):
        text += f"<link name='{name}'><visual><geometry>{shape}</geometry></visual></link>"
        x, y = 0.26 * (count % 3 - 1), 0.16 * (count // 3 - 1)
        text += f"<joint name='to_{name}' type='fixed'><origin xyz='{x} {y} 0' rpy='0.2 0.3 0.1'/>"
        text += f"<parent link='base'/><child link='{name}'/></joint>"
    return f"<robot name='wall'>{text}</robot>"


def box(factor: float = 1.0) -> str:
    return f"<box size='{' '.join(str(size * factor) for size in SIZE)}'/>"


def agree(page: Any, text: str, folder: Path) -> dict[str, float]:
    """Return how well each link's mask agrees with that of the description `text`."""
    (folder / "expected.urdf").write_text(text)
    robot = load_robot(str(folder / "expected.urdf")).require()
    image, _ = id_image(page)
    clip = np.array(page.evaluate("kbot.camera().clipFromWorld")).reshape(4, 4)
    expected = link_image(robot, clip, image.shape[1], image.shape[0])
    names = list(robot.links)
    return {name: overlap(image == names.index(name), expected == names.index(name)) for name in names[1:]}


def test_each_format_has_its_size_and_its_colour(tmp_path: Path, open_page: OpenPage) -> None:
    for name in FILES:
        brick(tmp_path, name)
    file = tmp_path / "wall.urdf"
    file.write_text(wall({name: f"<mesh filename='{name}'/>" for name in FILES}))
    expected = wall(dict.fromkeys(FILES, box()))
    with served(open_session(str(file), simulate=False)) as address:
        page = open_page(address, viewport={"width": 1180, "height": 640})
        page.evaluate("kbot.look([0, -0.3, 1.2], [0, 0, 0])")
        until(lambda: min(agree(page, expected, tmp_path).values()) > RIGHT)
        wrong = wall(dict.fromkeys(FILES, box(1.03)))
        assert max(agree(page, wrong, tmp_path).values()) < RIGHT
        image, links = id_image(page)
        shown = screenshot(page).astype(int)
        for name, channel in (("red.obj", 0), ("green.dae", 1)):
            colour = np.median(shown[image == links.index(name)], axis=0)
            assert colour[channel] > 3 * np.delete(colour, channel).max(), name


def test_a_mesh_changed_on_disk_changes_in_the_picture(tmp_path: Path, open_page: OpenPage) -> None:
    file = tmp_path / "wall.urdf"
    file.write_text(wall({"part": "<mesh filename='binary.stl'/>"}))
    with served(open_session(str(file), simulate=False)) as address:
        page = open_page(address)
        page.evaluate("kbot.look([-0.26, -0.3, 1.2], [-0.26, -0.16, 0])")

        def is_drawn(factor: float) -> bool:
            return agree(page, wall({"part": box(factor)}), tmp_path)["part"] > RIGHT

        findings = page.locator("#findings")
        assert "does not exist" in findings.inner_text()
        brick(tmp_path, "binary.stl")
        until(lambda: is_drawn(1.0))
        until(lambda: "does not exist" not in findings.inner_text())
        brick(tmp_path, "binary.stl", 1.5)
        until(lambda: is_drawn(1.5))
        whole = (tmp_path / "binary.stl").read_bytes()
        (tmp_path / "binary.stl").write_bytes(whole[: len(whole) // 2])
        until(lambda: "cannot be read" in findings.inner_text())
        (tmp_path / "binary.stl").write_bytes(whole)
        until(lambda: is_drawn(1.5) and "cannot be read" not in findings.inner_text())


@pytest.mark.parametrize(("name", "alpha"), [("red.obj", 1.0), ("glass.obj", 0.25), ("fog.obj", 0.25)])
def test_a_material_has_its_opacity(tmp_path: Path, name: str, alpha: float) -> None:
    brick(tmp_path, name)
    (tmp_path / "r.urdf").write_text(wall({"part": f"<mesh filename='{name}'/>"}))
    session = open_session(str(tmp_path / "r.urdf"), simulate=False)
    packed = session.meshes.packed(session.scene.links[1].visuals[0].mesh)
    assert packed is not None
    (length,) = struct.unpack("<I", packed[:4])
    (head,) = json.loads(packed[4 : 4 + length])
    assert head["rgba"][3] == pytest.approx(alpha, abs=0.003)
