"""Wheels that roll and may steer: the angle and the speed of each in a twist, and the twist from both.

A wheel at x, y rolls without slipping in a twist (v, u, w) if its middle moves along its rolling direction
(Siegwart, Introduction to Autonomous Mobile Robots, 3.2). Its steering axis moves with (v - w y, u + w x). If
the wheel is `trail` ahead of that axis, it points into the angle of this velocity plus asin(w trail / speed).
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace
from math import asin, atan2, copysign, cos, hypot, inf, pi, sin

import numpy as np

from kbot.kinematics.drive.wheels import Wheel, is_caster, movable_above
from kbot.kinematics.frames import FrameTree, unit_axis
from kbot.kinematics.transform import Transform
from kbot.model import Joint, JointType

UPRIGHT = 0.9
"""Least upward component of a steering axis, which may lean by up to 26 degrees."""
_LEVEL = 0.5
"""Largest upward component of the axis of a rocker, such as a swing arm."""
_NEARLY = 1e-3
"""rad by which a steering limit may miss the wanted angle: a limit of 90 degrees is often written as 1.57."""

Equation = tuple[float, float, float, float]
"""The factors of a twist's x, y and yaw, and the value of their sum."""


@dataclass(frozen=True, slots=True)
class WheelModule:
    """A wheel with its rolling axis and, if it steers, its steering axis.

    A direction is the angle in rad from the drive's x axis to the way in which the wheel rolls, positive to
    the left.

    rolls         the joint on which it rolls, or that of `steering` for a wheel without one
    steering      the joint that steers it, None for a wheel on a fixed axle
    x, y          position in m of its steering axis, or else of its middle, in the frame of the drive
    trail, aside  how far its middle is ahead and to the left of its steering axis, in m
    direction     at position 0 of `steering`
    upward        1.0 if a positive position of `steering` turns it to the left, else -1.0
    lower, upper  limits of the direction
    rate          the highest speed at which it steers in rad/s, infinite if the joint has no velocity limit
    radius        in m
    forward       the sign of the speed of `rolls` with which it rolls in its direction
    """

    rolls: str
    steering: str | None
    x: float
    y: float
    trail: float
    aside: float
    direction: float
    upward: float
    lower: float
    upper: float
    rate: float
    radius: float
    forward: float

    @property
    def slides(self) -> bool:
        """Whether the description has no joint on which the wheel rolls."""
        return self.rolls == self.steering

    @property
    def turns_everywhere(self) -> bool:
        """Whether the wheel can roll, forwards or backwards, in every direction."""
        return self.upper - self.lower >= pi - 2.0 * _NEARLY

    @property
    def curvatures(self) -> tuple[float, float]:
        """The curvatures (1/m) of the sharpest curves to the right and to the left in which the wheel rolls,
        while the drive's middle moves along x."""
        if self.steering is None or self.turns_everywhere:
            return -inf, inf
        right, left = (self.lower, self.upper) if self.x > 0.0 else (self.upper, self.lower)
        return -self._sharpest(right, -1.0), self._sharpest(left, 1.0)

    def _sharpest(self, end: float, side: float) -> float:
        """The largest curvature to the left (1.0) or right (-1.0) up to a limit of the direction.

        It is infinite if the middle of the curve reaches that of the drive before.
        """
        away = side if self.x > 0.0 else -side
        angle = min(max(end * away, 0.0), pi / 2.0) * away
        across = (self.x * cos(angle) + self.y * sin(angle) + self.trail) * away * side
        return abs(sin(angle)) / across if across > 0.0 else inf

    def scaled(self, along: float, across: float, size: float, rate: float) -> WheelModule:
        """The wheel of a controller that computes with other sizes, given as factors of the true ones, and
        steers at most at `rate` rad/s."""
        x, y, radius = self.x * along, self.y * across, self.radius * size
        return replace(self, x=x, y=y, radius=radius, rate=min(self.rate, rate))

    def steer(self, x: float, y: float, yaw: float, near: float) -> float:
        """The direction in which the wheel rolls in a twist without slipping.

        There are two, for rolling forwards and backwards. Of those within the limits, this is the nearest to
        `near`. A wheel that does not move stays at `near`.
        """
        ahead, left = x - yaw * self.y, y + yaw * self.x
        speed, across = hypot(ahead, left), yaw * self.trail
        if speed <= abs(across):
            return near
        moves, turned = atan2(left, ahead), asin(across / speed)
        directions = [
            angle + 2.0 * pi * (round((near - angle) / (2.0 * pi)) + turns)
            for angle in (moves + turned, moves + pi - turned)
            for turns in (-1, 0, 1)
        ]
        nearest = min(directions, key=lambda angle: (self._beyond(angle), abs(angle - near)))
        return min(max(nearest, self.lower), self.upper)

    def _beyond(self, direction: float) -> float:
        """How far a direction is beyond the limits, in rad."""
        return max(self.lower - direction - _NEARLY, direction - self.upper - _NEARLY, 0.0)

    def rim_speed(self, x: float, y: float, yaw: float, direction: float, rate: float) -> float:
        """The speed in m/s at which the wheel rolls in a twist while it steers at `rate` rad/s."""
        ahead, left = x - yaw * self.y, y + yaw * self.x
        return ahead * cos(direction) + left * sin(direction) - (yaw + rate) * self.aside

    def rolled(self, way: float, direction: float, turned: float) -> Equation:
        """The equation of the base's motion, if the wheel rolled `way` metres and steered by `turned` rad."""
        c, s = cos(direction), sin(direction)
        return c, s, self.x * s - self.y * c - self.aside, way + turned * self.aside

    def did_not_slide(self, direction: float, turned: float) -> Equation:
        """The equation of the base's motion, if the wheel did not move sideways while it steered."""
        c, s = cos(direction), sin(direction)
        return -s, c, self.x * c + self.y * s + self.trail, -turned * self.trail


