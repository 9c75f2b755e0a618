"""Steers and turns the wheels of a base with steered wheels, and reads how they moved it."""

from __future__ import annotations

from math import copysign, inf, sqrt
from typing import NamedTuple

import mujoco

from kbot.kinematics.drive.drive import SteeredDrive
from kbot.kinematics.drive.wheel_module import Equation, WheelModule, motion
from kbot.sim.drive.twist_controller import STILL, Twist
from kbot.sim.drive.wheel_servos import ServoState, slack
from kbot.sim.engine.arrays import numbers

FREQUENCY = 80.0
"""Natural frequency of the steering servos in rad/s."""
_STANDING = 1e-9
"""Speed in m/s below which the base does not drive."""
_ARRIVED = 1e-3
"""Distance in rad from its target at which a wheel has been steered."""
_SPEEDING = 4.0
"""A steering servo lags behind, so its target accelerates this much faster than its torque limit allows."""


class _Steering(NamedTuple):
    """`most` is the acceleration in rad/s^2 that the torque limit of the joint allows."""

    position: int
    speed: int
    actuator: int
    most: float


class _Rolling(NamedTuple):
    position: int
    speed: int
    state: int
    actuator: int
    reach: float
    lag: float


class _Wheel(NamedTuple):
    """`steering` is None for a fixed wheel, `rolling` for one without a motor."""

    module: WheelModule
    steering: _Steering | None
    rolling: _Rolling | None


