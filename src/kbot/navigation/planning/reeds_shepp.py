"""The shortest paths of a car that drives forwards and backwards, without obstacles (Reeds-Shepp paths).

J. A. Reeds and L. A. Shepp, "Optimal paths for a car that goes both forwards and backwards", Pacific Journal
of Mathematics 145 (1990). A shortest path is one of 48 words of up to five pieces: curves of the least radius
to the left (L) and to the right (R), and straight lines (S). The formulas are numbered as in section 8 of the
paper, with its symmetries: to drive the path the other way (time flip), to mirror it (reflect), and to drive
its pieces in reverse order (backwards).

All lengths are multiples of the radius. Whole arrays of poses are computed at once, because a search needs
thousands of distances. On PyPI, `ompl` (BSD) has no wheels for Windows, `reeds-shepp` (MIT) has none at all,
and the paths of `rsplan` (MIT) are too long in a third of random cases.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.angles import wrap_all
from kbot.kinematics.planar_pose import PlanarPose, arc

Values = NDArray[np.float64]

_TURNS = 2.0 * np.pi
_ROUNDING = 1e-9
"""Angles and lengths that miss zero by less than this are zero: rounding must not lose a word."""
_MIRRORED = str.maketrans("LR", "RL")


@dataclass(frozen=True, slots=True)
class ReedsSheppPath:
    """A path of pieces in turn: `turns` has L, R or S for each, and `lengths` its length, negative if it is
    driven backwards. Both are multiples of the radius."""

    turns: str
    lengths: tuple[float, ...]

    @property
    def length(self) -> float:
        return sum(abs(length) for length in self.lengths)

    @property
    def cusps(self) -> int:
        """How often the path changes between forwards and backwards."""
        ways = [length > 0.0 for length in self.lengths]
        return sum(a != b for a, b in itertools.pairwise(ways))

    def sample(self, start: PlanarPose, radius: float, spacing: float) -> Values:
        """Poses (n, 3) from `start` to the end of the path, at most `spacing` m apart, with one at the end of
        each piece."""
        poses = [np.array([[start.x, start.y, start.yaw]])]
        at = start
        for turn, length in zip(self.turns, self.lengths, strict=True):
            curvature = {"L": 1.0, "R": -1.0, "S": 0.0}[turn] / radius
            way = length * radius
            count = max(1, int(np.ceil(abs(way) / spacing)))
            poses.append(along_arc(at, curvature, way * np.arange(1, count + 1) / count))
            at = at @ arc(way, way * curvature)
        return np.concatenate(poses)


def along_arc(start: PlanarPose, curvature: float, ways: Values) -> Values:
    """Poses (n, 3) after driving `ways` (m, negative backwards) from `start` with a curvature in 1/m."""
    half = ways * (curvature / 2.0)
    chord = ways * np.sinc(half / np.pi)
    heading = start.yaw + half
    return np.stack(
        [start.x + chord * np.cos(heading), start.y + chord * np.sin(heading), heading + half], axis=1
    )


def distances(x: Values, y: Values, yaw: Values) -> Values:
    """The lengths of the shortest paths from the origin to poses, in multiples of the radius.

    `x` and `y` are multiples of the radius, and `yaw` is in rad; arrays (n,)."""
    best = np.full(x.shape, np.inf)
    for _, lengths, is_valid in _words(x, y, yaw):
        total = np.where(is_valid, np.abs(lengths).sum(axis=0), np.inf)
        np.minimum(best, total.min(axis=0), out=best)
    return best


def paths(x: float, y: float, yaw: float) -> list[ReedsSheppPath]:
    """All words that lead from the origin to a pose (in multiples of the radius, and rad), the shortest
    first."""
    found: dict[tuple[str, tuple[float, ...]], ReedsSheppPath] = {}
    for turns, lengths, is_valid in _words(np.array([x]), np.array([y]), np.array([yaw])):
        for index in np.flatnonzero(is_valid[:, 0]):
            word = turns.translate(_MIRRORED) if _SYMMETRIES[index][1] < 0.0 else turns
            values = (lengths[:, index, 0] * _SYMMETRIES[index][0]).tolist()
            pieces = list(zip(word, values, strict=True))
            if index >= 4:
                pieces.reverse()
            pieces = [(turn, length) for turn, length in pieces if abs(length) > _ROUNDING]
            path = ReedsSheppPath("".join(t for t, _ in pieces), tuple(length for _, length in pieces))
            found[path.turns, tuple(round(length, 6) for length in path.lengths)] = path
    return sorted(found.values(), key=lambda path: path.length)


def path_between(start: PlanarPose, goal: PlanarPose, radius: float) -> list[ReedsSheppPath]:
    """All words from one pose to another for a least radius in m, the shortest first."""
    x, y = start.local(goal.x, goal.y)
    return paths(x / radius, y / radius, goal.yaw - start.yaw)


_SYMMETRIES = tuple((flip, mirror) for _ in range(2) for flip in (1.0, -1.0) for mirror in (1.0, -1.0))
"""The signs of the time flip and of the reflection. The last four are also driven in reverse order."""

_Word = tuple[str, Values, NDArray[np.bool_]]
"""The turns, the lengths (pieces, symmetries, poses), and which are valid."""


def _words(x: Values, y: Values, yaw: Values) -> Iterator[_Word]:
    # the pose from which the reversed path leads to the origin
    back_x, back_y = x * np.cos(yaw) + y * np.sin(yaw), x * np.sin(yaw) - y * np.cos(yaw)
    flips = np.array([flip for flip, _ in _SYMMETRIES])[:, None]
    mirrors = np.array([mirror for _, mirror in _SYMMETRIES])[:, None]
    along = np.concatenate([np.tile(x, (4, 1)), np.tile(back_x, (4, 1))]) * flips
    across = np.concatenate([np.tile(y, (4, 1)), np.tile(back_y, (4, 1))]) * mirrors
    turn = np.tile(yaw, (8, 1)) * flips * mirrors
    sin, cos = np.sin(turn), np.cos(turn)
    same = along - sin, across - 1.0 + cos  # middle of the last curve if it turns like the first
    other = along + sin, across - 1.0 - cos  # and if it turns the other way
    for formula in _FORMULAS:
        with np.errstate(invalid="ignore"):  # of the square roots and arcs of words that are not valid
            yield formula(*(same if formula in _SAME else other), turn)


def _positive(angle: Values) -> Values:
    """The same angle from 0 to 2 pi. A rounding error below 0 is 0."""
    positive: Values = np.mod(angle, _TURNS)
    return np.where(positive > _TURNS - _ROUNDING, 0.0, positive)


def _csc_same(xi: Values, eta: Values, turn: Values) -> _Word:
    """L S L (8.1)."""
    u, t = np.hypot(xi, eta), np.arctan2(eta, xi)
    t = _positive(t)
    v = _positive(turn - t)
    return "LSL", np.stack([t, u, v]), np.isfinite(u)


def _csc_other(xi: Values, eta: Values, turn: Values) -> _Word:
    """L S R (8.2)."""
    square = xi * xi + eta * eta
    u = np.sqrt(square - 4.0)
    t = _positive(np.arctan2(eta, xi) + np.arctan2(2.0, u))
    v = _positive(t - turn)
    return "LSR", np.stack([t, u, v]), square >= 4.0


def _ccc(xi: Values, eta: Values, turn: Values) -> _Word:
    """L R- L (8.3), and with a last piece that is driven backwards (8.4)."""
    away = np.hypot(xi, eta)
    u = -2.0 * np.arcsin(np.minimum(away, 4.0) / 4.0)
    t = _positive(np.arctan2(eta, xi) + u / 2.0 + np.pi)
    v = wrap_all(turn - t + u)
    return "LRL", np.stack([t, u, v]), away <= 4.0


def _cccc(xi: Values, eta: Values, turn: Values) -> _Word:
    """L R L- R- (8.7)."""
    rho = (2.0 + np.hypot(xi, eta)) / 4.0
    u = np.arccos(np.minimum(rho, 1.0))
    t, v = _tau_omega(u, -u, xi, eta, turn)
    return "LRLR", np.stack([t, u, -u, v]), (rho <= 1.0) & (v <= _ROUNDING)


def _cccc_inner(xi: Values, eta: Values, turn: Values) -> _Word:
    """L R- L- R (8.8)."""
    rho = (20.0 - xi * xi - eta * eta) / 16.0
    u = -np.arccos(np.clip(rho, 0.0, 1.0))
    t, v = _tau_omega(u, u, xi, eta, turn)
    return "LRLR", np.stack([t, u, u, v]), (rho >= 0.0) & (rho <= 1.0) & (v >= -_ROUNDING)


def _ccsc_same(xi: Values, eta: Values, turn: Values) -> _Word:
    """L R- S- L- (8.9); the second curve turns by 90 degrees."""
    away = np.hypot(xi, eta)
    r = np.sqrt(away * away - 4.0)
    u = 2.0 - r
    t = _positive(np.arctan2(eta, xi) + np.arctan2(r, -2.0))
    v = wrap_all(turn - np.pi / 2.0 - t)
    quarter = np.full_like(t, -np.pi / 2.0)
    return "LRSL", np.stack([t, quarter, u, v]), (away >= 2.0) & (u <= _ROUNDING) & (v <= _ROUNDING)


def _ccsc_other(xi: Values, eta: Values, turn: Values) -> _Word:
    """L R- S- R- (8.10); the second curve turns by 90 degrees."""
    away = np.hypot(xi, eta)
    t = _positive(np.arctan2(xi, -eta))
    u = 2.0 - away
    v = wrap_all(t + np.pi / 2.0 - turn)
    quarter = np.full_like(t, -np.pi / 2.0)
    return "LRSR", np.stack([t, quarter, u, v]), (away >= 2.0) & (v <= _ROUNDING)


def _ccscc(xi: Values, eta: Values, turn: Values) -> _Word:
    """L R- S- L- R (8.11); the second and the fourth curve turn by 90 degrees."""
    away = np.hypot(xi, eta)
    u = 4.0 - np.sqrt(away * away - 4.0)
    t = _positive(np.arctan2((4.0 - u) * xi - 2.0 * eta, -2.0 * xi + (u - 4.0) * eta))
    v = wrap_all(t - turn)
    quarter = np.full_like(t, -np.pi / 2.0)
    return (
        "LRSLR",
        np.stack([t, quarter, u, quarter, v]),
        (away >= 2.0) & (u <= _ROUNDING) & (v >= -_ROUNDING),
    )


def _tau_omega(u: Values, v: Values, xi: Values, eta: Values, turn: Values) -> tuple[Values, Values]:
    """The first and the last piece of a word with four curves (8.6)."""
    delta = wrap_all(u - v)
    a, b = np.sin(u) - np.sin(delta), np.cos(u) - np.cos(delta) - 1.0
    angle = np.arctan2(eta * a - xi * b, xi * a + eta * b)
    side = 2.0 * (np.cos(delta) - np.cos(v) - np.cos(u)) + 3.0
    tau = _positive(np.where(side < 0.0, angle + np.pi, angle))
    return tau, wrap_all(tau - u + v - turn)


_FORMULAS: tuple[Callable[[Values, Values, Values], _Word], ...] = (
    _csc_same, _csc_other, _ccc, _cccc, _cccc_inner, _ccsc_same, _ccsc_other, _ccscc,
)  # fmt: skip
_SAME = frozenset({_csc_same, _ccc, _ccsc_same})
