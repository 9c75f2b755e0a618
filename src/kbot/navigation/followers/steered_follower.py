"""A controller that follows a path with a steered base, and stops where the path changes between forwards and
backwards.

The steering law is that of C. Samson, "Control of chained systems: application to path following and
time-varying point-stabilization of mobile robots", IEEE Transactions on Automatic Control 40 (1995): the
curvature of the path, minus terms proportional to the distance and to the angle from the path. Both errors
decay over a constant distance, whatever the speed, and forwards as well as backwards.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.angles import wrap
from kbot.messages import Twist
from kbot.navigation.controller import (
    GENTLE,
    PLANNED_BRAKING,
    STILL,
    ControllerLimits,
    Observation,
    twist,
)
from kbot.navigation.path import Path
from kbot.text import KbotError

_CREEP = 0.1
"""Share of the speed at which the base drives while its wheels steer."""
_OFF_IN_CREEP = 0.02
"""The base may drive this share of its turning radius while its wheels steer from one limit to the other."""
_SLOWEST = 0.02
"""m/s. The lowest speed before an end, below which friction stops some bases."""
_MEASURABLE = 0.002
"""m/s. Above this speed, the measured curvature means something."""
_AGREES = 0.15
"""A measured curvature that misses the commanded one by less, as a share of the largest, has been steered."""
_JUMP = 0.3
"""A change of curvature by more than this share of the largest counts as a jump, before which the base
slows down."""
_OFF_IN_JUMP = 0.05
"""The base may drive this share of its turning radius while its wheels steer in a jump."""
_NEAR_END = 0.3
"""Turning radii before an end, within which the nearest place on the path does not show how far it is."""
_MISSED = 0.02
"""Turning radii. A base that has stopped further before an end than this drives on."""
_LAG, _LAG_PER_TIME = 0.05, 0.1
"""s, and share of the time to steer from limit to limit, by which the steering lags behind small changes."""
_DECAY, _DECAY_IN_LAGS = 0.3, 4.0
"""Distance over which the errors decay: turning radii, but at least the way in this many lags, because the
steering would otherwise swing."""
_WINDOW = 0.5
"""The nearest place on the path is looked for at most this many turning radii ahead."""


@dataclass(frozen=True, slots=True)
class Steering:
    """What a steered base can do: `radius` is its least turning radius in m, and `time` the seconds in which
    it steers from one limit to the other."""

    radius: float
    time: float = 0.2


@dataclass(frozen=True, slots=True, eq=False)
class _Piece:
    """A part of the path that is driven in one direction (1 or -1): poses (n, 3), the length up to each of
    them in m, and the curvature (1/m) after each."""

    direction: float
    poses: NDArray[np.float64]
    along: NDArray[np.float64]
    curvatures: NDArray[np.float64]

    @property
    def length(self) -> float:
        return float(self.along[-1])


class SteeredFollower:
    """Follows a path with headings. `is_done` is True once the base is at its end, and then stands still.

    The pose in the observations is that of the middle of the fixed axle."""

    def __init__(self, path: Path, steering: Steering, limits: ControllerLimits = GENTLE) -> None:
        """Raises KbotError: the path has no headings."""
        if path.yaws is None:
            raise KbotError("a steered base needs the heading at each point of its path")
        self.path, self.limits, self._steering = path, limits, steering
        self._pieces = _pieces(np.column_stack([path.points, path.yaws]))
        self._beyond = [sum(p.length for p in self._pieces[at + 1 :]) for at in range(len(self._pieces))]
        self.is_done = not self._pieces
        self.remaining = sum(piece.length for piece in self._pieces)
        """Distance in m that is left along the path."""
        self.heading_error = 0.0
        """Always 0: a steered base does not turn on the spot."""
        self._at, self._along = 0, 0.0
        self._stops = False
        self._measured: float | None = None

    def update(self, observation: Observation) -> Twist:
        if self.is_done:
            return STILL
        if self._stops:
            return self._stop(observation)
        piece, pose = self._pieces[self._at], observation.pose
        self._advance(piece, pose.x, pose.y)
        x, y, yaw, curvature = self._reference(piece, self._along)
        left_of_end = piece.length - self._along
        end_x, end_y, end_yaw = piece.poses[-1].tolist()
        # the distance along the end's heading, also past the end
        to_end = piece.direction * (
            (end_x - pose.x) * math.cos(end_yaw) + (end_y - pose.y) * math.sin(end_yaw)
        )
        if left_of_end < self._near_end:
            left_of_end = min(left_of_end, to_end) if to_end > 0.0 else to_end
        self.remaining = max(left_of_end, 0.0) + self._beyond[self._at]
        if left_of_end <= self._stopping_distance(observation):
            self._stops = True
            return self._stop(observation)
        off = -math.sin(yaw) * (pose.x - x) + math.cos(yaw) * (pose.y - y)
        turned = wrap(pose.yaw - yaw)
        preview = self._reference(piece, self._along + abs(observation.twist.x) * self._lag)[3]
        curvature = self._steer(preview, off, turned, piece.direction)
        self._measure(observation)
        speed = self._speed(piece, left_of_end, curvature)
        v = piece.direction * speed
        return twist(v, v * curvature)

    @property
    def _near_end(self) -> float:
        """Distance in m before an end from which the distance along its heading counts."""
        return _NEAR_END * self._steering.radius

    @property
    def _lag(self) -> float:
        """Seconds by which the steering lags behind small changes."""
        return _LAG + _LAG_PER_TIME * self._steering.time

    def _stop(self, observation: Observation) -> Twist:
        """Stand still, and then begin the next piece, or go on if the base is still before the end."""
        if observation.is_at_rest:
            self._stops = False
            piece = self._pieces[self._at]
            self._advance(piece, observation.pose.x, observation.pose.y)
            if piece.length - self._along > max(self.limits.distance, _MISSED * self._steering.radius):
                self._measured = None
                return STILL
            self._at, self._along, self._measured = self._at + 1, 0.0, None
            if self._at == len(self._pieces):
                self.is_done, self.remaining = True, 0.0
        return STILL

    def _stopping_distance(self, observation: Observation) -> float:
        """m before the end at which the base must stop to be at the end."""
        speed = abs(observation.twist.x)
        return min(0.2 * self.limits.distance, 0.002) + speed * speed / (4.0 * self.limits.braking)

    def _steer(self, curvature: float, off: float, turned: float, direction: float) -> float:
        """The curvature in 1/m to drive, for a path of some curvature from which the base is `off` m to the
        left, and turned by some rad."""
        length = max(_DECAY * self._steering.radius, _DECAY_IN_LAGS * self._lag * self.limits.linear)
        feed = curvature * math.cos(turned) / max(1.0 - curvature * off, 0.3)
        share = math.sin(turned) / turned if turned else 1.0
        wanted = feed - off * share / length**2 - 2.0 * direction * turned / length
        most = 1.0 / self._steering.radius
        return min(max(wanted, -most), most)

    def _measure(self, observation: Observation) -> None:
        """Measure the curvature that the base drives; it is not known while the base stands."""
        motion = observation.twist
        if abs(motion.x) > _MEASURABLE:
            self._measured = motion.yaw / motion.x

    def _speed(self, piece: _Piece, left: float, curvature: float) -> float:
        limits, radius = self.limits, self._steering.radius
        speed = min(limits.linear, limits.angular / max(abs(curvature), 1e-9))
        speed = min(speed, math.sqrt(2.0 * PLANNED_BRAKING * limits.braking * max(left, 0.0)))
        change = np.abs(np.diff(piece.curvatures)) * radius / 2.0
        for at in np.flatnonzero(change > _JUMP / 2.0):
            away = float(piece.along[at + 1]) - self._along
            if away > 0.0:
                slow = _OFF_IN_JUMP * radius / (0.05 + self._steering.time * float(change[at]))
                speed = min(speed, math.sqrt(slow * slow + 2.0 * limits.braking * away))
        speed = max(speed, _SLOWEST)
        creep = min(_CREEP * limits.linear, _OFF_IN_CREEP * radius / self._steering.time)
        if self._measured is None:
            return min(speed, creep)
        misses = abs(curvature - self._measured) * radius - _AGREES
        return min(speed, max(speed * (1.0 - 2.0 * misses), creep))

    def _advance(self, piece: _Piece, x: float, y: float) -> None:
        """Find the nearest place of the piece, never backwards: a path may pass close to itself."""
        reach = self._along + _WINDOW * self._steering.radius
        first = max(int(np.searchsorted(piece.along, self._along, side="right")) - 1, 0)
        last = min(int(np.searchsorted(piece.along, reach)) + 1, len(piece.along))
        starts, ends = piece.poses[first : last - 1, :2], piece.poses[first + 1 : last, :2]
        if not len(starts):
            return
        ways = ends - starts
        lengths = (ways**2).sum(axis=1)
        share = np.clip((((x, y) - starts) * ways).sum(axis=1) / lengths, 0.0, 1.0)
        off = np.hypot(*((starts + share[:, None] * ways) - (x, y)).T)
        best = int(off.argmin())
        steps = np.diff(piece.along[first:last])
        self._along = max(self._along, float(piece.along[first + best] + share[best] * steps[best]))

    def _reference(self, piece: _Piece, along: float) -> tuple[float, float, float, float]:
        """The pose and the curvature of the path at a length in m."""
        along = min(along, piece.length)
        x, y, yaw = (float(np.interp(along, piece.along, piece.poses[:, column])) for column in range(3))
        at = min(int(np.searchsorted(piece.along, along, side="right")) - 1, len(piece.curvatures) - 1)
        return x, y, yaw, float(piece.curvatures[at])


def _pieces(poses: NDArray[np.float64]) -> list[_Piece]:
    """The path, split where it changes between forwards and backwards."""
    poses = np.column_stack([poses[:, :2], np.unwrap(poses[:, 2])])
    x, y, turn = np.diff(poses, axis=0).T
    middle = poses[:-1, 2] + turn / 2.0
    lengths = np.hypot(x, y) / np.sinc(turn / (2.0 * math.pi))
    moves = lengths > 1e-6
    kept = np.concatenate([[True], moves])
    poses, lengths, turn = poses[kept], lengths[moves], turn[moves]
    directions = np.where((x * np.cos(middle) + y * np.sin(middle))[moves] < 0.0, -1.0, 1.0)
    curvatures = turn / (lengths * directions)
    bounds = [0, *(np.flatnonzero(np.diff(directions)) + 1).tolist(), len(directions)]
    return [
        _Piece(
            float(directions[first]),
            poses[first : last + 1],
            np.concatenate([[0.0], np.cumsum(lengths[first:last])]),
            curvatures[first:last],
        )
        for first, last in itertools.pairwise(bounds)
        if last > first
    ]
