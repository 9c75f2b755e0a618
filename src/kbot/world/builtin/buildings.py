"""Indoors: rooms with doors, and a corridor."""

from __future__ import annotations

from kbot.text import KbotError
from kbot.world.builders import WOOD, box, floor, wall
from kbot.world.world import Body, World


def corridor(length: float = 6.0, width: float = 0.8, height: float = 0.3) -> World:
    """Two walls along x, from 0.5 m behind the start on, closed at the far end."""
    if not (length > 0.5 and width > 0.2 and height > 0.0):
        raise KbotError("world 'corridor' needs a length above 0.5 m, a width above 0.2 m, a height above 0")
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


def rooms(columns: int = 3, rows: int = 2, size: float = 2.0, door: float = 0.6) -> World:
    """Rooms of `size` metres in a grid, a door in the middle of every inner wall, a table in every
    other room; the start is the middle of the first room."""
    if not (1 <= columns <= 20 and 1 <= rows <= 20 and size > door > 0.0):
        raise KbotError("world 'rooms' needs 1 to 20 columns and rows, and a size above that of the doors")
    bodies: list[Body] = [floor(max(40.0, 2.5 * size * max(columns, rows)))]
    for column in range(columns + 1):
        for row in range(rows):
            x, low = (column - 0.5) * size, (row - 0.5) * size
            inner = 0 < column < columns
            bodies += _side(f"wall_x{column}_{row}", (x, low), (x, low + size), door if inner else 0.0)
    for row in range(rows + 1):
        for column in range(columns):
            y, low = (row - 0.5) * size, (column - 0.5) * size
            inner = 0 < row < rows
            bodies += _side(f"wall_y{column}_{row}", (low, y), (low + size, y), door if inner else 0.0)
    for column in range(columns):
        for row in range(rows):
            if (column + row) % 2:
                x, y = column * size + size * 0.25, row * size + size * 0.25
                bodies.append(box(f"table_{column}_{row}", (0.35, 0.25, 0.2), x, y, rgba=WOOD))
    return World("rooms", tuple(bodies))


def _side(name: str, start: tuple[float, float], end: tuple[float, float], door: float) -> list[Body]:
    """A wall, in two pieces when there is a door in its middle."""
    if not door:
        return [wall(name, start, end)]
    length = abs(end[0] - start[0]) + abs(end[1] - start[1])
    share = (length - door) / 2 / length
    across = ((end[0] - start[0]) * share, (end[1] - start[1]) * share)
    return [
        wall(f"{name}_a", start, (start[0] + across[0], start[1] + across[1])),
        wall(f"{name}_b", (end[0] - across[0], end[1] - across[1]), end),
    ]
