"""A controller that samples trajectories and averages the good ones: model predictive path integral control.

MPPI (Williams et al. 2017, "Information theoretic MPC for model-based reinforcement learning") is chosen
because each tick is a few numpy operations on all samples at once, and because its cost may be anything that
can be looked up: the clearance of the true outline, and the cost-to-go, which is not smooth at the corners of
obstacles. The timed elastic band needs a sparse solver and one band for each side of an obstacle. The dynamic
window approach holds one arc over its whole horizon, and therefore stops where a way out of a gap needs two
arcs. Its arcs are among the samples here, so that a bad average of the last tick does not matter.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.planar_pose import PlanarPose, PlanarTwist
from kbot.navigation.local.cost_to_go import CostToGo
from kbot.navigation.local.distance_field import DistanceField
from kbot.navigation.local.footprint_clearance import FootprintClearance
from kbot.navigation.local.motion_limits import MotionLimits

Values = NDArray[np.float64]

_COLLISION = 100.0
"""Cost in m of a sample that touches an obstacle. It is above every other cost."""


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
        self._mean = np.zeros((settings.time_steps, 2))
        self._blend = _interpolation(settings.knots, settings.time_steps)
        self._low = np.array([-settings.reverse * limits.linear, -limits.angular])
        self._high = np.array([limits.linear, limits.angular])
        self._arcs = self._constant_arcs()
        self._nose = footprint.outer
        """m ahead of the base at which the cost-to-go is read, so that the heading counts as well."""
        self.is_blocked = False

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
    ) -> tuple[float, float]:
        """The speeds (m/s, rad/s) to command for the next `period` in s, after those last `commanded`."""
        self._advance(period)
        commands = self._samples()
        least = self._least_clearance(pose, field)
        costs, collides = self._costs(commands, pose, twist, field, cost_to_go, least)
        best = int(costs.argmin())
        share = np.exp((costs[best] - costs) / self.settings.temperature)
        mean = np.tensordot(share / share.sum(), commands, axes=1)
        mean_cost, mean_collides = self._costs(mean[None], pose, twist, field, cost_to_go, least)
        # the mean of samples that pass an obstacle on both sides would lead into it
        if mean_collides[0] or mean_cost[0] > costs[best] + self.settings.temperature:
            mean = commands[best].copy()
        self.is_blocked = bool(collides[best] and mean_collides[0])
        if self.is_blocked:
            self.restart()
            return 0.0, 0.0
        self._mean = mean
        # in steps that the tyres hold: wheels that slip measure a wrong distance
        change = period * np.array([self.limits.acceleration, self.limits.angular_acceleration])
        v, w = (commanded + np.clip(mean[0] - commanded, -change, change)).tolist()
        fastest = float(self.limits.turn_at(np.array([twist.x]))[0])
        return v, min(max(w, -fastest), fastest)

    def is_free(
        self, pose: PlanarPose, twist: PlanarTwist, command: tuple[float, float], field: DistanceField
    ) -> bool:
        """Whether the robot may hold a command for a second."""
        steps = max(1, round(1.0 / self.settings.model_dt))
        x, y, yaw, _ = self._rollout(np.tile(np.array(command), (1, steps, 1)), pose, twist)
        clearance = self._footprint.of(field, x, y, yaw)
        return bool((clearance >= self._least_clearance(pose, field)).all())

    def _advance(self, period: float) -> None:
        """Shift the last trajectory by the time that has passed."""
        times = np.arange(len(self._mean)) + period / self.settings.model_dt
        for column in range(2):
            self._mean[:, column] = np.interp(times, np.arange(len(self._mean)), self._mean[:, column])

    def _samples(self) -> Values:
        """Speeds (samples, steps, 2): the last trajectory, arcs, and random changes of the last
        trajectory."""
        settings = self.settings
        count = settings.batch_size - len(self._arcs) - 1
        spread = np.array([settings.vx_std, settings.wz_std]) * (self._high[0], self._high[1])
        drawn = self._random.standard_normal((count, settings.knots, 2)) * spread
        # two thirds stay near the last trajectory, to refine it: in a narrow gap, all others collide
        drawn[: count // 3] *= 0.1
        drawn[count // 3 : 2 * count // 3] *= 0.3
        changed = self._mean + (drawn.transpose(0, 2, 1) @ self._blend.T).transpose(0, 2, 1)
        samples = np.concatenate([self._mean[None], self._arcs, changed])
        clipped: Values = np.clip(samples, self._low, self._high)
        return clipped

    def _constant_arcs(self) -> Values:
        forward, turn = self._high
        arcs = [(0.0, 0.0), (self._low[0], 0.0), (0.5 * self._low[0], 0.0)]
        arcs += [(0.0, turn * share) for share in (-0.5, -0.25, 0.25, 0.5)]
        shares = (-0.5, -0.25, -0.1, 0.0, 0.1, 0.25, 0.5)
        arcs += [(forward * v, turn * w) for v, w in product((0.1, 0.3, 1.0), shares)]
        return np.repeat(np.array(arcs)[:, None], self.settings.time_steps, axis=1)

    def _rollout(
        self, commands: Values, pose: PlanarPose, twist: PlanarTwist
    ) -> tuple[Values, Values, Values, Values]:
        """Positions, headings and speeds (samples, steps) if the speeds follow the commands within the
        accelerations."""
        step, limits = self.settings.model_dt, self.limits
        faster, turning = step * limits.acceleration, step * limits.angular_acceleration
        # steps first, because numpy is fastest on contiguous rows
        targets = np.ascontiguousarray(commands.transpose(2, 1, 0))
        speeds = np.empty_like(targets)
        v = np.full(len(commands), twist.x)
        w = np.full(len(commands), twist.yaw)
        for at, (target, turn) in enumerate(zip(*targets, strict=True)):
            fastest = limits.turn_at(v)
            np.minimum(turn, fastest, out=turn)
            np.maximum(turn, -fastest, out=turn)
            v = np.minimum(np.maximum(target, v - faster), v + faster)
            w = np.minimum(np.maximum(turn, w - turning), w + turning)
            speeds[0, at], speeds[1, at] = v, w
        speeds = speeds.transpose(2, 1, 0)
        v, w = speeds[..., 0], speeds[..., 1]
        turned = np.cumsum(w, axis=1) * step
        middle = pose.yaw + turned - w * (step / 2.0)
        cos, sin, across = np.cos(middle), np.sin(middle), -limits.drift * v * w
        x = pose.x + np.cumsum(v * cos - across * sin, axis=1) * step
        y = pose.y + np.cumsum(v * sin + across * cos, axis=1) * step
        return x, y, pose.yaw + turned, speeds

    def _least_clearance(self, pose: PlanarPose, field: DistanceField) -> float:
        """The clearance in m that no pose may fall below. A robot that is nearer may only move away."""
        x, y, yaw = (np.array([value]) for value in (pose.x, pose.y, pose.yaw))
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
        settings = self.settings
        x, y, yaw, speeds = self._rollout(commands, pose, twist)
        clearance = self._footprint.of(field, x, y, yaw)
        hits = clearance < least
        collides: NDArray[np.bool_] = np.logical_or.reduce(hits, axis=1)
        first = np.where(collides, hits.argmax(axis=1), hits.shape[1])
        near = np.clip(1.0 - (clearance - settings.margin) / settings.room, 0.0, 1.0)
        v, corner = speeds[..., 0], self._footprint.outer * speeds[..., 1]
        furthest = self.limits.linear * settings.time_steps * settings.model_dt
        cost = settings.room_weight * furthest * (near * near * (v * v + corner * corner)).mean(axis=1)
        cost /= self.limits.linear**2
        cost += settings.reverse_weight * (np.clip(-v, 0.0, None) / self.limits.linear).mean(axis=1)
        # the end counts, and half of it early progress, so that the robot does not wait
        at = np.array([commands.shape[1] // 2, commands.shape[1] - 1])
        ahead = cost_to_go.at(x[:, at], y[:, at])
        nose = cost_to_go.at(
            x[:, -1] + self._nose * np.cos(yaw[:, -1]), y[:, -1] + self._nose * np.sin(yaw[:, -1])
        )
        cost += 0.5 * ahead[:, 0] + 0.5 * ahead[:, 1] + 0.5 * nose
        cost += np.where(collides, _COLLISION * (2.0 - first / hits.shape[1]), 0.0)
        return cost, collides


def _interpolation(knots: int, steps: int) -> Values:
    """A matrix (steps, knots) that interpolates linearly from knots to steps."""
    at = np.linspace(0.0, knots - 1.0, steps)
    return np.maximum(0.0, 1.0 - np.abs(at[:, None] - np.arange(knots)))
