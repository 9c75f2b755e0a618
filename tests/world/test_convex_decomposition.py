"""Hollow meshes are split into pieces that leave their inside free."""

import numpy as np
import pytest
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
    pieces = convex_pieces(mesh(trimesh.creation.annulus(r_min=1.0, r_max=1.1, height=0.5)))
    for piece in pieces:
        assert np.linalg.norm(piece.vertices.mean(axis=0)[:2]) > 0.9


def front(piece: TriangleMesh) -> float:
    """The area in m^2 of the front of a plate, which is the half of its vertices behind."""
    corners = piece.vertices[piece.faces[(piece.faces >= len(piece.vertices) // 2).all(axis=1)]]
    across, along = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return float(np.linalg.norm(np.cross(across, along), axis=1).sum() / 2)


def test_triangles_in_a_plane_are_one_plate():
    """A room with six walls of 1 m, each of two triangles, becomes six plates of 5 mm outside of it."""
    room = trimesh.creation.box((1, 1, 1))
    room.invert()
    pieces = convex_pieces(mesh(room))
    assert [len(piece.vertices) for piece in pieces] == [8] * 6
    for piece in pieces:
        plate = trimesh.Trimesh(piece.vertices, piece.faces, process=False)
        assert plate.is_watertight
        assert plate.volume == pytest.approx(0.005)
        assert np.abs(piece.vertices).max() == pytest.approx(0.505)


def test_plates_cover_a_surface_and_fill_no_corner():
    """The floor of an L is not convex: a plate over all of it would fill the corner."""
    corners = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]], dtype=np.float64)
    low = np.column_stack([corners, np.zeros(6)])
    flat = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]])
    walls = [side for a in range(6) for b in [(a + 1) % 6] for side in ([a, b, b + 6], [a, b + 6, a + 6])]
    faces = np.vstack([flat[:, ::-1], flat + 6, walls]).astype(np.int32)
    pieces = convex_pieces(TriangleMesh(np.vstack([low, low + np.array([0.0, 0.0, 0.5])]), faces))
    assert len(pieces) < 6 + 2 * 3
    assert sum(map(front, pieces)) == pytest.approx(2 * 3.0 + 8 * 0.5)
    for piece in pieces:
        plate = trimesh.Trimesh(piece.vertices, piece.faces, process=False)
        assert plate.volume == pytest.approx(0.005 * front(piece))


def test_slivers_get_no_plate():
    """The engine's library would print warnings about their hulls."""
    box = trimesh.creation.box((1, 1, 1))
    vertices = np.vstack(
        [box.vertices, box.vertices[box.faces[0]].mean(axis=0), [[0, 0, 9], [1, 0, 9], [2, 1e-5, 9]]]
    )
    faces = np.vstack([box.faces[:-1], [[9, 10, 11], [9, 11, 10]]]).astype(np.int32)
    assert all(piece.vertices[:, 2].max() < 1.0 for piece in convex_pieces(TriangleMesh(vertices, faces)))
