"""Hollow meshes are split into pieces that leave their inside free."""

import numpy as np
import trimesh

from kbot.world.convex_decomposition import convex_pieces
from kbot.world.world import TriangleMesh


def mesh(solid: trimesh.Trimesh) -> TriangleMesh:
    return TriangleMesh(np.array(solid.vertices, dtype=np.float64), np.array(solid.faces, dtype=np.int32))


def test_convex_mesh_is_one_piece():
    for solid in (
        trimesh.creation.box((1, 2, 3)),
        trimesh.creation.icosphere(2),
        trimesh.creation.cylinder(1, 2),
    ):
        whole = mesh(solid)
        assert convex_pieces(whole) == (whole,)


def test_two_boxes_in_one_mesh_are_two_pieces():
    first, second = trimesh.creation.box((1, 1, 1)), trimesh.creation.box((1, 1, 1))
    second.apply_translation((3, 0, 0))
    pieces = convex_pieces(mesh(trimesh.util.concatenate([first, second])))
    middles = sorted(round(float(piece.vertices.mean(axis=0)[0]), 6) for piece in pieces)
    assert middles == [0.0, 3.0]


def test_ring_is_open_in_its_middle():
    """The ring becomes thin plates, and none of them is near the middle."""
    ring = mesh(trimesh.creation.annulus(r_min=1.0, r_max=1.1, height=0.5))
    pieces = convex_pieces(ring)
    assert len(pieces) == len(ring.faces)
    for piece in pieces:
        assert np.linalg.norm(piece.vertices.mean(axis=0)[:2]) > 0.9
