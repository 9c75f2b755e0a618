"""teleop_twist_keyboard: converts pressed keys to twists."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

SPEED, TURN = 0.5, 1.0
"""The ROS node's default speeds in m/s and rad/s."""


@dataclass(frozen=True, slots=True)
class Keys:
    """The topic on which commands are published, and the initial speeds in m/s and rad/s."""

    topic: str
    speed: float = SPEED
    turn: float = TURN


RATE = 10.0
"""Hz at which a command is repeated while the robot moves, so that it does not time out after 0.5 s."""

_MOVES = {
    "i": (1.0, 0.0), "o": (1.0, -1.0), "j": (0.0, 1.0), "l": (0.0, -1.0), "u": (1.0, 1.0),
    ",": (-1.0, 0.0), ".": (-1.0, 1.0), "m": (-1.0, -1.0),
}  # fmt: skip
_SPEEDS = {
    "q": (1.1, 1.1), "z": (0.9, 0.9), "w": (1.1, 1.0), "x": (0.9, 1.0), "e": (1.0, 1.1), "c": (1.0, 0.9),
}  # fmt: skip

HELP = """Drive with these keys, here or in the page:
   u    i    o
   j    k    l      k or any other key stops
   m    ,    .
q/z: raise or lower both speeds by 10 %;  w/x: forward speed;  e/c: turning speed"""


class TeleopKeys:
    """The commanded speeds after each key, with the keys of the ROS node. A motion continues until the next
    key."""

    def __init__(self, speed: float = SPEED, turn: float = TURN) -> None:
        self.speed, self.turn = speed, turn
        self._move = (0.0, 0.0)
        self._is_changed = False

    @property
    def twist(self) -> tuple[float, float]:
        """Forward speed in m/s and turning speed in rad/s."""
        return self._move[0] * self.speed, self._move[1] * self.turn

    def press(self, key: str) -> None:
        """Process a key. Keys without a meaning stop the robot."""
        if key in _SPEEDS:
            speed_factor, turn_factor = _SPEEDS[key]
            self.speed, self.turn = self.speed * speed_factor, self.turn * turn_factor
        else:
            self._move = _MOVES.get(key, (0.0, 0.0))
        self._is_changed = True

    def drive(self, command: Callable[[float, float], None]) -> None:
        """Call `command` while the robot moves, and after a key. Must be called `RATE` times a second."""
        if self._is_changed or self._move != (0.0, 0.0):
            self._is_changed = False
            command(*self.twist)
