"""Where each link must be in a picture: the model's triangles, projected by a camera into a depth buffer.

It shares only the camera's matrix with the page. Shapes are triangulated here, and poses come from the
model's kinematics.
"""

from collections.abc import Iterator, Mapping
from math import ceil, floor

import numpy as np

from kbot.kinematics import FrameTree, Transform
from kbot.model import Box, Capsule, Cylinder, Geometry, Mesh, RobotModel, Sphere
from kbot.model.meshes import load_mesh

AROUND, ALONG = 72, 24
CONTESTED = -2
"""Two links are at the same depth, so a depth buffer cannot choose between them."""
TIE = 1e-6


def link_image(
    robot: RobotModel,
    clip_from_world: np.ndarray,
    width: int,
    height: int,
    moved: Mapping[str, Transform] | None = None,
    joints: Mapping[str, float] | None = None,
) -> np.ndarray:
    """Return the index of the foremost link at each pixel (height, width), -1 for none, CONTESTED for two at
    once.

    `moved` displaces a link in its own frame.
    """
    image = np.full((height, width), -1)
    depth = np.full((height, width), np.inf)
    tied = np.zeros((height, width), dtype=bool)
    poses = FrameTree(robot).poses(joints)
    for index, link in enumerate(robot.links.values()):
        for visual in link.visuals:
            own = (moved or {}).get(link.name, Transform.identity())
            pose = poses[link.name] @ own @ Transform.from_xyz_rpy(visual.pose.xyz, visual.pose.rpy)
            for triangles in _triangles(visual.geometry):
                corners = pose.apply(triangles.reshape(-1, 3)).reshape(-1, 3, 3)
                _draw(corners, clip_from_world, image, depth, tied, index)
    image[tied] = CONTESTED
    return image


def overlap(first: np.ndarray, second: np.ndarray) -> float:
    """Return the intersection of two masks as a share of their union."""
    return float((first & second).sum() / (first | second).sum())


def _draw(
    corners: np.ndarray,
    clip_from_world: np.ndarray,
    image: np.ndarray,
    depth: np.ndarray,
    tied: np.ndarray,
    index: int,
) -> None:
    height, width = image.shape
    clip = np.concatenate([corners, np.ones((*corners.shape[:2], 1))], axis=2) @ clip_from_world.T
    in_front = (clip[..., 3] > 1e-6).all(axis=1)
    seen = clip[in_front, :, :3] / clip[in_front, :, 3:]
    x, y, z = (seen[..., 0] + 1) / 2 * width, (1 - seen[..., 1]) / 2 * height, seen[..., 2]
    columns, rows = np.arange(width)[None, :] + 0.5, np.arange(height)[:, None] + 0.5
    for (x0, x1, x2), (y0, y1, y2), (z0, z1, z2) in zip(x.tolist(), y.tolist(), z.tolist(), strict=True):
        area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
        if abs(area) < 1e-12:
            continue
        # pixels whose centre may be inside
        left, right = max(0, ceil(min(x0, x1, x2) - 0.5)), min(width, floor(max(x0, x1, x2) + 0.5))
        top, bottom = max(0, ceil(min(y0, y1, y2) - 0.5)), min(height, floor(max(y0, y1, y2) + 0.5))
        if left >= right or top >= bottom:
            continue
        px = columns[:, left:right]
        py = rows[top:bottom]
        b = ((px - x0) * (y2 - y0) - (x2 - x0) * (py - y0)) / area
        c = ((x1 - x0) * (py - y0) - (px - x0) * (y1 - y0)) / area
        a = 1 - b - c
        inside = (a >= 0) & (b >= 0) & (c >= 0)
        if not inside.any():
            continue
        at = z0 * a + z1 * b + z2 * c
        inside &= at > -1
        part = np.s_[top:bottom, left:right]
        before = depth[part]
        other = (image[part] != index) & (image[part] >= 0)
        tied[part][inside & other & (np.abs(at - before) <= TIE)] = True
        tied[part][inside & (at < before - TIE)] = False
        nearer = inside & (at < before)
        before[nearer] = at[nearer]
        image[part][nearer] = index


def _triangles(shape: Geometry) -> Iterator[np.ndarray]:
    """Return the triangles (n, 3, 3) of a shape, in metres."""
    match shape:
        case Box(size=size):
            corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * size / 2
            quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
            yield corners[[t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]]
        case Cylinder(radius=r, length=h):
            yield _turned([(0.0, -h / 2), (r, -h / 2), (r, h / 2), (0.0, h / 2)])
        case Sphere(radius=r):
            yield _turned(_arc(r, 0.0, -np.pi / 2, np.pi / 2))
        case Capsule(radius=r, length=h):
            yield _turned(_arc(r, -h / 2, -np.pi / 2, 0.0) + _arc(r, h / 2, 0.0, np.pi / 2))
        case Mesh(path=None):
            return
        case Mesh(path=path, scale=scale):
            data = load_mesh(path or "")
            yield data.vertices[data.faces] * np.asarray(scale)


def _arc(radius: float, z: float, start: float, end: float) -> list[tuple[float, float]]:
    return [(radius * np.cos(a), z + radius * np.sin(a)) for a in np.linspace(start, end, ALONG)]


def _turned(profile: list[tuple[float, float]]) -> np.ndarray:
    """Return the surface of revolution of a profile (radius, z) about z."""
    angles = np.linspace(0.0, 2 * np.pi, AROUND + 1)
    radius, z = np.array(profile).T
    rings = np.stack(
        [
            np.outer(radius, np.cos(angles)),
            np.outer(radius, np.sin(angles)),
            np.repeat(z[:, None], AROUND + 1, 1),
        ],
        axis=-1,
    )
    a, b, c, d = rings[:-1, :-1], rings[:-1, 1:], rings[1:, 1:], rings[1:, :-1]
    return np.concatenate(
        [np.stack([a, b, c], 2).reshape(-1, 3, 3), np.stack([a, c, d], 2).reshape(-1, 3, 3)]
    )
