"""Equal vertices of meshes, compared with trimesh."""

import numpy as np
import pytest
import trimesh

from kbot.model._vertices import distinct_vertices


@pytest.mark.parametrize("has_normals", [False, True])
@pytest.mark.parametrize("has_texture", [False, True])
def test_the_groups_are_those_of_trimesh(has_normals: bool, has_texture: bool) -> None:
    """Corners of a coarse grid, some of which differ only in their normal or their place in the texture."""
    random = np.random.default_rng(1)
    corners = random.integers(-3, 4, (3000, 3)) / 7.0
    normals = (
        random.integers(0, 2, (3000, 1)) * [[1.0, 0.0, 0.0]] + [[0.0, 0.0, 1.0]] if has_normals else None
    )
    uv = random.integers(0, 2, (3000, 2)) / 3.0 if has_texture else None
    faces = np.arange(3000).reshape(-1, 3)
    visual = trimesh.visual.TextureVisuals(uv.copy()) if uv is not None else None
    peer = trimesh.Trimesh(corners, faces, vertex_normals=normals, visual=visual, process=False)
    peer.merge_vertices()
    kept, group = distinct_vertices(corners, normals, uv)
    assert (corners[kept] == peer.vertices).all()
    assert (group[faces] == peer.faces).all()
    assert 343 <= len(kept) < 3000


def test_vertices_within_a_hundred_millionth_of_a_metre_are_equal() -> None:
    points = np.array([[1.0, 0.0, 0.0], [1.0 + 2e-9, 0.0, 0.0], [1.0 + 2e-8, 0.0, 0.0]])
    kept, group = distinct_vertices(points)
    assert kept.tolist() == [0, 2]
    assert group.tolist() == [0, 0, 1]


def test_without_vertices_there_are_no_groups() -> None:
    kept, group = distinct_vertices(np.zeros((0, 3)))
    assert len(kept) == len(group) == 0
