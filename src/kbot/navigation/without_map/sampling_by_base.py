"""The trajectory sampling of each kind of base. It differs for bases that drive sideways, and that steer."""

from __future__ import annotations

import math
from itertools import product

import numpy as np

from kbot.kinematics.planar_pose import PlanarPose, PlanarTwist
from kbot.navigation.simulated.motion_limits import MotionLimits
from kbot.navigation.space.footprint_clearance import FootprintClearance
from kbot.navigation.without_map.trajectory_sampling import (
    SamplingSettings,
    TrajectorySampling,
    Values,
    accumulated,
    limited,
)

_STEERED_REVERSE = 0.5
"""Share of the highest speed with which a base that must reverse to turn around does so."""
_STANDING = 0.02
"""m/s. The curvature of a base that is slower is that of the last command."""


class HolonomicSampling(TrajectorySampling):
    """Samples the speeds forwards and to the left and the turn of a base that drives sideways.

    The nose does not count, so that the heading is free."""

    def __init__(
        self, footprint: FootprintClearance, limits: MotionLimits, settings: SamplingSettings, seed: int = 0
    ) -> None:
        super().__init__(footprint, limits, settings, seed)
        self._nose = 0.0

    def _ranges(self) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
        (x, yaw), (fastest, turn), (x_std, yaw_std) = super()._ranges()
        side = self.limits.lateral
        return (x, yaw, -side), (fastest, turn, side), (x_std, yaw_std, self.settings.vx_std)

    def _constant_arcs(self) -> Values:
        forward, turn, side = self._high.tolist()
        back = float(self._low[0])
        ways = [(forward, 0.0), (forward, side), (0.0, side), (back, side), (back, 0.0), (0.0, 0.0)]
        ways += [(x, -y) for x, y in ways if y]
        arcs = [
            (x * v, turn * w, y * v)
            for (x, y), v, w in product(ways, (0.1, 0.3, 1.0), (-0.25, 0.0, 0.25))
            if x or y or v == 1.0
        ]
        return np.array(arcs, dtype=np.float32).T[:, None].repeat(self.settings.time_steps, axis=1)

    def _held(self, command: tuple[float, float]) -> Values:
        return np.array((*command, 0.0), dtype=np.float32)

    def _command(
        self, mean: Values, twist: PlanarTwist, period: float, commanded: tuple[float, float]
    ) -> tuple[float, float]:
        limits = self.limits
        before = np.array((*commanded, self.lateral))
        change = period * np.array([limits.acceleration, limits.angular_acceleration, limits.acceleration])
        x, yaw, y = (before + np.clip(mean[:, 0] - before, -change, change)).tolist()
        # the highest speed holds in every direction
        share = min(1.0, limits.linear / max(math.hypot(x, y), 1e-9))
        self.lateral = y * share
        return x * share, yaw

    def restart(self) -> None:
        super().restart()
        self.lateral = 0.0

    def _rollout(
        self, commands: Values, pose: PlanarPose, twist: PlanarTwist
    ) -> tuple[Values, Values, Values, Values, Values]:
        step, limits = np.float32(self.settings.model_dt), self.limits
        change = float(step) * limits.acceleration
        v, u = limited(commands[0], twist.x, change), limited(commands[2], twist.y, change)
        speed = np.hypot(v, u)
        share = np.minimum(np.float32(1.0), np.float32(limits.linear) / np.maximum(speed, np.float32(1e-6)))
        v, u, speed = v * share, u * share, speed * share
        w = limited(commands[1], twist.yaw, float(step) * limits.angular_acceleration)
        turned = accumulated(w, step, pose.yaw)
        middle = turned - w * (step / 2)
        cos, sin = np.cos(middle), np.sin(middle)
        x, y = v * cos - u * sin, v * sin + u * cos
        return accumulated(x, step, pose.x), accumulated(y, step, pose.y), turned, speed, w


class SteeredSampling(TrajectorySampling):
    """Samples the speed and the curvature of a base with a least turning radius.

    The pose is that of the middle of its fixed axle. The wheels steer steadily from one limit to the
    other."""

    def __init__(
        self, footprint: FootprintClearance, limits: MotionLimits, settings: SamplingSettings, seed: int = 0
    ) -> None:
        super().__init__(footprint, limits, settings, seed)
        self._curvature = 0.0

    def _ranges(self) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
        limits, settings = self.limits, self.settings
        low = -_STEERED_REVERSE * limits.linear, -limits.curvature
        return low, (limits.linear, limits.curvature), (settings.vx_std, 0.5)

    def _constant_arcs(self) -> Values:
        forward, curvature = self._high.tolist()
        back = float(self._low[0])
        ways = product((back, 0.4 * back, 0.1 * forward, 0.4 * forward, forward), (-1.0, -0.4, 0.0, 0.4, 1.0))
        arcs = [(0.0, 0.0), *((v, share * curvature) for v, share in ways)]
        return np.array(arcs, dtype=np.float32).T[:, None].repeat(self.settings.time_steps, axis=1)

    def _held(self, command: tuple[float, float]) -> Values:
        v, w = command
        curvature = w / v if v else 0.0
        return np.array((v, min(max(curvature, -self.limits.curvature), self.limits.curvature)), np.float32)

    def _command(
        self, mean: Values, twist: PlanarTwist, period: float, commanded: tuple[float, float]
    ) -> tuple[float, float]:
        limits = self.limits
        change = period * limits.acceleration
        v = commanded[0] + min(max(float(mean[0, 0]) - commanded[0], -change), change)
        # the wheels are sent to where the trajectory has them after the time in which they can get there
        self._curvature = float(mean[1, 0])
        most = float(self._sharpest(np.array([v], dtype=np.float32))[0])
        return v, v * min(max(self._curvature, -most), most)

    def restart(self) -> None:
        super().restart()
        self._curvature = 0.0

    def _sharpest(self, speed: Values) -> Values:
        """The largest curvature in 1/m at a speed, within the limits of turns."""
        limits = self.limits
        fast = np.maximum(np.abs(speed), np.float32(1e-3))
        return np.minimum(
            np.float32(limits.curvature),
            np.minimum(np.float32(limits.angular) / fast, np.float32(limits.curve_acceleration) / fast**2),
        )

    def _rollout(
        self, commands: Values, pose: PlanarPose, twist: PlanarTwist
    ) -> tuple[Values, Values, Values, Values, Values]:
        step, limits = np.float32(self.settings.model_dt), self.limits
        v = limited(commands[0], twist.x, float(step) * limits.acceleration)
        now = twist.yaw / twist.x if abs(twist.x) > _STANDING else self._curvature
        now = min(max(now, -limits.curvature), limits.curvature)
        steers = 2.0 * limits.curvature / limits.steering_time
        curvature = limited(commands[1], now, float(step) * steers)
        most = self._sharpest(v)
        np.minimum(curvature, most, out=curvature)
        np.maximum(curvature, -most, out=curvature)
        w = v * curvature
        turned = accumulated(w, step, pose.yaw)
        middle = turned - w * (step / 2)
        x, y = v * np.cos(middle), v * np.sin(middle)
        return accumulated(x, step, pose.x), accumulated(y, step, pose.y), turned, v, w


def sampling_for(
    footprint: FootprintClearance, limits: MotionLimits, settings: SamplingSettings, seed: int
) -> TrajectorySampling:
    """The sampling for a base with these limits."""
    if limits.lateral > 0.0:
        return HolonomicSampling(footprint, limits, settings, seed)
    if math.isfinite(limits.curvature):
        return SteeredSampling(footprint, limits, settings, seed)
    return TrajectorySampling(footprint, limits, settings, seed)
