"""A closed line on the floor to follow."""

from __future__ import annotations

from math import pi

from kbot.kinematics.transform import Transform
from kbot.text import KbotError
from kbot.world.builders import BLACK, at, floor
from kbot.world.world import Body, Box, Part, World

THICKNESS = 0.0004


def track(straight: float = 2.0, radius: float = 0.75, line: float = 0.03, segments: int = 48) -> World:
    """A black line in the shape of a stadium: two straights of `straight` metres joined by half circles
    of `radius`; the start is on the line, along it, and the way round is to the left. It is paint:
    seen and not touched."""
    if not (straight >= 0.0 and radius > 0.1 and 0.0 < line < radius and 4 <= segments <= 1000):
        raise KbotError(
            "world 'track' needs a straight of 0 or more, a radius above 0.1 m, a line narrower than it"
            " and 4 to 1000 segments"
        )
    half = straight / 2
    parts = [_piece(straight, line, at(0.0, 0.0)), _piece(straight, line, at(0.0, 2 * radius))]
    step = pi / segments
    chord = step * radius + line * step / 2
    for index in range(segments):
        angle = (index + 0.5) * step
        turn = at(half, radius, 0.0, angle) @ at(0.0, -radius)
        back = at(-half, radius, 0.0, angle + pi) @ at(0.0, -radius)
        parts += [_piece(chord, line, turn), _piece(chord, line, back)]
    return World("track", (floor(), Body("line", tuple(parts))))


def _piece(length: float, width: float, pose: Transform) -> Part:
    return Part(Box((length, width, THICKNESS)), pose, BLACK, solid=False)
