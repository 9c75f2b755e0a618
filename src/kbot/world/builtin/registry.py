"""The built-in worlds by name, with parameters: `maze:size=8,seed=3`."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from math import cos, pi, radians, sin
from typing import get_type_hints

import numpy as np

from kbot.kinematics.spatial import GRAVITY
from kbot.kinematics.transform import Transform
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean
from kbot.world.builders import BLACK, GREEN, ORANGE, WOOD, at, box, cylinder, floor, slope, wall
from kbot.world.world import Body, Box, Part, Rgba, World

THICKNESS = 0.0004
"""Thickness of a painted line in m."""


def track(straight: float = 2.0, radius: float = 0.75, line: float = 0.03, segments: int = 48) -> World:
    """A black line on the floor in the shape of a stadium, to follow counter-clockwise.

    Two straights of `straight` metres are joined by half circles of `radius`. The start is on the line and
    points along it. The line is painted: it does not collide.
    """
    if not (straight >= 0.0 and radius > 0.1 and 0.0 < line < radius and 4 <= segments <= 1000):
        raise KbotError(
            "world 'track': straight must be at least 0, radius above 0.1 m, line above 0 and below radius,"
            " and segments from 4 to 1000"
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


def ramp(angle: float = 10.0, length: float = 2.0, width: float = 1.5) -> World:
    """A slope of `angle` degrees half a metre ahead of the start, a level top, and a slope down."""
    if not (0.0 < angle <= 45.0 and length > 0.1 and width > 0.1):
        raise KbotError(
            "world 'ramp': angle must be above 0 and at most 45 degrees, length and width above 0.1 m"
        )
    rise, run = length * sin(radians(angle)), length * cos(radians(angle))
    top = 1.0
    up = slope("ramp_up", length, width, radians(angle), 0.5, 0.0, 0.0)
    platform = box(
        "platform", (top, width, 0.04), 0.5 + run + top / 2, 0.0, rise - 0.02, rgba=WOOD, ground=True
    )
    down = slope("ramp_down", length, width, -radians(angle), 0.5 + run + top, 0.0, rise)
    return World("ramp", (floor(), up, platform, down))


def incline(angle: float = 10.0) -> World:
    """An endless slope that rises by `angle` degrees along x. It is shown level, with gravity tilted instead.

    On a real ramp, the edge at its foot lifts the driven wheels of a base with casters on both sides.
    """
    if not 0.0 <= angle <= 45.0:
        raise KbotError("world 'incline': angle must be from 0 to 45 degrees")
    gravity = (-GRAVITY * sin(radians(angle)), 0.0, -GRAVITY * cos(radians(angle)))
    return World("incline", (floor(),), gravity)


def stairs(steps: int = 5, height: float = 0.01, depth: float = 0.4, width: float = 1.5) -> World:
    """Steps up along x and a landing. The first step is half a metre ahead of the start."""
    if not (1 <= steps <= 200 and height > 0.0 and depth > 0.0 and width > 0.0):
        raise KbotError("world 'stairs': steps must be from 1 to 200, and height, depth and width above 0")
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


MOST_BOXES = 10_000


def empty(friction: float = 1.0) -> World:
    """An infinite flat floor."""
    return World("empty", (floor(friction=friction),))


def boxes(count: int = 12, spread: float = 1.6, seed: int = 1) -> World:
    """Boxes and pillars at random positions, outside a radius of 0.45 m around the start."""
    if not 0 <= count <= MOST_BOXES or spread < 0.6:
        raise KbotError(f"world 'boxes': count must be from 0 to {MOST_BOXES}, and spread at least 0.6 m")
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


FREE_REACH = 0.35
"""Reach in m of a robot for which the start and the way ahead in the `playground` of scale 1 are free."""


def playground(scale: float = 1.0) -> World:
    """A corner of two walls, boxes and pillars to drive around, and a gate 2.2 m ahead of the start.

    A robot that reaches up to `FREE_REACH` from its base can drive ahead through the gate.
    `scale` multiplies all lengths, for larger robots.
    """
    if not 0.1 <= scale <= 100.0:
        raise KbotError("world 'playground': scale must be from 0.1 to 100")
    s = scale

    def block(name: str, size: float, height: float, x: float, y: float, yaw: float, rgba: Rgba) -> Body:
        return box(name, (size * s, size * s, height * s), x * s, y * s, yaw=yaw, rgba=rgba)

    def pillar(name: str, height: float, x: float, y: float, rgba: Rgba) -> Body:
        return cylinder(name, 0.04 * s, height * s, x * s, y * s, rgba)

    return World(
        "playground",
        (
            floor(40.0 * max(1.0, s)),
            wall("wall_along", (0.5 * s, 0.65 * s), (1.5 * s, 0.65 * s), 0.18 * s, 0.02 * s),
            wall("wall_across", (1.5 * s, 0.65 * s), (1.5 * s, 1.25 * s), 0.18 * s, 0.02 * s),
            block("box_0", 0.14, 0.10, 0.5, -0.55, 0.4, ORANGE),
            block("box_1", 0.18, 0.14, 0.95, -0.7, 1.1, WOOD),
            block("box_2", 0.12, 0.12, -0.5, 0.6, 0.8, WOOD),
            block("box_3", 0.16, 0.09, 0.15, 1.1, 0.2, ORANGE),
            pillar("pillar_0", 0.22, 0.05, 0.62, GREEN),
            pillar("pillar_1", 0.22, 1.45, -0.5, GREEN),
            pillar("pillar_2", 0.16, -0.45, -0.6, ORANGE),
            pillar("gate_left", 0.3, 2.2, 0.45, GREEN),
            pillar("gate_right", 0.3, 2.2, -0.45, GREEN),
        ),
    )


Cell = tuple[int, int]


def maze(size: int = 8, seed: int = 1, cell: float = 0.6, height: float = 0.25) -> World:
    """A perfect maze of `size` x `size` cells of `cell` metres.

    The start is the middle of a corner cell. The cell is open ahead or to the left.
    """
    if not 1 <= size <= 100 or not cell > 0.05 or not height > 0.0:
        raise KbotError("world 'maze': size must be from 1 to 100, cell above 0.05 m and height above 0")
    bodies: list[Body] = [floor(max(40.0, 2.5 * size * cell))]
    for index, (start, end) in enumerate(_walls(size, _passages(size, seed))):
        low = tuple((v - 0.5) * cell for v in start)
        high = tuple((v - 0.5) * cell for v in end)
        bodies.append(wall(f"wall_{index}", (low[0], low[1]), (high[0], high[1]), height))
    return World("maze", tuple(bodies))


def _passages(size: int, seed: int) -> set[frozenset[Cell]]:
    """Pairs of neighbouring cells without a wall between them.

    A random depth-first search visits every cell once.
    """
    random = np.random.default_rng(seed)
    passages: set[frozenset[Cell]] = set()
    path: list[Cell] = [(0, 0)]
    seen = {(0, 0)}
    while path:
        x, y = path[-1]
        around = ((x + 1, y), (x, y + 1), (x - 1, y), (x, y - 1))
        free = [c for c in around if min(c) >= 0 and max(c) < size and c not in seen]
        if not free:
            path.pop()
            continue
        following = free[int(random.integers(len(free)))]
        passages.add(frozenset((path[-1], following)))
        seen.add(following)
        path.append(following)
    return passages


def _walls(size: int, passages: set[frozenset[Cell]]) -> list[tuple[Cell, Cell]]:
    """Straight walls as pairs of corner points. Neighbouring pieces are joined."""
    walls: list[tuple[Cell, Cell]] = []
    for line in range(size + 1):
        across = [_is_open((at, line - 1), (at, line), passages) for at in range(size)]
        along = [_is_open((line - 1, at), (line, at), passages) for at in range(size)]
        walls += [((a, line), (b, line)) for a, b in _closed_runs(across)]
        walls += [((line, a), (line, b)) for a, b in _closed_runs(along)]
    return walls


def _is_open(a: Cell, b: Cell, passages: set[frozenset[Cell]]) -> bool:
    return frozenset((a, b)) in passages


def _closed_runs(is_open: list[bool]) -> list[tuple[int, int]]:
    """Start and end of every run of entries that are not open."""
    runs: list[tuple[int, int]] = []
    start: int | None = None
    for index, gap in enumerate([*is_open, True]):
        if not gap and start is None:
            start = index
        elif gap and start is not None:
            runs.append((start, index))
            start = None
    return runs


def corridor(length: float = 6.0, width: float = 0.8, height: float = 0.3) -> World:
    """Two walls along x, from 0.5 m behind the start, closed at the far end."""
    if not (length > 0.5 and width > 0.2 and height > 0.0):
        raise KbotError("world 'corridor': length must be above 0.5 m, width above 0.2 m and height above 0")
    back, front, side = -0.5, length - 0.5, width / 2
    return World(
        "corridor",
        (
            floor(),
            wall("left_wall", (back, side), (front, side), height),
            wall("right_wall", (back, -side), (front, -side), height),
            wall("end_wall", (front, -side), (front, side), height),
        ),
    )


def rooms(columns: int = 3, rows: int = 2, size: float = 2.0, door: float = 0.6, seed: int = 0) -> World:
    """A grid of rooms of `size` metres, with a door in every inner wall.

    The start is the middle of the first room. With the seed 0, the doors are in the middle of their walls,
    and every other room has a table. With another seed, the doors and the tables are at random places.
    """
    if not (1 <= columns <= 20 and 1 <= rows <= 20 and size > door > 0.0):
        raise KbotError(
            "world 'rooms': columns and rows must be from 1 to 20, and door above 0 and below size"
        )
    random = np.random.default_rng(seed) if seed else None

    def door_place() -> float:
        """The door's middle, in m from the wall's middle. A piece of wall is left on both sides."""
        furthest = max(0.0, (size - door) / 2 - 0.1)
        return 0.0 if random is None else random.uniform(-furthest, furthest)

    bodies: list[Body] = [floor(max(40.0, 2.5 * size * max(columns, rows)))]
    for column in range(columns + 1):
        for row in range(rows):
            x, low = (column - 0.5) * size, (row - 0.5) * size
            inner = 0 < column < columns
            name, ends = f"wall_x{column}_{row}", ((x, low), (x, low + size))
            bodies += _with_door(name, *ends, door, door_place()) if inner else [wall(name, *ends)]
    for row in range(rows + 1):
        for column in range(columns):
            y, low = (row - 0.5) * size, (column - 0.5) * size
            inner = 0 < row < rows
            name, ends = f"wall_y{column}_{row}", ((low, y), (low + size, y))
            bodies += _with_door(name, *ends, door, door_place()) if inner else [wall(name, *ends)]
    for column in range(columns):
        for row in range(rows):
            x, y, yaw = column * size + size * 0.25, row * size + size * 0.25, 0.0
            if random is not None:
                spread = max(0.0, size / 2 - _BESIDE_TABLE)
                x, y = (middle * size + random.uniform(-spread, spread) for middle in (column, row))
                yaw = random.uniform(0.0, pi)
            if (column + row) % 2 if random is None else column + row:
                bodies.append(box(f"table_{column}_{row}", (0.35, 0.25, 0.2), x, y, yaw=yaw, rgba=WOOD))
    return World("rooms", tuple(bodies))


_BESIDE_TABLE = 0.5
"""m from the middle of a table, which reaches 0.22 m, to the next wall: KBot passes between them."""


def _with_door(
    name: str, start: tuple[float, float], end: tuple[float, float], door: float, place: float
) -> list[Body]:
    """Two pieces of wall with a door between them, whose middle is `place` m from that of the wall."""
    length = abs(end[0] - start[0]) + abs(end[1] - start[1])
    first, last = ((length + side * door) / 2 + place for side in (-1.0, 1.0))

    def point(along: float) -> tuple[float, float]:
        share = along / length
        return start[0] + (end[0] - start[0]) * share, start[1] + (end[1] - start[1]) * share

    return [wall(f"{name}_a", start, point(first)), wall(f"{name}_b", point(last), end)]


BUILDERS: dict[str, Callable[..., World]] = {
    builder.__name__: builder
    for builder in (
        empty,
        playground,
        boxes,
        maze,
        rooms,
        corridor,
        ramp,
        incline,
        stairs,
        obstacle_course,
        track,
    )
}


def build_world(text: str) -> World:
    """Build the world `name` or `name:parameter=value,parameter=value`.

    Raises:
        KbotError: the world or a parameter does not exist (the message suggests names), or a value is not
            valid.
    """
    builder, values = _read(text)
    return builder(**values)


def parameters(text: str) -> dict[str, int | float]:
    """All parameters of a world with the values in `text` (see `build_world`) or their defaults.

    Raises:
        KbotError: as `build_world`.
    """
    builder, values = _read(text)
    return {key: p.default for key, p in inspect.signature(builder).parameters.items()} | values


def built_in(text: str) -> str:
    """The name of the built-in world in a text such as `maze:size=8`. Empty if it is not built in."""
    name = text.partition(":")[0].replace("-", "_")
    return name if name in BUILDERS else ""


def _read(text: str) -> tuple[Callable[..., World], dict[str, int | float]]:
    """A world's builder and its given parameters."""
    name, _, written = text.partition(":")
    builder = BUILDERS.get(name.replace("-", "_"))
    if builder is None:
        raise KbotError(_unknown(f"unknown world '{name}'", name, list(BUILDERS)))
    types = {key: kind for key, kind in get_type_hints(builder).items() if key != "return"}
    values: dict[str, int | float] = {}
    for word in written.split(",") if written else ():
        key, equals, value = word.partition("=")
        key = key.strip()
        if not equals:
            raise KbotError(f"world '{name}': write '{word}' as parameter=value")
        if key not in types:
            raise KbotError(_unknown(f"world '{name}' has no parameter '{key}'", key, list(types)))
        if key in values:
            raise KbotError(f"world '{name}': {key} is given twice")
        values[key] = _number(name, key, value.strip(), types[key])
    return builder, values


def _number(world: str, key: str, value: str, kind: type) -> int | float:
    try:
        number = int(value) if kind is int else float(value)
    except ValueError:
        number = math.nan
    if not math.isfinite(number) or abs(number) > 1e6 or (key == "seed" and number < 0):
        what = "a whole number" if kind is int else "a number"
        least = "0" if key == "seed" else "-1e6"
        raise KbotError(f"world '{world}': {key} must be {what} from {least} to 1e6, not '{value}'")
    return number


def _unknown(what: str, name: str, known: list[str]) -> str:
    return f"{what}: {did_you_mean(name, known) or 'choose from ' + ', '.join(known)}"
