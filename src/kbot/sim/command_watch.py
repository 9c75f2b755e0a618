"""Compares how far a robot drives and turns with a steady command that began while it stood."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, hypot, sin

from kbot.sim.drive.twist_controller import STILL, Twist
from kbot.sim.recipe import ANGULAR_ACCELERATION, LINEAR_ACCELERATION, SERVO_STIFFNESS

SHORT = (0.05, 0.1)
"""Shares of the commanded distance and angle by which a robot may drive less or more."""
LEAST_TIME = 3.0
"""Seconds for which the command must have been the same. The start takes a good part of a shorter time."""
_UNEXPLAINED = 0.015
"""Share of the command that an ordinary start must leave unexplained. The time of a command is known to
0.02 s, 0.7 % of 3 s."""
_FASTEST = 3.0
"""Turning speed in rad/s above which a sample shows the turn, but not the distance."""
_LEAST = (0.03, 0.1)
"""Metres and rad that must be missing: tilting onto a caster moves a robot by a few millimetres."""


@dataclass(frozen=True, slots=True)
class Miss:
    """A robot drove or turned more or less than a steady command asks for.

    wanted    the command, in m/s, m/s and rad/s
    seconds   how long it was the same
    is_turn   whether it is the angle that differs, and not the distance
    share     of the commanded distance or angle that the robot covered
    odometry  the same by odometry of the wheels, whatever odometry the robot publishes
    rolled    the same by wheels with their true sizes, sides and axes that do not slip
    """

    wanted: Twist
    seconds: float
    is_turn: bool
    share: float
    odometry: float
    rolled: float


class CommandWatch:
    """Sums up the motion of a robot since its command changed from zero.

    The motion is that of its axle. Sideways motion of a base that only drives forwards does not count.
    """

    def __init__(self, time: float) -> None:
        self.wanted = STILL
        self._since: float | None = None
        self._time = time
        self._way = self._turn = self._odometry_way = self._odometry_turn = 0.0
        self._rolled_way = self._rolled_turn = 0.0
        self._earlier: Miss | None = None

    def start(self, time: float, wanted: Twist) -> None:
        """Call this for each new command."""
        self._earlier = self.miss
        # a robot that moves already gets to its new speed in more or less than an ordinary start
        self._since = time if self.wanted == STILL else None
        self.wanted = wanted
        self._way = self._turn = self._odometry_way = self._odometry_turn = 0.0
        self._rolled_way = self._rolled_turn = 0.0

    def add(self, time: float, moved: Twist, odometry: Twist, rolled: Twist) -> None:
        """Add the true motion since the last call, that by odometry, and that of wheels that do not slip: m
        and m in the axle's frame, rad."""
        self._way += _way(moved, self.wanted)
        self._turn += moved[2]
        self._odometry_way += _way(odometry, self.wanted)
        self._odometry_turn += odometry[2]
        self._rolled_way += _way(rolled, self.wanted)
        self._rolled_turn += rolled[2]
        self._time = time

    @property
    def miss(self) -> Miss | None:
        """That of the first command that was missed, including the current one."""
        if self._earlier is not None or self._since is None or self.wanted == STILL:
            return self._earlier
        seconds, (x, y, yaw) = self._time - self._since, self.wanted
        if seconds < LEAST_TIME:
            return None
        for is_turn, speed, done, odometry, rolled, acceleration in (
            (False, hypot(x, y), self._way, self._odometry_way, self._rolled_way, LINEAR_ACCELERATION),
            (True, yaw, self._turn, self._odometry_turn, self._rolled_turn, ANGULAR_ACCELERATION),
        ):
            if not speed or (not is_turn and abs(yaw) > _FASTEST):
                continue
            asked = speed * seconds
            ordinary = asked - speed * abs(speed) / (2.0 * acceleration) - speed / SERVO_STIFFNESS
            if abs(done - asked) > max(SHORT[is_turn] * abs(asked), _LEAST[is_turn]) and abs(
                done - ordinary
            ) > _UNEXPLAINED * abs(asked):
                return Miss(self.wanted, seconds, is_turn, done / asked, odometry / asked, rolled / asked)
        return None


def _way(moved: Twist, wanted: Twist) -> float:
    """The length in m of the arc of a motion, in the direction of a command."""
    x, y, turn = moved
    half = turn / 2.0
    # the chord points half the turn to the side
    forward, left = x * cos(half) + y * sin(half), y * cos(half) - x * sin(half)
    bend = half / sin(half) if 1e-6 < abs(half) < 3.0 else 1.0
    size = hypot(wanted[0], wanted[1]) or 1.0
    return bend * (forward * wanted[0] + left * wanted[1]) / size
