"""Searches a path over position and heading for a robot whose outline or steering matters.

Hybrid A* (Dolgov et al., "Practical search techniques in path planning for autonomous driving", STAIR 2008):
each state is a pose that the robot reaches exactly, one state is kept for each cell of position and heading,
and from time to time the search tries to connect a state directly to the goal. The estimate of the distance
that is left is the larger of two: one for the base's moves without obstacles, and one with obstacles for the
largest circle inside the outline, which moves in every direction. The path is then shortened by direct
connections between its poses.

States are expanded in batches, because each batch is a few numpy operations on all its poses.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.planar_pose import PlanarPose
from kbot.navigation.space.cost_to_go import BLOCKED, LETHAL, CostToGo, Sweeping, halved
from kbot.navigation.space.distance_field import DistanceField, distances
from kbot.navigation.space.footprint import Outline
from kbot.navigation.space.footprint_clearance import FootprintClearance

Values = NDArray[np.float64]

_BATCH = 16
"""States that are expanded at once. A larger batch has more states that the path does not need."""
_MOST_STATES = 60_000
"""States after which the search ends: a few seconds. Mazes for cars need tens of thousands."""
_GOOD_ENOUGH = 1.03
"""The search ends with a path that is at most this many times as long as the estimate of the best one."""
_MORE = 0.2
"""Share of states that the search expands after the first path, in the hope of a better one."""
_SHOTS = 4
"""Batches after which the search tries a direct connection, unless a state is much nearer to the goal."""
_PASSES = 3
"""How often a path is shortened."""


class Moves(Protocol):
    """How a base moves: the steps of the search, and direct connections.

    steps       poses (steps, k, 3) along each step in the base's frame, the last at its end
    lengths     of the steps (steps,), with what turning costs
    directions  (steps,) 1 or -1 for steps that a base which stops to change its direction drives forwards or
                backwards, else 0
    cusp        cost in m of a change between forwards and backwards
    cell        m and rad: the size of the cells in which one state is kept
    """

    steps: Values
    lengths: Values
    directions: Values
    cusp: float
    cell: tuple[float, float]

    def estimate(self, poses: Values, goal: PlanarPose, any_heading: bool) -> Values:
        """Costs of the ways from poses (n, 3) to a goal without obstacles, at most the true costs."""
        ...

    def connections(
        self, start: PlanarPose, goal: PlanarPose, any_heading: bool, most: float
    ) -> Iterable[Values]:
        """Poses (n, 3) of direct ways from start to goal that cost less than `most`, the best first."""
        ...

    def costs(self, poses: Values) -> tuple[Values, Values]:
        """The cost (n - 1,) of the way between each two poses (n, 3), and its direction as `directions`."""
        ...


@dataclass(frozen=True, slots=True)
class Clearances:
    """Distances that a path keeps from obstacles, in m.

    least  no pose comes nearer
    room   beyond it, a way costs more
    """

    least: float
    room: float


_NEAR_WEIGHT = 1.0
"""A metre at the least clearance counts as this many more metres."""


class PoseSearch:
    """Searches paths on one grid. Poses are in the frame of the grid, with its corner at the origin."""

    def __init__(
        self, occupied: NDArray[np.bool_], resolution: float, outline: Outline, moves: Moves, keep: Clearances
    ) -> None:
        """`outline` is in the frame of the point that moves."""
        self.moves, self.keep = moves, keep
        self.footprint = FootprintClearance(outline, 1.5 * resolution)
        self._resolution = resolution
        self._size = occupied.shape[1] * resolution, occupied.shape[0] * resolution
        most = self.footprint.outer + keep.least + keep.room
        self._field = DistanceField.of(occupied, (0.0, 0.0), resolution, most)
        # steps of the cost-to-go skip a cell: no wall may be thinner than three
        self._circle = max(self.footprint.inner, 1.5 * resolution)
        self._occupied = occupied

    def clearance(self, poses: Values) -> Values:
        """The clearance in m of poses (..., 3); below 0 outside of the grid."""
        x, y, yaw = poses[..., 0], poses[..., 1], poses[..., 2]
        clearance = self.footprint.of(self._field, x, y, yaw)
        outside = (x < 0.0) | (y < 0.0) | (x > self._size[0]) | (y > self._size[1])
        return np.where(outside, -1.0, clearance)

    def find(self, start: PlanarPose, goal: PlanarPose, any_heading: bool = False) -> Values | None:
        """Poses (n, 3) from start to goal, or None. Both must be free.

        The path may come as near to obstacles as the start or the goal, but not into their cells."""
        ends = np.array([[start.x, start.y, start.yaw], [goal.x, goal.y, goal.yaw]])
        at_ends = self.clearance(ends if not any_heading else ends[:1])
        least = max(min(self.keep.least, float(at_ends.min()) - 1e-6), 0.5 * self._resolution)
        search = _Search(self, start, goal, any_heading, least)
        found = search.run()
        if found is None or search.is_direct:
            return found
        for _ in range(_PASSES):
            shorter = search.shortened(found)
            if shorter is found:
                break
            found = shorter
        return found

    def cost_to_go(self, goal: PlanarPose, any_heading: bool) -> CostToGo:
        """The length of the way of the circle inside the outline from everywhere to the goal."""
        resolution, cells = self._resolution, self._circle / self._resolution
        weight = np.where(distances(self._occupied, math.ceil(cells) + 1) < cells, LETHAL, 1.0)
        while 2.0 * resolution <= min(self.moves.cell[0], 0.5 * self._circle) and min(weight.shape) > 8:
            weight, resolution = halved(weight), resolution * 2.0
        x, y = self.middles(np.array([[goal.x, goal.y, goal.yaw]]))
        radius = 0.0
        if any_heading:
            x, y = np.array([goal.x]), np.array([goal.y])
            radius = self.footprint.outer  # the middle is somewhere around the goal
        sweeping = Sweeping(weight, (0.0, 0.0), resolution, (float(x[0]), float(y[0])), radius)
        while not sweeping.is_done:
            sweeping.sweep()
        return sweeping.result()

    def middles(self, poses: Values) -> tuple[Values, Values]:
        """Where the middle of the circle is at poses (n, 3)."""
        cos, sin, (ahead, left) = np.cos(poses[:, 2]), np.sin(poses[:, 2]), self.footprint.middle
        return poses[:, 0] + cos * ahead - sin * left, poses[:, 1] + sin * ahead + cos * left


class _Search:
    """One search from a start to a goal."""

    def __init__(
        self, space: PoseSearch, start: PlanarPose, goal: PlanarPose, any_heading: bool, least: float
    ) -> None:
        self._space, self._moves = space, space.moves
        self._start, self._goal, self._any_heading, self._least = start, goal, any_heading, least
        self.is_direct = False
        """Whether the path is a direct connection of start and goal."""
        self._way: CostToGo
        self._left: list[float] = []
        self._poses: list[tuple[float, float, float]] = []
        self._costs: list[float] = []
        self._parents: list[tuple[int, int]] = []
        self._directions: list[float] = []
        self._best: dict[tuple[int, int, int], float] = {}
        self._open: list[tuple[float, float, int]] = []

    def run(self) -> Values | None:
        start = self._start
        first = np.array([[start.x, start.y, start.yaw]])
        found, cost = self._shot(start, 0.0, 0.0)
        direct = float(self._moves.estimate(first, self._goal, self._any_heading)[0])
        self.is_direct = found is not None and cost <= _GOOD_ENOUGH * direct + self._moves.cusp
        if self.is_direct:
            return found
        self._way = self._space.cost_to_go(self._goal, self._any_heading)
        x, y = self._space.middles(first)
        if self._way.is_blocked(float(x[0]), float(y[0]), self._way.resolution):
            return None
        estimate = self._estimates(first)
        self._push(first, np.zeros(1), np.zeros(1), estimate, [(-1, -1)])
        limit, batches, shot_from = _MOST_STATES, 0, math.inf
        closed = set[int]()
        while self._open and len(closed) < limit:
            if cost <= _GOOD_ENOUGH * self._open[0][0]:
                break
            batch = self._pop(closed)
            if not batch:
                break
            self._expand(batch)
            nearest = min(batch, key=self._left.__getitem__)
            batches += 1
            if batches % _SHOTS and self._left[nearest] > 0.7 * shot_from:
                continue
            shot_from = self._left[nearest]
            poses, total = self._shot(
                PlanarPose(*self._poses[nearest]), self._costs[nearest], self._directions[nearest], cost
            )
            if poses is not None and total < cost:
                if math.isinf(cost):
                    limit = min(limit, len(closed) + max(8 * _BATCH, int(_MORE * len(closed))))
                found, cost = np.concatenate([self._way_to(nearest), poses[1:]]), total
        return found

    def _pop(self, closed: set[int]) -> list[int]:
        batch: list[int] = []
        while self._open and len(batch) < _BATCH:
            _, _, node = heapq.heappop(self._open)
            if node not in closed and self._costs[node] <= self._best[self._key(self._poses[node])] + 1e-12:
                closed.add(node)
                batch.append(node)
        return batch

    def _key(self, pose: tuple[float, float, float]) -> tuple[int, int, int]:
        cell, angle = self._moves.cell
        return (
            math.floor(pose[0] / cell),
            math.floor(pose[1] / cell),
            round(pose[2] / angle) % round(2.0 * math.pi / angle),
        )

    def _estimates(self, poses: Values) -> Values:
        way = self._way.at(*self._space.middles(poses))
        direct = self._moves.estimate(poses, self._goal, self._any_heading)
        return np.maximum(np.where(way < BLOCKED, way, np.inf), direct)

    def _push(
        self, poses: Values, costs: Values, directions: Values, left: Values, parents: list[tuple[int, int]]
    ) -> None:
        for pose, cost, direction, rest, parent in zip(
            poses.tolist(), costs.tolist(), directions.tolist(), left.tolist(), parents, strict=True
        ):
            key = self._key(pose)
            if math.isinf(rest) or cost >= self._best.get(key, math.inf):
                continue
            self._best[key] = cost
            node = len(self._poses)
            self._poses.append(pose)
            self._costs.append(cost)
            self._directions.append(direction)
            self._parents.append(parent)
            self._left.append(rest)
            heapq.heappush(self._open, (cost + rest, rest, node))

    def _expand(self, batch: list[int]) -> None:
        moves, keep = self._moves, self._space.keep
        poses = np.array([self._poses[node] for node in batch])
        along = _placed(poses, moves.steps)
        clearance = self._space.clearance(along)
        is_free = (clearance >= self._least).all(axis=2)
        near = np.clip(1.0 - (clearance - keep.least) / keep.room, 0.0, 1.0)
        cost = moves.lengths * (1.0 + _NEAR_WEIGHT * (near * near).mean(axis=2))
        before = np.array([self._directions[node] for node in batch])[:, None]
        cost += moves.cusp * (before * moves.directions < 0.0)
        cost += np.array([self._costs[node] for node in batch])[:, None]
        parent, step = np.nonzero(is_free)
        if not len(parent):
            return
        ends, costs = along[parent, step, -1], cost[parent, step]
        parents = [(batch[p], s) for p, s in zip(parent.tolist(), step.tolist(), strict=True)]
        self._push(ends, costs, moves.directions[step], self._estimates(ends), parents)

    def _way_to(self, node: int) -> Values:
        """All poses from the start to a state."""
        pieces = []
        while self._parents[node][0] >= 0:
            parent, step = self._parents[node]
            pieces.append(_placed(np.array([self._poses[parent]]), self._moves.steps[step : step + 1])[0, 0])
            node = parent
        pieces.append(np.array([self._poses[node]]))
        return np.concatenate(pieces[::-1])

    def _shot(
        self, start: PlanarPose, before: float, direction: float, most: float = math.inf
    ) -> tuple[Values | None, float]:
        """The best free direct way from a state to the goal, and the cost of the whole path, below `most`."""
        best, cost = None, most - before
        for poses in self._moves.connections(start, self._goal, self._any_heading, cost):
            total = self._cost(poses, direction)
            if total < cost:
                best, cost = poses, total
                break  # the next ones are longer
        return best, before + cost

    def _cost(self, poses: Values, direction: float = 0.0) -> float:
        """The cost of a way, infinite if it is not free; `direction` is that before it."""
        if len(poses) > 16 and not (self._space.clearance(poses[::8]) >= self._least).all():
            return math.inf
        clearance = self._space.clearance(poses)
        if not (clearance >= self._least).all():
            return math.inf
        keep = self._space.keep
        near = np.clip(1.0 - (clearance[1:] - keep.least) / keep.room, 0.0, 1.0)
        costs, directions = self._moves.costs(poses)
        changes = np.diff(np.concatenate([[direction], directions]))
        cusps = int((np.abs(changes) > 1.5).sum())
        return float((costs * (1.0 + _NEAR_WEIGHT * near * near)).sum()) + cusps * self._moves.cusp

    def shortened(self, poses: Values) -> Values:
        """The path with parts replaced by direct connections that cost less."""
        share = 1.0
        while share > 0.05:
            at = 0.0
            while at < 1.0 - 1e-9:
                costs, _ = self._moves.costs(poses)
                along = np.concatenate([[0.0], np.cumsum(costs)])
                first = int(np.searchsorted(along, at * along[-1]))
                last = min(int(np.searchsorted(along, (at + share) * along[-1])), len(poses) - 1)
                poses = self._replaced(poses, first, last)
                at += share / 2.0
            share /= 2.0
        return poses

    def _replaced(self, poses: Values, first: int, last: int) -> Values:
        if last - first < 2:
            return poses
        is_end = last == len(poses) - 1
        start, end = PlanarPose(*poses[first]), self._goal if is_end else PlanarPose(*poses[last])
        now = self._cost(poses[max(first - 1, 0) : last + 2])
        part = float(self._moves.costs(poses[first : last + 1])[0].sum())
        most = min(now, part * (1.0 + _NEAR_WEIGHT) + 2.0 * self._moves.cusp)
        for way in self._moves.connections(start, end, is_end and self._any_heading, most):
            whole = np.concatenate([poses[max(first - 1, 0) : first], way, poses[last + 1 : last + 2]])
            if self._cost(whole) < now - 1e-3:
                return np.concatenate([poses[:first], way, poses[last + 1 :]])
        return poses


def _placed(poses: Values, steps: Values) -> Values:
    """Steps (m, k, 3) in the frames of poses (n, 3), as poses (n, m, k, 3) of the outer frame."""
    x, y, yaw = (poses[:, column, None, None] for column in range(3))
    cos, sin = np.cos(yaw), np.sin(yaw)
    ahead, left, turn = steps[..., 0], steps[..., 1], steps[..., 2]
    return np.stack([x + cos * ahead - sin * left, y + sin * ahead + cos * left, yaw + turn], axis=-1)
