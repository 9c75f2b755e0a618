"""A picture of a run from above: where the robot went, where its odometry believes it went, the walls."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from itertools import pairwise
from math import ceil, cos, floor, hypot, pi, sin

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.odometry import PlanarPose
from kbot.world import Box, Capsule, Cylinder, Sphere, World

Colour = tuple[int, int, int]
Point = tuple[float, float]

SIZE = 900
MARGIN = 0.25
WHITE, GRID, AXIS = (255, 255, 255), (230, 232, 236), (190, 194, 200)
WALL, RAMP = (120, 126, 135), (222, 208, 186)
TRUTH, ODOMETRY, START, END = (20, 90, 200), (240, 130, 20), (40, 160, 70), (200, 40, 40)


class Canvas:
    """Pixels over a square piece of the ground; `low` is its corner and `width` its side, in m."""

    def __init__(self, low: Point, width: float) -> None:
        self.pixels: NDArray[np.uint8] = np.full((SIZE, SIZE, 3), WHITE, dtype=np.uint8)
        self._low, self._scale = low, SIZE / width

    def fill(self, corners: Sequence[Point], colour: Colour) -> None:
        """A convex polygon, its corners counter-clockwise."""
        points = np.array([self._place(p) for p in corners])
        c0, r0 = np.clip(np.floor(points.min(axis=0)), 0, SIZE).astype(int)
        c1, r1 = np.clip(np.ceil(points.max(axis=0)) + 1, 0, SIZE).astype(int)
        if c1 <= c0 or r1 <= r0:
            return
        x, y = np.meshgrid(np.arange(c0, c1) + 0.5, np.arange(r0, r1) + 0.5)
        inside = np.ones(x.shape, dtype=bool)
        for a, b in zip(points, np.roll(points, -1, axis=0), strict=True):
            # rows grow downwards, so the inside is to the right of every side
            inside &= (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]) <= 0.0
        self.pixels[r0:r1, c0:c1][inside] = colour

    def disc(self, middle: Point, radius: float, colour: Colour) -> None:
        """`radius` in m."""
        turns = [2 * pi * i / 24 for i in range(24)]
        self.fill([(middle[0] + radius * cos(t), middle[1] + radius * sin(t)) for t in turns], colour)

    def path(self, points: Sequence[Point], colour: Colour, thickness: int = 3) -> None:
        """Straight lines from point to point."""
        for a, b in pairwise(points):
            steps = max(1, ceil(hypot(b[0] - a[0], b[1] - a[1]) * self._scale))
            for k in range(steps + 1):
                share = k / steps
                self._dot((a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share), colour, thickness)

    def _dot(self, point: Point, colour: Colour, thickness: int) -> None:
        column, row = (int(v) - thickness // 2 for v in self._place(point))
        self.pixels[max(row, 0) : max(row + thickness, 0), max(column, 0) : max(column + thickness, 0)] = (
            colour
        )

    def _place(self, point: Point) -> Point:
        return (point[0] - self._low[0]) * self._scale, SIZE - (point[1] - self._low[1]) * self._scale

    def png(self) -> bytes:
        """The picture as a PNG file."""
        rows = np.zeros((SIZE, SIZE * 3 + 1), dtype=np.uint8)
        rows[:, 1:] = self.pixels.reshape(SIZE, -1)
        header = struct.pack(">IIBBBBB", SIZE, SIZE, 8, 2, 0, 0, 0)
        chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(rows.tobytes(), 6)), (b"IEND", b""))
        body = b"".join(
            struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
            for name, data in chunks
        )
        return b"\x89PNG\r\n\x1a\n" + body


def draw(truth: Sequence[PlanarPose], odometry: Sequence[PlanarPose], world: World) -> bytes:
    """A PNG: the true way blue, odometry orange, walls grey, a grid of half metres; x to the right,
    y up, from the green dot to the red one."""
    xs, ys = [p.x for p in (*truth, *odometry)], [p.y for p in (*truth, *odometry)]
    width = max(max(xs) - min(xs), max(ys) - min(ys), 0.5) + 2 * MARGIN
    low = ((min(xs) + max(xs) - width) / 2, (min(ys) + max(ys) - width) / 2)
    canvas = Canvas(low, width)
    _grid(canvas, low, width)
    _bodies(canvas, world)
    canvas.path([(p.x, p.y) for p in odometry], ODOMETRY, 5)
    canvas.path([(p.x, p.y) for p in truth], TRUTH, 2)
    dot = width / 90
    canvas.disc((truth[0].x, truth[0].y), dot, START)
    canvas.disc((truth[-1].x, truth[-1].y), dot, END)
    return canvas.png()


def _grid(canvas: Canvas, low: Point, width: float) -> None:
    step = 0.5 * max(1, round(width / 20))
    for axis in (0, 1):
        first, last = floor(low[axis] / step), ceil((low[axis] + width) / step)
        for index in range(first, last + 1):
            at = index * step
            ends = [(at, low[1]), (at, low[1] + width)] if axis == 0 else [(low[0], at), (low[0] + width, at)]
            canvas.path(ends, AXIS if index == 0 else GRID, 1)


def _bodies(canvas: Canvas, world: World) -> None:
    """Footprints of what stands still; upright pieces as they stand, others by their outline."""
    for body in world.bodies:
        if not body.is_static:
            continue
        for part in body.parts:
            pose = body.pose @ part.pose
            x, y, _ = pose.translation.tolist()
            colour = RAMP if part.ground else WALL
            match part.shape:
                case Box(size=(a, b, c)) if part.solid:
                    corners = [(u * a / 2, v * b / 2, w * c / 2) for w in (-1, 1) for u, v in _AROUND]
                    canvas.fill(_hull([(p[0], p[1]) for p in pose.apply(np.array(corners)).tolist()]), colour)
                case Cylinder(radius=radius) | Sphere(radius=radius) | Capsule(radius=radius) if part.solid:
                    canvas.disc((x, y), radius, colour)


_AROUND = ((-1, -1), (1, -1), (1, 1), (-1, 1))


def _hull(points: list[Point]) -> list[Point]:
    """The convex outline, counter-clockwise (Andrew's monotone chain)."""
    ordered = sorted(set(points))
    outline: list[Point] = []
    for way in (ordered, ordered[::-1]):
        part: list[Point] = []
        for p in way:
            while len(part) >= 2 and _turn(part[-2], part[-1], p) <= 1e-12:
                part.pop()
            part.append(p)
        outline += part[:-1]
    return outline


def _turn(o: Point, a: Point, b: Point) -> float:
    return (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0])