class SteeredServos:
    """As `HolonomicServos`, for a base with steered wheels.

    While wheels still steer, each rolls as fast as the base moves in its current direction.
    """

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, drive: SteeredDrive, prefix: str, period: float
    ) -> None:
        """`drive` has the sizes with which the robot's controller computes, and `period` is the time in s
        between calls of `move`."""
        self._period = period
        self._qpos, self._qvel = numbers(data.qpos), numbers(data.qvel)
        self._ctrl, self._act = numbers(data.ctrl), numbers(data.act)
        self._sideways, self._curvatures = drive.sideways, drive.curvatures
        self._turns_in_place = drive.turns_in_place
        self._wheels = tuple(
            _Wheel(
                module,
                _steering(model, prefix + module.steering) if module.steering is not None else None,
                _rolling(model, prefix + module.rolls) if module.rolls in drive.traction else None,
            )
            for module in drive.modules
        )
        self.state: ServoState = (*STILL, self._ways(), self._directions())

    def move(self, x: float, y: float, yaw: float) -> bool:
        """Steer and turn the wheels for a twist, which a steering limit may make less curved.

        Returns whether all wheels have been steered, so that the command stays the same for this twist.
        """
        if not self._sideways:
            y, yaw = 0.0, self._turn(x, yaw)
        directions, rates = self._directions(), self._rates()
        commanded = list[float]()
        has_arrived = True
        for (module, steering, _), direction, rate in zip(self._wheels, directions, rates, strict=True):
            after = before = 0.0
            if steering is not None:
                before = module.direction + self._ctrl[steering.actuator] * module.upward
                # A target further ahead adds no torque. So that of a blocked wheel waits, and its wheels
                # keep rolling around the steering axis.
                lead = steering.most / FREQUENCY**2 + 2.0 * abs(rate) / FREQUENCY
                before = min(max(before, direction - lead), direction + lead)
                target = module.steer(x, y, yaw, before)
                fastest = min(module.rate, self._steering_speed(steering, target - before, rate))
                step = fastest * self._period
                after = min(max(target, before - step), before + step)
                self._ctrl[steering.actuator] = (after - module.direction) * module.upward
                has_arrived = has_arrived and abs(target - direction) < _ARRIVED
            commanded.append((after - before) / self._period)
        if not self._turns_in_place:
            yaw = self._turn_of_wheels(x, self._slides(directions, rates))
        # a wheel beside its steering axis rolls around it as commanded, or else it would hold it
        for (module, _, rolling), direction, rate in zip(self._wheels, directions, commanded, strict=True):
            if rolling is not None:
                speed = module.rim_speed(x, y, yaw, direction, rate)
                self._ctrl[rolling.actuator] = speed / module.radius * module.forward
        return has_arrived

    def _steering_speed(self, steering: _Steering, way: float, rate: float) -> float:
        """The highest speed in rad/s at which a wheel that steers at `rate` is sent `way` further.

        A servo at its torque limit overshoots. So the wheel speeds up about as fast as that limit allows, and
        can stop with half of it."""
        if steering.most == inf:
            return inf
        towards = max(rate * copysign(1.0, way), 0.0)
        faster = towards + _SPEEDING * steering.most * self._period
        return min(faster, sqrt(steering.most * abs(way)))

    def _turn(self, x: float, yaw: float) -> float:
        """The turn that the steering limits allow at a speed."""
        if self._turns_in_place:
            return yaw
        if abs(x) < _STANDING:
            return 0.0
        right, left = self._curvatures
        return x * min(max(yaw / x, right), left)

    def _turn_of_wheels(self, x: float, slides: list[Equation]) -> float:
        """The turn with which the base drives at a speed as its wheels are steered now."""
        turns = sum(by_yaw * (value - by_x * x) for by_x, _, by_yaw, value in slides)
        return turns / sum(by_yaw * by_yaw for _, _, by_yaw, _ in slides)

    def settle(self) -> None:
        """Stop the wheels at their current angles and clear their servos' state."""
        for wheel in self._wheels:
            if wheel.rolling is not None:
                self._qvel[wheel.rolling.speed] = 0.0
                self._act[wheel.rolling.state] = 0.0

    def angles(self) -> Twist:
        """How far the wheels drove the base: forwards and leftwards in m, and turned in rad."""
        x, y, yaw, ways, directions = self.state
        rolled = [now - before for now, before in zip(self._ways(), ways, strict=True)]
        now = self._directions()
        turned = [after - before for after, before in zip(now, directions, strict=True)]
        middle = [(after + before) / 2.0 for after, before in zip(now, directions, strict=True)]
        ahead, aside, spun = self._motion(rolled, middle, turned)
        return x + ahead, y + aside, yaw + spun

    def roll(self) -> Twist:
        """The angles. Also limits the wind-up of a blocked wheel's servo."""
        moved = self.angles()
        self.state = (*moved, self._ways(), self._directions())
        for wheel in self._wheels:
            if wheel.rolling is not None:
                _, speed, state, _, reach, lag = wheel.rolling
                middle = lag * self._qvel[speed]
                self._act[state] = middle + min(max(self._act[state] - middle, -reach), reach)
        return moved

    def speeds(self) -> Twist:
        """How fast the wheels drive the base."""
        rims = [
            self._qvel[rolling.speed] * module.forward * module.radius if rolling is not None else 0.0
            for module, _, rolling in self._wheels
        ]
        return self._motion(rims, self._directions(), self._rates())

    def _ways(self) -> list[float]:
        """Distance in m that each wheel with a motor has rolled."""
        return [
            self._qpos[rolling.position] * module.forward * module.radius if rolling is not None else 0.0
            for module, _, rolling in self._wheels
        ]

    def _directions(self) -> list[float]:
        """The direction of each wheel in rad."""
        return [
            module.direction
            + (self._qpos[steering.position] * module.upward if steering is not None else 0.0)
            for module, steering, _ in self._wheels
        ]

    def _rates(self) -> list[float]:
        """How fast each wheel steers, in rad/s."""
        return [
            self._qvel[steering.speed] * module.upward if steering is not None else 0.0
            for module, steering, _ in self._wheels
        ]

    def _motion(self, ways: list[float], directions: list[float], turned: list[float]) -> Twist:
        """The motion of the base from what each wheel rolled in m, its direction, and how far it steered, or
        its twist from their rates."""
        rolled = [
            module.rolled(way, direction, steered)
            for (module, _, rolling), way, direction, steered in zip(
                self._wheels, ways, directions, turned, strict=True
            )
            if rolling is not None
        ]
        return motion([*rolled, *self._slides(directions, turned)], sideways=self._sideways)

    def _slides(self, directions: list[float], turned: list[float]) -> list[Equation]:
        """The equations of the base's motion in which no steered wheel slides."""
        return [
            module.did_not_slide(direction, steered)
            for (module, steering, _), direction, steered in zip(
                self._wheels, directions, turned, strict=True
            )
            if steering is not None
        ]


def _rolling(model: mujoco.MjModel, joint: str) -> _Rolling:
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, joint)
    actuator = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, joint)
    place = int(model.jnt_qposadr[index]), int(model.jnt_dofadr[index])
    return _Rolling(*place, int(model.actuator_actadr[actuator]), actuator, *slack(model, actuator))


def _steering(model: mujoco.MjModel, joint: str) -> _Steering:
    """A steering joint, whose actuator is tuned as a critically damped position servo."""
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, joint)
    actuator = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, joint)
    inertia = max(float(model.dof_M0[model.jnt_dofadr[index]]), 1e-6)
    stiffness = inertia * FREQUENCY**2
    model.actuator_gainprm[actuator, 0] = stiffness
    model.actuator_biasprm[actuator, 1:3] = (-stiffness, -2.0 * inertia * FREQUENCY)
    limit = float(model.actuator_forcerange[actuator, 1]) if model.actuator_forcelimited[actuator] else inf
    place = int(model.jnt_qposadr[index]), int(model.jnt_dofadr[index])
    return _Steering(*place, actuator, limit / inertia)
