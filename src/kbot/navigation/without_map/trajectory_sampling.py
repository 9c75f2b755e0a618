"""A controller that samples trajectories and averages the good ones: model predictive path integral control.

MPPI (Williams et al. 2017, "Information theoretic MPC for model-based reinforcement learning") is chosen
because each tick is a few numpy operations on all samples at once, and because its cost may be anything that
can be looked up: the clearance of the true outline, and the cost-to-go, which is not smooth at the corners of
obstacles. The timed elastic band needs a sparse solver and one band for each side of an obstacle. The dynamic
window approach holds one arc over its whole horizon, and therefore stops where a way out of a gap needs two
arcs. Its arcs are among the samples here, so that a bad average of the last tick does not matter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.planar_pose import PlanarPose, PlanarTwist
from kbot.navigation.perception.moving_obstacles import MovingObstacle
from kbot.navigation.simulated.motion_limits import MotionLimits
from kbot.navigation.space.cost_to_go import CostToGo
from kbot.navigation.space.distance_field import DistanceField
from kbot.navigation.space.footprint_clearance import FootprintClearance

Values = NDArray[np.float32]
"""Samples are arrays (steps, samples) of short floating-point numbers: numpy is fastest on long rows and half
the bytes. The rounding of 1e-7 is far below a cell."""

_COLLISION = 100.0
"""Cost in m of a sample that touches an obstacle. It is above every other cost."""
_MOVING_COLLISION = 20.0
"""Cost in m of a sample that a moving obstacle hits at once while the robot stands, and twice as much at full
speed. It is above the cost of any way round."""
_MOVING_MARGIN, _MOVING_ROOM = 0.08, 0.4
"""m between the outline and a moving obstacle: less is a hit, and more than the sum costs nothing."""
_REACTION = 2
"""Steps in which the robot still goes on if it brakes from the next tick on: a tick, and the lag of its
drive."""


@dataclass(frozen=True, slots=True)
class SamplingSettings:
    """What MPPI samples, with the names of Nav2's MPPI controller where it has one.

    batch_size      samples per tick
    time_steps      steps of a sample
    model_dt        seconds per step
    temperature     m; samples that are longer than the best by this count a third of it
    vx_std, wz_std  standard deviation of the samples, as shares of the highest speeds
    knots           random speeds per sample, with speeds interpolated between them
    margin          m between outline and obstacle that no sample may fall below
    room            m beyond the margin within which fast samples cost more
    room_weight     cost of a sample that is at an obstacle at full speed, as a multiple of the way that it
                    drives; the cost grows with the square of the speed, so that the robot slows down in gaps
    reverse_weight  m that a sample costs which drives backwards at full speed
    reverse         share of the highest speed with which the robot may drive backwards
    """

    batch_size: int = 200
    time_steps: int = 20
    model_dt: float = 0.1
    temperature: float = 0.08
    vx_std: float = 0.3
    wz_std: float = 0.3
    knots: int = 6
    margin: float = 0.03
    room: float = 0.35
    room_weight: float = 2.5
    reverse_weight: float = 3.0
    reverse: float = 0.3


class TrajectorySampling:
    """Chooses speeds that bring the robot nearer to the goal, within its limits and without a collision.

    `is_blocked` is whether every sample of the last tick collides. The robot is then stopped."""

    def __init__(
        self,
        footprint: FootprintClearance,
        limits: MotionLimits,
        settings: SamplingSettings = SamplingSettings(),
        seed: int = 0,
    ) -> None:
        self.limits, self.settings = limits, settings
        self._footprint = footprint
        self._random = np.random.default_rng(seed)
        self._blend = _interpolation(settings.knots, settings.time_steps)
        low, high, spread = self._ranges()
        self._low, self._high = np.array(low, dtype=np.float32), np.array(high, dtype=np.float32)
        self._spread = (self._high * spread).astype(np.float32)
        self._mean: Values = np.zeros((len(low), settings.time_steps), dtype=np.float32)
        self._arcs = self._constant_arcs()
        self._nose = footprint.outer
        """m ahead of the base at which the cost-to-go is read, so that the heading counts as well."""
        self.is_blocked = False
        self.lateral = 0.0
        """m/s to the left that go with the speeds of the last update; 0 for a base that cannot."""
        self._moving: Sequence[MovingObstacle] = ()

    def _ranges(self) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
        """The lowest and highest values of what is sampled, and the standard deviations as shares of the
        highest: of the forward speed and of the turn."""
        limits, settings = self.limits, self.settings
        low, high = (-settings.reverse * limits.linear, -limits.angular), (limits.linear, limits.angular)
        return low, high, (settings.vx_std, settings.wz_std)

    def restart(self) -> None:
        """Forget the trajectory of the last tick, because the robot was stopped or driven otherwise."""
        self._mean[:] = 0.0

    def update(
        self,
        pose: PlanarPose,
        twist: PlanarTwist,
        field: DistanceField,
        cost_to_go: CostToGo,
        period: float,
        commanded: tuple[float, float] = (0.0, 0.0),
        moving: Sequence[MovingObstacle] = (),
    ) -> tuple[float, float]:
        """The speeds (m/s, rad/s) to command for the next `period` in s, after those last `commanded`."""
        self._moving = moving
        self._advance(period)
        commands = self._samples()
        least = self._least_clearance(pose, field)
        costs, collides = self._costs(commands, pose, twist, field, cost_to_go, least)
        best = int(costs.argmin())
        share = np.exp((costs[best] - costs) / self.settings.temperature)
        share /= share.sum()
        mean = commands @ share
        mean_cost, mean_collides = self._costs(mean[..., None], pose, twist, field, cost_to_go, least)
        # the mean of samples that pass an obstacle on both sides would lead into it
        if mean_collides[0] or mean_cost[0] > costs[best] + self.settings.temperature:
            mean = commands[..., best].copy()
        self.is_blocked = bool(collides[best] and mean_collides[0])
        if self.is_blocked:
            self.restart()
            return 0.0, 0.0
        self._mean = mean
        if moving and self._must_brake(mean, pose, twist):
            mean = np.zeros_like(mean)
        return self._command(mean, twist, period, commanded)

    def _command(
        self, mean: Values, twist: PlanarTwist, period: float, commanded: tuple[float, float]
    ) -> tuple[float, float]:
        """The speeds to command for a trajectory."""
        # in steps that the tyres hold: wheels that slip measure a wrong distance
        change = period * np.array([self.limits.acceleration, self.limits.angular_acceleration])
        v, w = (commanded + np.clip(mean[:, 0] - commanded, -change, change)).tolist()
        fastest = float(self.limits.turn_at(np.array([twist.x]))[0])
        return v, min(max(w, -fastest), fastest)

    def is_free(
        self, pose: PlanarPose, twist: PlanarTwist, command: tuple[float, float], field: DistanceField
    ) -> bool:
        """Whether the robot may hold a command for a second."""
        steps = max(1, round(1.0 / self.settings.model_dt))
        held = self._held(command)[:, None, None]
        x, y, yaw, _, _ = self._rollout(held.repeat(steps, axis=1), pose, twist)
        clearance = self._footprint.of(field, x, y, yaw)
        return bool((clearance >= self._least_clearance(pose, field)).all())

    def _held(self, command: tuple[float, float]) -> Values:
        """What is sampled, for a command of m/s and rad/s."""
        return np.array(command, dtype=np.float32)

    def _advance(self, period: float) -> None:
        """Shift the last trajectory by the time that has passed."""
        steps = np.arange(self._mean.shape[1])
        for row in self._mean:
            row[:] = np.interp(steps + period / self.settings.model_dt, steps, row)

    def _samples(self) -> Values:
        """Speeds (2 or 3, steps, samples): the last trajectory, arcs, and random changes of the last
        trajectory."""
        settings = self.settings
        arcs = self._arcs.shape[2]
        count = settings.batch_size - arcs - 1
        rows = len(self._high)
        drawn = self._random.standard_normal((rows, settings.knots, count), dtype=np.float32)
        drawn *= self._spread[:, None, None]
        # two thirds stay near the last trajectory, to refine it: in a narrow gap, all others collide
        drawn[..., : count // 3] *= np.float32(0.1)
        drawn[..., count // 3 : 2 * count // 3] *= np.float32(0.3)
        samples = np.empty((rows, settings.time_steps, settings.batch_size), dtype=np.float32)
        samples[..., 0] = self._mean
        samples[..., 1 : 1 + arcs] = self._arcs
        changed = samples[..., 1 + arcs :]
        np.matmul(self._blend, drawn, out=changed)
        changed += self._mean[..., None]
        for speeds, low, high in zip(samples, self._low, self._high, strict=True):
            np.minimum(speeds, high, out=speeds)
            np.maximum(speeds, low, out=speeds)
        return samples

    def _constant_arcs(self) -> Values:
        forward, turn = self._high.tolist()
        back = float(self._low[0])
        arcs = [(0.0, 0.0), (back, 0.0), (0.5 * back, 0.0)]
        arcs += [(0.0, turn * share) for share in (-0.5, -0.25, 0.25, 0.5)]
        shares = (-0.5, -0.25, -0.1, 0.0, 0.1, 0.25, 0.5)
        arcs += [(forward * v, turn * w) for v, w in product((0.1, 0.3, 1.0), shares)]
        return np.array(arcs, dtype=np.float32).T[:, None].repeat(self.settings.time_steps, axis=1)

    def _rollout(
        self, commands: Values, pose: PlanarPose, twist: PlanarTwist
    ) -> tuple[Values, Values, Values, Values, Values]:
        """Positions, headings and speeds (steps, samples) if the speeds follow the commands within the
        accelerations."""
        step, limits = np.float32(self.settings.model_dt), self.limits
        v = limited(commands[0], twist.x, float(step) * limits.acceleration)
        before = np.concatenate([np.full_like(v[:1], twist.x), v[:-1]])
        fastest = limits.turn_at(before)
        turn = np.minimum(commands[1], fastest)
        np.maximum(turn, -fastest, out=turn)
        w = limited(turn, twist.yaw, float(step) * limits.angular_acceleration)
        turned = accumulated(w, step, pose.yaw)
        middle = turned - w * (step / 2)
        cos, sin = np.cos(middle), np.sin(middle)
        x, y = v * cos, v * sin
        if limits.drift:
            across = v * np.float32(-limits.drift)
            across -= np.float32(limits.centre)
            across *= w
            x -= across * sin
            y += across * cos
        return accumulated(x, step, pose.x), accumulated(y, step, pose.y), turned, v, w

    def _least_clearance(self, pose: PlanarPose, field: DistanceField) -> float:
        """The clearance in m that no pose may fall below. A robot that is nearer may only move away."""
        x, y, yaw = (np.array([value], dtype=np.float32) for value in (pose.x, pose.y, pose.yaw))
        now = float(self._footprint.of(field, x, y, yaw)[0])
        return min(self.settings.margin, now - 1e-6)

    def _costs(
        self,
        commands: Values,
        pose: PlanarPose,
        twist: PlanarTwist,
        field: DistanceField,
        cost_to_go: CostToGo,
        least: float,
    ) -> tuple[Values, NDArray[np.bool_]]:
        """The costs in m of the samples, and which of them collide: come nearer to an obstacle than
        `least`."""
        settings, fastest = self.settings, self.limits.linear
        x, y, yaw, v, w = self._rollout(commands, pose, twist)
        steps = len(x)
        clearance = self._footprint.of(field, x, y, yaw)
        hits = clearance < least
        collides: NDArray[np.bool_] = np.logical_or.reduce(hits, axis=0)
        # 1 within the margin, 0 from `room` beyond it
        near = np.subtract(settings.margin + settings.room, clearance, out=clearance)
        near *= np.float32(1.0 / settings.room)
        np.maximum(near, 0.0, out=near)
        np.minimum(near, 1.0, out=near)
        near *= near
        corner = w * np.float32(self._footprint.outer)
        corner *= corner
        corner += v * v
        near *= corner
        furthest = fastest * settings.time_steps * settings.model_dt
        cost = near.sum(axis=0)
        cost *= settings.room_weight * furthest / (steps * fastest**2)
        backwards = np.minimum(v, 0.0).sum(axis=0)
        cost -= backwards * (settings.reverse_weight / (steps * fastest))
        # the end counts, and half of it early progress, so that the robot does not wait
        half, nose = steps // 2, np.float32(self._nose)
        at_x = np.concatenate([x[half], x[-1], x[-1] + nose * np.cos(yaw[-1])])
        at_y = np.concatenate([y[half], y[-1], y[-1] + nose * np.sin(yaw[-1])])
        cost += 0.5 * cost_to_go.at(at_x, at_y).reshape(3, -1).sum(axis=0)
        for obstacle in self._moving:
            cost += self._cost_of(obstacle, x, y, yaw, v)
        if collides.any():
            first = hits.argmax(axis=0) / steps
            cost += np.where(collides, _COLLISION * (2.0 - first), 0.0)
        return cost, collides

    def _cost_of(self, obstacle: MovingObstacle, x: Values, y: Values, yaw: Values, v: Values) -> Values:
        """The cost in m of coming near to an obstacle that keeps its velocity: the earlier and the faster,
        the more. It does not exclude a sample, because a robot that cannot evade an obstacle should still
        slow down."""
        steps = len(x)
        times = self._times(steps)
        east = np.float32(obstacle.x) + np.float32(obstacle.vx) * times - x
        north = np.float32(obstacle.y) + np.float32(obstacle.vy) * times - y
        gap = self._gap(east, north, yaw) - np.float32(obstacle.radius)
        hits = gap < _MOVING_MARGIN
        near = np.clip(1.0 - (gap - _MOVING_MARGIN) / _MOVING_ROOM, 0.0, 1.0)
        cost: Values = (near * near).mean(axis=0)
        if hits.any():
            first = hits.argmax(axis=0)
            speed = np.abs(v[first, np.arange(v.shape[1])]) / self.limits.linear
            cost += hits.any(axis=0) * _MOVING_COLLISION * (1.0 - first / steps) * (1.0 + speed)
        return cost.astype(np.float32)

    def _must_brake(self, mean: Values, pose: PlanarPose, twist: PlanarTwist) -> bool:
        """Whether the robot must brake now to stand before it meets a moving obstacle, which may go on, stop
        or turn back.

        This is passive motion safety (Bouraine, Fraichard and Salhi 2012, "Provably safe navigation for
        mobile robots with limited field-of-views in dynamic environments"). A robot that drives away from an
        obstacle need not brake. If an obstacle would hit the robot where it stops, braking does not help, and
        the samples find a way round."""
        commands = np.zeros((*mean.shape, 2), dtype=np.float32)
        commands[:, :_REACTION, 1] = mean[:, :_REACTION]  # the first sample brakes now
        x, y, yaw, _, _ = self._rollout(commands, pose, twist)
        moved_x, moved_y = np.diff(x, axis=0, prepend=x[:1]), np.diff(y, axis=0, prepend=y[:1])
        times = self._times(len(x))
        must_brake = False
        for obstacle in self._moving:
            vx, vy = obstacle.vx, obstacle.vy
            east, north = obstacle.x - x, obstacle.y - y
            gap = self._gap(east + vx * times, north + vy * times, yaw)
            if (gap[:, 0] < obstacle.radius).any():
                return False
            # the nearest of the places that it can reach
            passed: Values = np.clip(-(east * vx + north * vy) / (vx * vx + vy * vy), -times, times)
            east, north = east + vx * passed, north + vy * passed
            hits = self._gap(east, north, yaw) < obstacle.radius + _MOVING_MARGIN
            must_brake |= bool((hits & (moved_x * east + moved_y * north > 0.0))[:, 1].any())
        return must_brake

    def _times(self, steps: int) -> Values:
        """The times (steps, 1) in s after each step."""
        return (np.arange(1, steps + 1, dtype=np.float32) * np.float32(self.settings.model_dt))[:, None]

    def _gap(self, east: Values, north: Values, yaw: Values) -> Values:
        """The distance in m of the box around the outline from points that are so far from the base."""
        cos, sin = np.cos(yaw), np.sin(yaw)
        low, high = (corner.astype(np.float32) for corner in self._footprint.box)
        middle, half = (low + high) / 2, (high - low) / 2
        ahead = np.abs(cos * east + sin * north - middle[0]) - half[0]
        aside = np.abs(cos * north - sin * east - middle[1]) - half[1]
        gap: Values = np.hypot(np.maximum(ahead, 0.0), np.maximum(aside, 0.0))
        return gap


def limited(targets: Values, start: float, change: float) -> Values:
    """Speeds (steps, samples) that follow the targets from `start` with at most `change` per step."""
    speeds, most = np.empty_like(targets), np.float32(change)
    lowest, highest = np.full_like(targets[0], start), np.empty_like(targets[0])
    before = lowest.copy()
    for speed, target in zip(speeds, targets, strict=True):
        np.subtract(before, most, out=lowest)
        np.add(before, most, out=highest)
        np.maximum(target, lowest, out=speed)
        np.minimum(speed, highest, out=speed)
        before = speed
    return speeds


def accumulated(rates: Values, step: np.float32, start: float) -> Values:
    """The values (steps, samples) after each step of some seconds, with rates of change per second."""
    values: Values = rates.cumsum(axis=0)
    values *= step
    values += np.float32(start)
    return values


def _interpolation(knots: int, steps: int) -> Values:
    """A matrix (steps, knots) that interpolates linearly from knots to steps."""
    at = np.linspace(0.0, knots - 1.0, steps)
    return np.maximum(0.0, 1.0 - np.abs(at[:, None] - np.arange(knots))).astype(np.float32)
