"""Commands the wheels of a tricycle or a car like those of an equivalent differential drive.

Wheel speeds of the differential drive are a twist of the fixed axle's middle, which every wheel follows in
its own way; back from the driven wheels' angles and the steering angles the twist is that of least squares.
"""

from __future__ import annotations

from math import atan, cos, pi, sin
from typing import NamedTuple

import mujoco

from kbot.kinematics.drive.drive import SteeredDrive
from kbot.sim.drive.wheel_servos import ServoState, slack
from kbot.sim.engine.arrays import numbers

FREQUENCY = 40.0
"""rad/s: how fast a wheel is turned aside."""

_NEARLY = 1e-3
"""rad by which a wheel may miss its angle: many an end of a quarter turn is written 1.57."""


class _Steering(NamedTuple):
    position: int
    actuator: int
    x: float
    y: float
    upward: float
    lower: float
    upper: float


class _Driven(NamedTuple):
    """`steering`: which steering wheel it is, -1 for none."""

    position: int
    speed: int
    state: int
    actuator: int
    x: float
    y: float
    radius: float
    forward: float
    steering: int
    reach: float
    lag: float


class SteeredServos:
    """As `WheelServos`, for wheels that steer."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, drive: SteeredDrive, prefix: str) -> None:
        self._qpos, self._qvel = numbers(data.qpos), numbers(data.qvel)
        self._ctrl, self._act = numbers(data.ctrl), numbers(data.act)
        self._radius, self._half = drive.radius, drive.separation / 2.0
        rolls = [wheel.rolls for wheel in drive.steering]
        self._steering = tuple(
            _Steering(*_aside(model, prefix + w.joint), w.x, w.y, w.upward, w.lower, w.upper)
            for w in drive.steering
        )
        axle_from_base = drive.axle_in_base.inverse()
        driven = []
        for name in drive.traction:
            index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, prefix + name)
            actuator = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, prefix + name)
            wheel = drive.wheels[name]
            x, y, _ = axle_from_base.apply(wheel.center).tolist()
            driven.append(
                _Driven(
                    int(model.jnt_qposadr[index]), int(model.jnt_dofadr[index]),
                    int(model.actuator_actadr[actuator]), actuator, x, y, wheel.radius, drive.forward[name],
                    rolls.index(name) if name in rolls else -1, *slack(model, actuator),
                )
            )  # fmt: skip
        self._driven = tuple(driven)
        self.state: ServoState = (0.0, 0.0, self._places(), self._angles())

    def turn_wheels(self, left: float, right: float) -> None:
        """Speeds of the wheels of the differential drive, in rad/s."""
        v = (left + right) / 2.0 * self._radius
        w = (right - left) / 2.0 * self._radius / self._half
        wanted = self._steer(v, w)
        angles = self._within(wanted)
        ends = (i for i, angle in enumerate(angles) if abs(angle - wanted[i]) > _NEARLY)
        turn = min((self._curvature(i, angles[i]) * v for i in ends), key=abs, default=w)
        if abs(turn) < abs(w):
            # a wheel that is at its end bounds the curve of all
            w = turn
            angles = self._within(self._steer(v, w))
        for wheel, angle in zip(self._steering, angles, strict=True):
            self._ctrl[wheel.actuator] = angle * wheel.upward
        for driven in self._driven:
            angle = angles[driven.steering] if driven.steering >= 0 else 0.0
            speed = (v - w * driven.y) * cos(angle) + w * driven.x * sin(angle)
            self._ctrl[driven.actuator] = speed / driven.radius * driven.forward

    def _steer(self, v: float, w: float) -> list[float]:
        """The angle to the left at which each wheel that steers rolls along."""
        angles = []
        for wheel in self._steering:
            ahead, across = v - w * wheel.y, w * wheel.x
            if ahead == across == 0.0:
                angle = self._ctrl[wheel.actuator] * wheel.upward
            elif ahead == 0.0:
                angle = pi / 2.0 if across > 0.0 else -pi / 2.0
            else:
                angle = atan(across / ahead)
            angles.append(angle)
        return angles

    def _within(self, angles: list[float]) -> list[float]:
        """The angles, each within its wheel's limits."""
        return [
            min(max(angle * wheel.upward, wheel.lower), wheel.upper) * wheel.upward
            for wheel, angle in zip(self._steering, angles, strict=True)
        ]

    def _curvature(self, index: int, angle: float) -> float:
        """1/m of the axle's middle when a wheel is turned to an angle."""
        wheel = self._steering[index]
        return sin(angle) / (wheel.x * cos(angle) + wheel.y * sin(angle))

    def settle(self) -> None:
        """Stand still where the wheels are now, as if they had never been told to turn."""
        for wheel in self._driven:
            self._qvel[wheel.speed] = 0.0
            self._act[wheel.state] = self._qpos[wheel.position]

    def angles(self) -> tuple[float, float]:
        """Angles in rad that the wheels of the differential drive have come to."""
        left, right, places, before = self.state
        gone = [now - then for now, then in zip(self._places(), places, strict=True)]
        aside = [(now + then) / 2.0 for now, then in zip(self._angles(), before, strict=True)]
        to_left, to_right = self._as_differential(gone, aside)
        return left + to_left, right + to_right

    def roll(self) -> tuple[float, float]:
        """The angles; and a blocked wheel's servo no longer stores up the way it did not go."""
        left, right = self.angles()
        self.state = (left, right, self._places(), self._angles())
        for wheel in self._driven:
            middle = self._qpos[wheel.position] + wheel.lag * self._qvel[wheel.speed]
            ahead = self._act[wheel.state] - middle
            self._act[wheel.state] = middle + min(max(ahead, -wheel.reach), wheel.reach)
        return left, right

    def speeds(self) -> tuple[float, float]:
        """Of the wheels of the differential drive, in rad/s."""
        rates = [self._qvel[w.speed] * w.forward * w.radius for w in self._driven]
        return self._as_differential(rates, self._angles())

    def _places(self) -> list[float]:
        """Metres that each driven wheel has rolled."""
        return [self._qpos[w.position] * w.forward * w.radius for w in self._driven]

    def _angles(self) -> list[float]:
        """rad to the left that each wheel is turned aside."""
        return [self._qpos[w.position] * w.upward for w in self._steering]

    def _as_differential(self, ways: list[float], aside: list[float]) -> tuple[float, float]:
        """From what each driven wheel rolled, or its speed at the rim (m or m/s)."""
        vv = vw = ww = v_way = w_way = 0.0
        for wheel, way in zip(self._driven, ways, strict=True):
            angle = aside[wheel.steering] if wheel.steering >= 0 else 0.0
            by_v, by_w = cos(angle), wheel.x * sin(angle) - wheel.y * cos(angle)
            vv, vw, ww = vv + by_v * by_v, vw + by_v * by_w, ww + by_w * by_w
            v_way, w_way = v_way + by_v * way, w_way + by_w * way
        for steering, angle in zip(self._steering, aside, strict=True):
            # it does not slip across
            by_v, by_w = -sin(angle), steering.x * cos(angle) + steering.y * sin(angle)
            vv, vw, ww = vv + by_v * by_v, vw + by_v * by_w, ww + by_w * by_w
        # the normal equations of two unknowns; their determinant is above zero, for no wheel is on the axle
        determinant = vv * ww - vw * vw
        ahead = (ww * v_way - vw * w_way) / determinant
        turned = (vv * w_way - vw * v_way) / determinant
        across = turned * self._half
        return (ahead - across) / self._radius, (ahead + across) / self._radius


def _aside(model: mujoco.MjModel, joint: str) -> tuple[int, int]:
    """A steering joint's place and its actuator, which is made to hold its angle."""
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, joint)
    actuator = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, joint)
    inertia = max(float(model.dof_M0[model.jnt_dofadr[index]]), 1e-6)
    stiffness = inertia * FREQUENCY**2
    model.actuator_gainprm[actuator, 0] = stiffness
    model.actuator_biasprm[actuator, 1:3] = (-stiffness, -2.0 * inertia * FREQUENCY)
    return int(model.jnt_qposadr[index]), actuator
