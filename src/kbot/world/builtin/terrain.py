"""Ground that is not flat."""

from __future__ import annotations

from math import cos, radians, sin

import numpy as np

from kbot.text import KbotError
from kbot.world.builders import GREEN, ORANGE, WOOD, box, cylinder, floor, slope
from kbot.world.world import Body, World


def ramp(angle: float = 10.0, length: float = 2.0, width: float = 1.5) -> World:
    """A slope of `angle` degrees half a metre ahead of the start, a level top, and the way down."""
    if not (0.0 < angle <= 45.0 and length > 0.1 and width > 0.1):
        raise KbotError(
            "world 'ramp' needs an angle above 0 and up to 45 degrees, and a length and width above 0.1 m"
        )
    rise, run = length * sin(radians(angle)), length * cos(radians(angle))
    top = 1.0
    up = slope("ramp_up", length, width, radians(angle), 0.5, 0.0, 0.0)
    platform = box(
        "platform", (top, width, 0.04), 0.5 + run + top / 2, 0.0, rise - 0.02, rgba=WOOD, ground=True
    )
    down = slope("ramp_down", length, width, -radians(angle), 0.5 + run + top, 0.0, rise)
    return World("ramp", (floor(), up, platform, down))


def stairs(steps: int = 5, height: float = 0.01, depth: float = 0.4, width: float = 1.5) -> World:
    """Steps up along x, the first half a metre ahead of the start, and a landing behind the last."""
    if not (1 <= steps <= 200 and height > 0.0 and depth > 0.0 and width > 0.0):
        raise KbotError("world 'stairs' needs 1 to 200 steps, and a height, depth and width above 0")
    bodies: list[Body] = [floor()]
    end = 0.5 + steps * depth + 1.0
    for step in range(steps):
        start = 0.5 + step * depth
        bodies.append(
            box(
                f"step_{step}",
                (end - start, width, height),
                (start + end) / 2,
                0.0,
                (step + 0.5) * height,
                rgba=WOOD,
                ground=True,
            )
        )
    return World("stairs", tuple(bodies))


def obstacle_course(seed: int = 1) -> World:
    """A slalom between pillars, sills to drive over, a low gate and a small ramp, along x."""
    random = np.random.default_rng(seed)
    bodies: list[Body] = [floor()]
    for index in range(5):
        side = 0.12 if index % 2 else -0.12
        jitter = float(random.uniform(-0.03, 0.03))
        bodies.append(cylinder(f"pillar_{index}", 0.03, 0.3, 0.7 + 0.6 * index, side + jitter, ORANGE))
    for index in range(4):
        height = 0.002 + 0.001 * index
        bodies.append(
            box(f"sill_{index}", (0.03, 1.0, height), 3.9 + 0.25 * index, 0.0, rgba=WOOD, ground=True)
        )
    bodies += [
        box("gate_left", (0.05, 0.3, 0.4), 5.2, 0.35, rgba=GREEN),
        box("gate_right", (0.05, 0.3, 0.4), 5.2, -0.35, rgba=GREEN),
        box("gate_top", (0.05, 1.0, 0.05), 5.2, 0.0, 0.425, rgba=GREEN),
        slope("ramp_up", 0.8, 1.0, radians(7.0), 5.7, 0.0, 0.0),
    ]
    crest = 5.7 + 0.8 * cos(radians(7.0))
    bodies.append(slope("ramp_down", 0.8, 1.0, radians(-7.0), crest, 0.0, 0.8 * sin(radians(7.0))))
    return World("obstacle_course", tuple(bodies))
