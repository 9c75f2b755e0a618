"""teleop_twist_keyboard: turns keys into a twist."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

SPEED, TURN = 0.5, 1.0
"""The node's own first speeds in m/s and rad/s."""


@dataclass(frozen=True, slots=True)
class Keys:
    """The topic on which teleop_twist_keyboard publishes commands, and its first speeds in m/s and rad/s."""

    topic: str
    speed: float = SPEED
    turn: float = TURN


RATE = 10.0
"""Hz at which a command is said again while a key's motion goes on."""

_MOVES = {
    "i": (1.0, 0.0), "o": (1.0, -1.0), "j": (0.0, 1.0), "l": (0.0, -1.0), "u": (1.0, 1.0),
    ",": (-1.0, 0.0), ".": (-1.0, 1.0), "m": (-1.0, -1.0),
}  # fmt: skip
_SPEEDS = {
    "q": (1.1, 1.1), "z": (0.9, 0.9), "w": (1.1, 1.0), "x": (0.9, 1.0), "e": (1.0, 1.1), "c": (1.0, 0.9),
}  # fmt: skip

HELP = """Drive by keys, here or in the page:
   u    i    o
   j    k    l      k or any other key stops
   m    ,    .
q/z: both speeds up and down by 10 %;  w/x: forward;  e/c: turning"""


class TeleopKeys:
    """Forward m/s and turning rad/s after each key, as the ROS node has them. A motion goes on until the
    next key; the keys' own words are those of the node."""

    def __init__(self, speed: float = SPEED, turn: float = TURN) -> None:
        self.speed, self.turn = speed, turn
        self._move = (0.0, 0.0)
        self._is_news = False

    @property
    def twist(self) -> tuple[float, float]:
        return self._move[0] * self.speed, self._move[1] * self.turn

    def press(self, key: str) -> None:
        """Take a key; letters that mean nothing stop the robot."""
        if key in _SPEEDS:
            faster, quicker = _SPEEDS[key]
            self.speed, self.turn = self.speed * faster, self.turn * quicker
        else:
            self._move = _MOVES.get(key, (0.0, 0.0))
        self._is_news = True

    def drive(self, command: Callable[[float, float], None]) -> None:
        """Command what the keys say, where they say something: called `RATE` times a second."""
        if self._is_news or self._move != (0.0, 0.0):
            self._is_news = False
            command(*self.twist)