def motion(equations: Iterable[Equation], *, sideways: bool) -> tuple[float, float, float]:
    """The motion forwards, leftwards and turning that fits the equations best (least squares)."""
    table = np.array([*equations])
    unknown = [0, 1, 2] if sideways else [0, 2]
    found = np.zeros(3)
    found[unknown] = np.linalg.lstsq(table[:, unknown], table[:, 3], rcond=None)[0]
    x, y, yaw = found.tolist()
    return x, y, yaw


def mount(
    tree: FrameTree, joint: Joint, commanded: Collection[str], motors: Collection[str]
) -> tuple[Joint | None, bool]:
    """The joint that steers the wheel on a joint, and whether the wheel belongs to the base.

    Above the wheel of a base there are only springs, rockers and at most one steering joint. `commanded` are
    joints that a plugin or controller turns to a position, and `motors` are joints with a motor.
    """
    if joint.name in motors:
        # a wheel that is driven and swivelled is not a caster, also if it is called so
        commanded = {*commanded, *motors}
    steering = None
    above = movable_above(tree.robot, joint.parent)
    while above is not None:
        upward = abs((tree.pose(above.child).rotation @ unit_axis(above))[2])
        if above.type is not JointType.PRISMATIC and upward >= _LEVEL:
            if steering is not None or upward < UPRIGHT or not _steers(above, commanded):
                return steering, False
            steering = above
        above = movable_above(tree.robot, above.parent)
    return steering, joint.name in motors or not is_caster(joint)


def _steers(joint: Joint, commanded: Collection[str]) -> bool:
    """Whether an upright joint steers a wheel. The swivel of a caster has no limits, and nothing commands
    it."""
    return joint.type is JointType.REVOLUTE or joint.name in commanded or "steer" in joint.name.lower()


def _written_range(joint: Joint) -> tuple[float, float]:
    """The limits of a steering joint. They are also meant if the joint is continuous, where URDF ignores
    them."""
    limit = joint.limit
    if (
        limit is not None
        and limit.lower is not None
        and limit.upper is not None
        and limit.lower < limit.upper
    ):
        return limit.lower, limit.upper
    return joint.range


def placed(
    tree: FrameTree, base: str, drive_in_base: Transform, wheel: Wheel, by: Joint | None
) -> WheelModule:
    """The module of a wheel that `by` steers. The wheel is in the frame of `base`."""
    drive_from_base = drive_in_base.inverse()
    middle = drive_from_base.apply(wheel.center)
    axis = drive_from_base.rotation @ wheel.axis
    # the rolling direction is to the right of the axle, and nearer to forwards than to backwards
    direction = atan2(-axis[0], axis[1])
    forward = 1.0 if abs(direction) <= pi / 2.0 + _NEARLY else -1.0
    if forward < 0.0:
        direction -= copysign(pi, direction)
    x, y = float(middle[0]), float(middle[1])
    trail, aside, upward, lower, upper, rate = 0.0, 0.0, 1.0, direction, direction, inf
    if by is not None:
        pivot = drive_from_base @ tree.pose(by.child, in_frame=base)
        upward = 1.0 if (pivot.rotation @ unit_axis(by))[2] > 0.0 else -1.0
        x, y, _ = pivot.translation.tolist()
        c, s = cos(direction), sin(direction)
        to_x, to_y = float(middle[0]) - x, float(middle[1]) - y
        trail, aside = c * to_x + s * to_y, c * to_y - s * to_x
        ends = sorted(direction + upward * end for end in _written_range(by))
        lower, upper = ends[0], ends[1]
        rate = by.speed_limit
    return WheelModule(
        rolls=wheel.joint.name,
        steering=by.name if by is not None else None,
        x=x,
        y=y,
        trail=trail,
        aside=aside,
        direction=direction,
        upward=upward,
        lower=lower,
        upper=upper,
        rate=rate,
        radius=wheel.radius,
        forward=forward,
    )
