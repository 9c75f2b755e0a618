"""Commands the wheels of a tricycle or a car like those of an equivalent differential drive.

The wheel speeds of the differential drive give a twist of the fixed axle's middle. Every driven or steered
wheel follows that twist. In the other direction, the twist is the least-squares solution from the driven
wheels' speeds and the steering angles.
"""

from __future__ import annotations

from math import atan, cos, pi, sin
from typing import NamedTuple

import mujoco

from kbot.kinematics.drive.drive import SteeredDrive
from kbot.sim.drive.wheel_servos import ServoState, slack
from kbot.sim.engine.arrays import numbers

FREQUENCY = 40.0
"""Natural frequency of the steering servos in rad/s."""

_NEARLY = 1e-3
"""rad by which a steering limit may miss the wanted angle: a limit of 90 degrees is often written as 1.57."""


class _Steering(NamedTuple):
    position: int
    actuator: int
    x: float
    y: float
    upward: float
    lower: float
    upper: float


class _Driven(NamedTuple):
    """`steering`: the index of its steering joint, -1 for a wheel that does not steer."""

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
    """The interface of `WheelServos` for a drive with steered wheels."""

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
        """Set the wheel speeds of the differential drive, in rad/s."""
        v = (left + right) / 2.0 * self._radius
        w = (right - left) / 2.0 * self._radius / self._half
        wanted = self._steer(v, w)
        angles = self._within(wanted)
        ends = (i for i, angle in enumerate(angles) if abs(angle - wanted[i]) > _NEARLY)
        turn = min((self._curvature(i, angles[i]) * v for i in ends), key=abs, default=w)
        if abs(turn) < abs(w):
            # the wheel at its steering limit limits the curvature of the whole robot
            w = turn
            angles = self._within(self._steer(v, w))
        for wheel, angle in zip(self._steering, angles, strict=True):
            self._ctrl[wheel.actuator] = angle * wheel.upward
        for driven in self._driven:
            angle = angles[driven.steering] if driven.steering >= 0 else 0.0
            speed = (v - w * driven.y) * cos(angle) + w * driven.x * sin(angle)
            self._ctrl[driven.actuator] = speed / driven.radius * driven.forward

    def _steer(self, v: float, w: float) -> list[float]:
        """The angle to the left at which each steered wheel rolls without slipping."""
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
        """Curvature (1/m) of the path of the axle's middle when a wheel is steered to an angle."""
        wheel = self._steering[index]
        return sin(angle) / (wheel.x * cos(angle) + wheel.y * sin(angle))

    def settle(self) -> None:
        """Stop the wheels at their current angles and clear their servos' state."""
        for wheel in self._driven:
            self._qvel[wheel.speed] = 0.0
            self._act[wheel.state] = self._qpos[wheel.position]

    def angles(self) -> tuple[float, float]:
        """The wheel angles of the differential drive in rad."""
        left, right, places, before = self.state
        rolled = [now - then for now, then in zip(self._places(), places, strict=True)]
        aside = [(now + then) / 2.0 for now, then in zip(self._angles(), before, strict=True)]
        to_left, to_right = self._as_differential(rolled, aside)
        return left + to_left, right + to_right

    def roll(self) -> tuple[float, float]:
        """The angles. Also limits the wind-up of a blocked wheel's servo."""
        left, right = self.angles()
        self.state = (left, right, self._places(), self._angles())
        for wheel in self._driven:
            middle = self._qpos[wheel.position] + wheel.lag * self._qvel[wheel.speed]
            ahead = self._act[wheel.state] - middle
            self._act[wheel.state] = middle + min(max(ahead, -wheel.reach), wheel.reach)
        return left, right

    def speeds(self) -> tuple[float, float]:
        """The wheel speeds of the differential drive, in rad/s."""
        rates = [self._qvel[w.speed] * w.forward * w.radius for w in self._driven]
        return self._as_differential(rates, self._angles())

    def _places(self) -> list[float]:
        """Distance in m that each driven wheel has rolled."""
        return [self._qpos[w.position] * w.forward * w.radius for w in self._driven]

    def _angles(self) -> list[float]:
        """The steering angle of each wheel in rad, positive to the left."""
        return [self._qpos[w.position] * w.upward for w in self._steering]

    def _as_differential(self, ways: list[float], aside: list[float]) -> tuple[float, float]:
        """Wheel angles or speeds from what each driven wheel rolled (m), or its rim speed (m/s)."""
        vv = vw = ww = v_way = w_way = 0.0
        for wheel, way in zip(self._driven, ways, strict=True):
            angle = aside[wheel.steering] if wheel.steering >= 0 else 0.0
            by_v, by_w = cos(angle), wheel.x * sin(angle) - wheel.y * cos(angle)
            vv, vw, ww = vv + by_v * by_v, vw + by_v * by_w, ww + by_w * by_w
            v_way, w_way = v_way + by_v * way, w_way + by_w * way
        for steering, angle in zip(self._steering, aside, strict=True):
            # a steered wheel does not slip sideways
            by_v, by_w = -sin(angle), steering.x * cos(angle) + steering.y * sin(angle)
            vv, vw, ww = vv + by_v * by_v, vw + by_v * by_w, ww + by_w * by_w
        # normal equations of two unknowns: the determinant is above 0, because no steered wheel is on the
        # axle
        determinant = vv * ww - vw * vw
        ahead = (ww * v_way - vw * w_way) / determinant
        turned = (vv * w_way - vw * v_way) / determinant
        across = turned * self._half
        return (ahead - across) / self._radius, (ahead + across) / self._radius


def _aside(model: mujoco.MjModel, joint: str) -> tuple[int, int]:
    """A steering joint's position index and its actuator, tuned as a critically damped position servo."""
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, joint)
    actuator = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, joint)
    inertia = max(float(model.dof_M0[model.jnt_dofadr[index]]), 1e-6)
    stiffness = inertia * FREQUENCY**2
    model.actuator_gainprm[actuator, 0] = stiffness
    model.actuator_biasprm[actuator, 1:3] = (-stiffness, -2.0 * inertia * FREQUENCY)
    return int(model.jnt_qposadr[index]), actuator
