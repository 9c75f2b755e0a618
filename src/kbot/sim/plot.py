"""A picture of a run from above: where the robot went, where its odometry believes it went, the walls."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from math import ceil, floor

from kbot.kinematics.odometry import PlanarPose
from kbot.world import World
from kbot.world.footprints import footprint

Colour = tuple[int, int, int]
Point = tuple[float, float]

SIZE = 900
"""Pixels of a side."""
MARGIN = 0.25
"""Metres around the ways."""
WHITE, GRID, AXIS = (255, 255, 255), (230, 232, 236), (190, 194, 200)
WALL, RAMP = (120, 126, 135), (222, 208, 186)
TRUTH, ODOMETRY, START, END = (20, 90, 200), (240, 130, 20), (40, 160, 70), (200, 40, 40)


def draw(truth: Sequence[PlanarPose], odometry: Sequence[PlanarPose], world: World) -> bytes:
    """A PNG: the true way blue, odometry orange, walls grey, a grid of half metres; x to the right,
    y up, from the green dot to the red one."""
    from PIL import Image, ImageDraw

    xs, ys = [p.x for p in (*truth, *odometry)], [p.y for p in (*truth, *odometry)]
    width = max(max(xs) - min(xs), max(ys) - min(ys), 0.5) + 2 * MARGIN
    low = ((min(xs) + max(xs) - width) / 2, (min(ys) + max(ys) - width) / 2)

    def place(points: Sequence[Point]) -> list[Point]:
        """Pixels, to the right and down, of points in m."""
        return [((x - low[0]) / width * SIZE, SIZE - (y - low[1]) / width * SIZE) for x, y in points]

    image = Image.new("RGB", (SIZE, SIZE), WHITE)
    pen = ImageDraw.Draw(image)
    for line, colour in _grid(low, width):
        pen.line(place(line), colour)
    for outline, colour in _outlines(world):
        pen.polygon(place(outline), colour)
    for way, colour, thickness in ((odometry, ODOMETRY, 5), (truth, TRUTH, 2)):
        pen.line(place([(p.x, p.y) for p in way]), colour, thickness, "curve")
    for end, colour in ((truth[0], START), (truth[-1], END)):
        ((column, row),) = place([(end.x, end.y)])
        pen.ellipse((column - 10, row - 10, column + 10, row + 10), colour)
    stream = io.BytesIO()
    image.save(stream, "PNG")
    return stream.getvalue()


def _grid(low: Point, width: float) -> Iterator[tuple[list[Point], Colour]]:
    step = 0.5 * max(1, round(width / 20))
    for axis in (0, 1):
        first, last = floor(low[axis] / step), ceil((low[axis] + width) / step)
        for index in range(first, last + 1):
            at = index * step
            ends = [(at, low[1]), (at, low[1] + width)] if axis == 0 else [(low[0], at), (low[0] + width, at)]
            yield ends, AXIS if index == 0 else GRID


def _outlines(world: World) -> Iterator[tuple[list[Point], Colour]]:
    """Of what stands still, seen from above."""
    for body in world.bodies:
        for part in body.parts if body.is_static else ():
            outline = footprint(part.shape, body.pose @ part.pose, -1e6, 1e6) if part.solid else None
            if outline is not None and len(outline) > 1:
                yield [(x, y) for x, y in outline.tolist()], RAMP if part.ground else WALL
