"""Tests reading mesh files that were written by hand or by trimesh."""

import subprocess
import sys

import numpy as np
import pytest
import trimesh
from PIL import Image
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from kbot.model import Mesh
from kbot.model.meshes import load_mesh
from kbot.model.shapes import bounds
from kbot.text import KbotError, Origin, Source

HERE = Origin(Source("", "").whole())

COLLADA = """<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="centimeter" meter="0.01"/><up_axis>Y_UP</up_axis></asset>
<library_effects><effect id="e"><profile_COMMON><technique sid="common"><lambert>
<diffuse><color>1 0 0 1</color></diffuse></lambert></technique></profile_COMMON></effect></library_effects>
<library_materials><material id="m"><instance_effect url="#e"/></material></library_materials>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="9">0 0 0 100 0 0 0 0 50</float_array>
<technique_common><accessor source="#pa" count="3" stride="3">
<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor>
</technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="1" material="s"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s1"><node>
<translate>0 0 10</translate>
<instance_geometry url="#g"><bind_material><technique_common>
<instance_material symbol="s" target="#m"/></technique_common></bind_material></instance_geometry></node>
</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s1"/></scene></COLLADA>
"""


@pytest.fixture
def box():
    made = trimesh.creation.box((1, 2, 3))
    made.apply_translation((0.1, 0.2, 0.3))
    return made


@pytest.mark.parametrize("extension", ["stl", "obj", "glb", "ply"])
def test_formats_give_the_same_triangles(box, tmp_path, extension):
    path = str(tmp_path / f"box.{extension}")
    box.export(path)
    data = load_mesh(path)
    assert len(data.faces) == 12
    assert data.vertices.min(axis=0) == pytest.approx([-0.4, -0.8, -1.2], abs=1e-6)
    assert data.volume == pytest.approx(6.0, rel=1e-6)


def test_collada_unit_and_nodes_are_applied_and_the_up_axis_is_not(tmp_path):
    path = tmp_path / "triangle.DAE"
    path.write_text(COLLADA)
    data = load_mesh(str(path))
    assert data.vertices == pytest.approx(np.array([[0, 0, 0.1], [1, 0, 0.1], [0, 0, 0.6]]))
    assert data.parts[0].rgba == pytest.approx((1, 0, 0, 1))


def test_scale_applies_to_bounds(box, tmp_path):
    path = str(tmp_path / "box.obj")
    box.export(path)
    mesh = Mesh(path, path, (2.0, 0.5, 1.0), HERE)
    low, high = bounds(mesh)
    assert high - low == pytest.approx([2, 1, 3])


def test_a_surface_that_is_inside_out_has_the_same_volume(box, tmp_path):
    box.invert()
    path = str(tmp_path / "box.stl")
    box.export(path)
    assert load_mesh(path).volume == pytest.approx(6.0, rel=1e-6)


def test_an_open_surface_has_no_volume(tmp_path):
    path = tmp_path / "triangle.dae"
    path.write_text(COLLADA)
    assert load_mesh(str(path)).volume is None


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.stl", b"not a mesh", "cannot be read|no triangle"),
        ("a.stl", bytes(range(128, 228)), "it is not a .stl file"),
        ("a.dae", b"<COLLADA", "cannot be read"),
        ("a.obj", b"", "cannot be read|no triangle"),
        ("a.txt", b"hello", "has an unknown format"),
        (
            "a.stl",
            b"version https://git-lfs.github.com/spec/v1\noid",
            "only a pointer of Git LFS",
        ),
    ],
)
def test_broken_files_are_one_clear_error(tmp_path, name, content, message):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(KbotError, match=message):
        load_mesh(str(path))


def test_a_missing_file_is_one_clear_error(tmp_path):
    with pytest.raises(KbotError, match="cannot be read"):
        load_mesh(str(tmp_path / "none.stl"))


def test_a_file_that_changes_is_read_again(box, tmp_path):
    path = tmp_path / "box.obj"
    box.export(str(path))
    assert load_mesh(str(path)) is load_mesh(str(path))
    box.apply_scale(2.0)
    path.write_text(path.read_text() + "\n# longer")
    before = load_mesh(str(path)).vertices.max()
    box.export(str(path))
    assert load_mesh(str(path)).vertices.max() == pytest.approx(2 * before)


def test_meshes_with_the_same_texture_share_its_picture(tmp_path):
    """They are decoded once, which takes longer than reading the triangles."""
    for name in ("a", "b"):
        picture = Image.new("RGB", (16, 16), (255, 0, 0))
        board = trimesh.Trimesh(
            [[0, 0, 0], [1, 0, 0], [0, 1, 0]],
            [[0, 1, 2]],
            process=False,
            visual=TextureVisuals(np.eye(3)[:, :2], PBRMaterial(baseColorTexture=picture)),
        )
        board.export(tmp_path / f"{name}.glb")
    first, second = (load_mesh(str(tmp_path / f"{name}.glb")).parts[0] for name in ("a", "b"))
    assert first.texture.image is second.texture.image
    assert first.rgba == second.rgba == pytest.approx((1, 0, 0, 1))


def test_the_corners_of_a_collada_file_are_joined_unless_their_normals_differ(tmp_path):
    box = trimesh.creation.box((1, 2, 3))
    box.export(tmp_path / "smooth.dae")
    flat = trimesh.Trimesh(box.triangles.reshape(-1, 3), np.arange(36).reshape(-1, 3), process=False)
    flat.export(tmp_path / "flat.dae")
    assert len(load_mesh(str(tmp_path / "smooth.dae")).vertices) == 8
    assert len(load_mesh(str(tmp_path / "flat.dae")).vertices) == 24


def test_a_missing_texture_prints_no_traceback(tmp_path):
    texture = (
        '<newparam sid="f"><surface type="2D"><init_from>i</init_from></surface></newparam>'
        '<newparam sid="t"><sampler2D><source>f</source></sampler2D></newparam>'
        '<technique sid="common"><lambert>'
        '<emission><texture texture="t" texcoord="UV"/></emission>'
    )
    images = '<library_images><image id="i"><init_from>gone.png</init_from></image></library_images>'
    text = COLLADA.replace('<technique sid="common"><lambert>\n', texture)
    assert texture in text
    (tmp_path / "a.dae").write_text(text.replace("<library_effects>", f"{images}<library_effects>"))
    program = (
        f"from kbot.model.meshes import load_mesh; print(load_mesh({str(tmp_path / 'a.dae')!r}) is not None)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert (done.stdout.strip(), done.stderr) == ("True", "")
