"""Plot a run from above: true path, odometry path and walls."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from math import ceil, degrees, floor, hypot
from typing import TYPE_CHECKING

from kbot.kinematics.planar_pose import PlanarPose
from kbot.world import World
from kbot.world.footprints import footprint
from kbot.world.world import FURTHEST

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

Colour = tuple[int, int, int]
Point = tuple[float, float]

SIZE = 900
"""Side of the square plane in pixels."""
LEFT, TOP, RIGHT, BOTTOM = 70, 120, 30, 60
"""Margins around the plane in pixels, for numbers, title and legend."""
TEXT, TITLE = 15, 20
"""Letter heights in pixels."""
MARGIN = 0.25
"""Metres around the paths."""
WHITE, GRID, AXIS = (255, 255, 255), (230, 232, 236), (190, 194, 200)
INK = (40, 46, 54)
WALL, RAMP = (120, 126, 135), (222, 208, 186)
TRUTH, ODOMETRY, START, END = (20, 90, 200), (240, 130, 20), (40, 160, 70), (200, 40, 40)


def draw(truth: Sequence[PlanarPose], odometry: Sequence[PlanarPose], world: World, title: str) -> bytes:
    """Return a PNG of the true path (blue), odometry (orange) and walls (grey), on a grid labelled in m.

    x points right and y up. The start is green, the true end red and the end of odometry orange. The `title`,
    a legend and both end poses are above the plane.
    """
    from PIL import Image, ImageDraw  # imported lazily: slow to import

    xs, ys = [p.x for p in (*truth, *odometry)], [p.y for p in (*truth, *odometry)]
    width = max(max(xs) - min(xs), max(ys) - min(ys), 0.5) + 2 * MARGIN
    low = ((min(xs) + max(xs) - width) / 2, (min(ys) + max(ys) - width) / 2)

    def place(points: Sequence[Point]) -> list[Point]:
        """Convert points in m to pixels of the plane, right and down."""
        return [((x - low[0]) / width * SIZE, SIZE - (y - low[1]) / width * SIZE) for x, y in points]

    plane = Image.new("RGB", (SIZE, SIZE), WHITE)
    pen = ImageDraw.Draw(plane)
    for line, colour in _grid(low, width):
        pen.line(place(line), colour)
    for outline, colour in _outlines(world):
        pen.polygon(place(outline), colour)
    for way, colour, thickness in ((odometry, ODOMETRY, 5), (truth, TRUTH, 2)):
        pen.line(place([(p.x, p.y) for p in way]), colour, thickness, "curve")
    dots = ((truth[0], START, START), (odometry[-1], ODOMETRY, INK), (truth[-1], END, TRUTH))
    for end, colour, around in dots:
        ((column, row),) = place([(end.x, end.y)])
        pen.ellipse((column - 10, row - 10, column + 10, row + 10), colour, around, 3)
    picture = Image.new("RGB", (LEFT + SIZE + RIGHT, TOP + SIZE + BOTTOM), WHITE)
    picture.paste(plane, (LEFT, TOP))
    pen = ImageDraw.Draw(picture)
    pen.rectangle((LEFT - 1, TOP - 1, LEFT + SIZE, TOP + SIZE), outline=AXIS)
    _number(pen, low, width)
    _explain(pen, truth[-1], odometry[-1], title)
    stream = io.BytesIO()
    picture.save(stream, "PNG")
    return stream.getvalue()


def _number(pen: ImageDraw, low: Point, width: float) -> None:
    """Label the grid lines in m, along the bottom and the left side."""
    from PIL import ImageFont

    font = ImageFont.load_default(TEXT)
    for at in _lines(low[0], width):
        pen.text((LEFT + (at - low[0]) / width * SIZE, TOP + SIZE + 8), f"{at:g}", INK, font, "mt")
    for at in _lines(low[1], width):
        pen.text((LEFT - 8, TOP + SIZE - (at - low[1]) / width * SIZE), f"{at:g}", INK, font, "rm")
    pen.text((LEFT + SIZE / 2, TOP + SIZE + BOTTOM - 8), "x [m]", INK, font, "mb")
    pen.text((LEFT - 8, TOP - 8), "y [m]", INK, font, "rb")


def _explain(pen: ImageDraw, truth: PlanarPose, odometry: PlanarPose, title: str) -> None:
    """Draw the title, the legend and both end poses."""
    from PIL import ImageFont

    pen.text((LEFT, 14), title, INK, ImageFont.load_default(TITLE), "lt")
    error = hypot(truth.x - odometry.x, truth.y - odometry.y)
    estimated = f"{_words(odometry)}, {error * 1000:.1f} mm off"
    entries = (
        (TRUTH, f"truth: ends at {_words(truth)}"),
        (ODOMETRY, f"odometry: ends at {estimated}"),
    )
    font = ImageFont.load_default(TEXT)
    for number, (colour, text) in enumerate(entries):
        middle = 54 + 22 * number
        pen.rectangle((LEFT, middle - 2, LEFT + 24, middle + 2), colour)
        pen.text((LEFT + 34, middle), text, INK, font, "lm")
    for column, colour, text in ((LEFT + SIZE - 130, START, "start"), (LEFT + SIZE - 50, END, "end")):
        pen.ellipse((column - 6, 18, column + 6, 30), colour)
        pen.text((column + 12, 24), text, INK, font, "lm")


def _words(pose: PlanarPose) -> str:
    return f"x {pose.x:.3f} m, y {pose.y:.3f} m, yaw {degrees(pose.yaw):.1f}°"


def _lines(low: float, width: float) -> Iterator[float]:
    """Yield the positions of the grid lines along one axis: every 0.5 m, or a multiple of it for wide
    plots."""
    step = 0.5 * max(1, round(width / 10))
    for index in range(ceil(low / step), floor((low + width) / step) + 1):
        yield index * step


def _grid(low: Point, width: float) -> Iterator[tuple[list[Point], Colour]]:
    for x in _lines(low[0], width):
        yield [(x, low[1]), (x, low[1] + width)], AXIS if x == 0 else GRID
    for y in _lines(low[1], width):
        yield [(low[0], y), (low[0] + width, y)], AXIS if y == 0 else GRID


def _outlines(world: World) -> Iterator[tuple[list[Point], Colour]]:
    """Yield the outlines of static bodies, seen from above."""
    for body in world.bodies:
        for part in body.parts if body.is_static else ():
            outline = (
                footprint(part.shape, body.pose @ part.pose, -FURTHEST, FURTHEST) if part.solid else None
            )
            if outline is not None and len(outline) > 1:
                yield [(x, y) for x, y in outline.tolist()], RAMP if part.ground else WALL
