"""Where each link must be in a picture: the model's triangles, projected by a camera into a depth buffer.

It shares only the camera's matrix with the page. Shapes are triangulated here, and poses come from the
model's kinematics.
"""

from collections.abc import Iterator, Mapping

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
    """Draw triangles (n, 3, 3) of a link into a picture (height, width)."""
    height, width = image.shape
    clip = np.concatenate([corners, np.ones((*corners.shape[:2], 1))], axis=2) @ clip_from_world.T
    in_front = (clip[..., 3] > 1e-6).all(axis=1)
    seen = clip[in_front, :, :3] / clip[in_front, :, 3:]
    seen[..., :2] = (seen[..., :2] * (1.0, -1.0) + 1.0) / 2.0 * (width, height)
    pixels, at = _rasterized(seen, width, height)
    order = np.argsort(-at)  # of several values for a pixel, the last one stays: the nearest
    nearest = np.full(image.size, np.inf)
    nearest[pixels[order]] = at[order]
    rows, columns = np.nonzero(nearest.reshape(image.shape) < np.inf)
    near, before, link = nearest[rows * width + columns], depth[rows, columns], image[rows, columns]
    is_tied = (link != index) & (link >= 0) & (np.abs(near - before) <= TIE)
    tied[rows, columns] = is_tied | (tied[rows, columns] & (near >= before - TIE))
    image[rows, columns] = np.where(near < before, index, link)
    depth[rows, columns] = np.minimum(near, before)


def _rasterized(triangles: np.ndarray, width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the number of each pixel whose centre is in a triangle, and its depth there, once for each
    triangle.

    `triangles` is (n, 3, 3): column and row in pixels, and depth.
    """
    corners = np.dstack([triangles[..., :2], np.ones(triangles.shape[:2])])
    has_area = np.abs(np.linalg.det(corners)) > 1e-12
    triangles = triangles[has_area]
    # (column, row, 1) @ shares[n, :, i] is the share of corner i at a place of triangle n
    shares = np.linalg.inv(corners[has_area])
    depths = np.einsum("nji,ni->nj", shares, triangles[..., 2])
    # one span of columns for each triangle and row
    top = np.clip(np.ceil(triangles[..., 1].min(axis=1) - 0.5), 0, height).astype(int)
    bottom = np.clip(np.floor(triangles[..., 1].max(axis=1) + 0.5), 0, height).astype(int)
    of, rows = _counted(top, np.maximum(bottom - top, 0))
    left, right = np.full(len(rows), 0.5), np.full(len(rows), width - 0.5)
    for along, down, constant in shares[of].transpose(2, 1, 0):
        rest = down * (rows + 0.5) + constant
        with np.errstate(divide="ignore", invalid="ignore"):
            edge = -rest / along
        left = np.where(along > 0.0, np.maximum(left, edge), left)
        right = np.where(along < 0.0, np.minimum(right, edge), right)
        right = np.where((along == 0.0) & (rest < 0.0), -1.0, right)
    start = np.ceil(left - 0.5).astype(int)
    span, columns = _counted(start, np.maximum(np.floor(right - 0.5).astype(int) + 1 - start, 0))
    rows, of = rows[span], of[span]
    at = depths[of, 0] * (columns + 0.5) + depths[of, 1] * (rows + 0.5) + depths[of, 2]
    return (rows * width + columns)[at > -1.0], at[at > -1.0]


def _counted(starts: np.ndarray, counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return `counts[i]` numbers from `starts[i]` on for each i, and i with each of them."""
    of = np.repeat(np.arange(len(counts)), counts)
    return of, starts[of] + np.arange(len(of)) - (np.cumsum(counts) - counts)[of]


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
