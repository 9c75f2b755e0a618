"""Open ground, and open ground with things on it."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np

from kbot.text import KbotError
from kbot.world.builders import GREEN, ORANGE, WOOD, box, cylinder, floor
from kbot.world.world import World

MOST_BOXES = 10_000


def empty(friction: float = 1.0) -> World:
    """A flat floor without end."""
    return World("empty", (floor(friction=friction),))


def boxes(count: int = 12, spread: float = 1.6, seed: int = 1) -> World:
    """Boxes and pillars strewn around a free place of 0.45 m about the start."""
    if not 0 <= count <= MOST_BOXES or spread < 0.6:
        raise KbotError(f"world 'boxes' needs a count of 0 to {MOST_BOXES} and a spread of 0.6 m or more")
    random = np.random.default_rng(seed)
    bodies = [floor()]
    for index in range(count):
        angle = 2 * pi * (index + random.uniform(-0.25, 0.25)) / count
        distance = random.uniform(0.45 + 0.13, spread)
        x, y = distance * cos(angle), distance * sin(angle)
        size, height = random.uniform(0.08, 0.18), random.uniform(0.08, 0.25)
        if index % 3 == 2:
            bodies.append(cylinder(f"pillar_{index}", size / 2, height, x, y, GREEN))
        else:
            yaw = random.uniform(0.0, pi)
            rgba = WOOD if index % 3 else ORANGE
            bodies.append(box(f"box_{index}", (size, size, height), x, y, yaw=yaw, rgba=rgba))
    return World("boxes", tuple(bodies))
