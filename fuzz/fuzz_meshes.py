"""Fuzzes the readers of mesh files.

Any file either gives triangles whose indices are in range, or one KbotError. tests/model/test_hostile_meshes.py has
the inputs that failed.
"""

from functools import partial
from pathlib import Path

import numpy as np
import trimesh
import trimesh.exchange.gltf
from choices import Choices
from edits import edited, real_files

from kbot.model import meshes
from kbot.text import KbotError


def seed(extension: str) -> bytes:
    """A tetrahedron."""
    mesh = trimesh.Trimesh(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
    )
    if extension == "gltf":
        return trimesh.exchange.gltf.export_gltf(trimesh.Scene(mesh), embed_buffers=True, merge_buffers=True)[
            "model.gltf"
        ]
    made = mesh.export(file_type=extension)
    return made.encode() if isinstance(made, str) else made


SEEDS = {ending: real_files(f".{ending}") for ending in meshes.FORMATS}
for ending in meshes.FORMATS:
    if ending != "dae":  # trimesh needs scipy to write it
        SEEDS[ending].append(seed(ending))
SEEDS["stl"].append(
    b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n"
)
SEEDS["ply"].append(trimesh.creation.box().export(file_type="ply", encoding="ascii"))
WORDS = [
    b"<instance_node url='#n'/>", b"<node>", b"</node>", b"usemtl m\n", b"o a\n", b"g a\n", b"f 1 2 3\n", b"f -1/1/1 -2 -3\n",
    b"vt 0 0\n", b"vn 0 0 1\n", b"property list uchar int vertex_indices\n", b"element face 1\n", b"solid a\n", b"endsolid\n",
    b'"bufferView":0,', b'"sparse":{"count":1},', b'"mode":4,', b'"children":[0],', b'"matrix":[1],', b"<triangles/>",
    b'"extensions":{"KHR_draco_mesh_compression":{"bufferView":0,"attributes":{}}},',
]  # fmt: skip


def one_input(ending: str, choices: Choices) -> None:
    file = Path(f"a.{ending}")
    file.write_bytes(edited(choices, SEEDS[ending], WORDS))
    meshes._kept.cache_clear()
    try:
        mesh = meshes.load_mesh(str(file))
    except KbotError:
        return
    assert len(mesh.faces) > 0
    assert 0 <= mesh.faces.min() <= mesh.faces.max() < len(mesh.vertices)
    assert np.abs(mesh.vertices).max() <= meshes.LARGEST


TARGETS = {ending: partial(one_input, ending) for ending in meshes.FORMATS}
