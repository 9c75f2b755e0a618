"""Walls between cells such that one way leads from any cell to any other."""

from __future__ import annotations

import numpy as np

from kbot.text import KbotError
from kbot.world.builders import floor, wall
from kbot.world.world import Body, World

Cell = tuple[int, int]


def maze(size: int = 8, seed: int = 1, cell: float = 0.6, height: float = 0.25) -> World:
    """A perfect maze of `size` x `size` cells of `cell` metres; the start is the middle of a corner
    cell, whose open side lies ahead or to the left."""
    if not 1 <= size <= 100 or not cell > 0.05 or not height > 0.0:
        raise KbotError("world 'maze' needs a size of 1 to 100, cells wider than 0.05 m and a height above 0")
    bodies: list[Body] = [floor(max(40.0, 2.5 * size * cell))]
    for index, (start, end) in enumerate(_walls(size, _passages(size, seed))):
        low = tuple((v - 0.5) * cell for v in start)
        high = tuple((v - 0.5) * cell for v in end)
        bodies.append(wall(f"wall_{index}", (low[0], low[1]), (high[0], high[1]), height))
    return World("maze", tuple(bodies))


def _passages(size: int, seed: int) -> set[frozenset[Cell]]:
    """Pairs of neighbouring cells without a wall between them: a random walk that backs out of dead
    ends (depth first), so every cell is reached once."""
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
    """Straight walls as pairs of corner points, neighbouring pieces joined to one."""
    walls: list[tuple[Cell, Cell]] = []
    for line in range(size + 1):
        across = [_is_open((at, line - 1), (at, line), passages) for at in range(size)]
        along = [_is_open((line - 1, at), (line, at), passages) for at in range(size)]
        walls += [((a, line), (b, line)) for a, b in _closed_runs(across)]
        walls += [((line, a), (line, b)) for a, b in _closed_runs(along)]
    return walls


def _is_open(one: Cell, other: Cell, passages: set[frozenset[Cell]]) -> bool:
    return frozenset((one, other)) in passages


def _closed_runs(is_open: list[bool]) -> list[tuple[int, int]]:
    """Start and end of every run of places that are not open."""
    runs: list[tuple[int, int]] = []
    start: int | None = None
    for at, gap in enumerate([*is_open, True]):
        if not gap and start is None:
            start = at
        elif gap and start is not None:
            runs.append((start, at))
            start = None
    return runs
