"""Commands a holonomic base and its wheels, and reads the wheels."""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np

from kbot.kinematics.drive.declared import Holonomic
from kbot.kinematics.drive.drive import HolonomicDrive
from kbot.model import RobotModel
from kbot.sim.drive.twist_controller import STILL, Twist
from kbot.sim.drive.wheel_servos import ServoState, slack
from kbot.sim.engine.arrays import numbers
from kbot.sim.engine.base_servo import AXES, traction
from kbot.sim.recipe import BASE_SERVO_TIME, CONTROL_PERIOD

HOLDING = 10.0
"""Gain in 1/s of the integral part of the base's servo, which holds the base on a slope. It is far slower
than the servo itself (`BASE_SERVO_TIME`), and slower than the control period."""
_LEVEL = 0.7
"""Least vertical component of the normal of a contact that carries the base. A wall does not carry it."""


class _Wheel(NamedTuple):
    """`from_twist` and `to_twist` convert a twist of the base to the wheel's speed, and back by its share."""

    position: int
    speed: int
    state: int
    actuator: int
    from_twist: Twist
    to_twist: Twist
    reach: float
    lag: float


class _Axis(NamedTuple):
    """`friction` is the largest force or torque per N of the load on the wheels, `motors` that of the motors.

    The base moves at `scale` times the command, because the controller computes with its own sizes.
    """

    actuator: int
    gain: float
    friction: float
    motors: float
    scale: float


class HolonomicServos:
    """Turns the wheels as their controller computes, and moves the base as the wheels turn.

    A base without driving wheels moves as commanded. Tracks turn as commanded too, and the base turns less
    because they slip. Their angles are those of the control period.

    In place of the angles of two sides, `angles` and `roll` return how far the wheels drove the base:
    forwards and leftwards in m, and turned in rad. `speeds` returns how fast.
    """

    _commanded: Twist
    _driven: Twist
    _held: Twist
    _load: float

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        robot: RobotModel,
        drive: HolonomicDrive,
        believed: HolonomicDrive,
        prefix: str,
    ) -> None:
        """`believed` has the sizes with which the robot's controller computes."""
        self._data, self._range = data, model.actuator_forcerange
        self._qpos, self._qvel = numbers(data.qpos), numbers(data.qvel)
        self._ctrl, self._act = numbers(data.ctrl), numbers(data.act)
        self._velocity = numbers(data.actuator_velocity)
        joints, actuators = mujoco.mjtObj.mjOBJ_JOINT, mujoco.mjtObj.mjOBJ_ACTUATOR
        wheels_from_twist = believed.wheels_from_twist
        rows = zip(wheels_from_twist.tolist(), np.linalg.pinv(wheels_from_twist).T.tolist(), strict=True)
        wheels = []
        for name, (from_twist, to_twist) in zip(drive.joints, rows, strict=True):
            joint = mujoco.mj_name2id(model, joints, prefix + name)
            actuator = mujoco.mj_name2id(model, actuators, prefix + name)
            place = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
            state = int(model.actuator_actadr[actuator])
            limits = slack(model, actuator)
            wheels.append(_Wheel(*place, state, actuator, tuple(from_twist), tuple(to_twist), *limits))
        self._wheels = tuple(wheels)
        root = mujoco.mj_name2id(model, joints, prefix)
        mass = float(model.body_subtreemass[model.jnt_bodyid[root]])
        inertia = float(model.dof_M0[model.jnt_dofadr[root] + 5])
        friction, lever, motors = traction(robot, drive)
        if drive.kind is Holonomic.BODY:
            # the plugin turns any inertia, but the speed of the rim changes no faster than friction allows
            lever = max(lever, inertia / (mass * lever))
        scale = drive.radius / believed.radius
        self._efficiency = drive.efficiency
        turn_scale = scale * believed.separation / drive.separation * drive.efficiency
        axes = []
        for name, moved, arm, most, ratio in zip(
            AXES, (mass, mass, inertia), (1.0, 1.0, lever), motors, (scale, scale, turn_scale), strict=True
        ):
            actuator = mujoco.mj_name2id(model, actuators, prefix + name)
            gain = moved / BASE_SERVO_TIME
            model.actuator_gainprm[actuator, 0] = gain
            model.actuator_biasprm[actuator, 2] = -gain
            axes.append(_Axis(actuator, gain, friction * arm, most, ratio))
        self._axes = tuple(axes)
        bodies = [
            mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, prefix + link) for link in drive.carriers
        ]
        self._carries = np.isin(model.geom_bodyid, bodies)
        self.state = (STILL, STILL, STILL, mass * float(np.linalg.norm(model.opt.gravity)))

    @property
    def state(self) -> ServoState:
        """The commanded twist, how far tracks drove, the integral part of the servo, and the load on the
        wheels in N."""
        return self._commanded, self._driven, self._held, self._load

    @state.setter
    def state(self, state: ServoState) -> None:
        self._commanded, self._driven, self._held, self._load = state
        self._limit_force()

    def move(self, x: float, y: float, yaw: float) -> bool:
        """Drive at a twist, as far as the controller's sizes are right.

        Returns whether the command stays the same for this twist.
        """
        ctrl = self._ctrl
        for wheel in self._wheels:
            by_x, by_y, by_yaw = wheel.from_twist
            ctrl[wheel.actuator] = by_x * x + by_y * y + by_yaw * yaw
        self._commanded = (x, y, yaw)
        self._command_base()
        return True

    def _command_base(self) -> None:
        for axis, wanted, held in zip(self._axes, self._wanted, self._held, strict=True):
            self._ctrl[axis.actuator] = wanted + held

    @property
    def _wanted(self) -> Twist:
        """The twist at which the wheels move the base."""
        x, y, yaw = self.speeds() if self._wheels else self._commanded
        in_x, in_y, in_yaw = self._axes
        return in_x.scale * x, in_y.scale * y, in_yaw.scale * yaw

    def speeds(self) -> Twist:
        """The twist of the base that the wheels' speeds make, without slip."""
        if not self._wheels:
            x, y, yaw = self._commanded
            return x, y, yaw / self._efficiency
        return self._to_twist([self._qvel[wheel.speed] for wheel in self._wheels])

    def angles(self) -> Twist:
        """How far the wheels drove the base, without slip."""
        if not self._wheels:
            return self._driven
        return self._to_twist([self._qpos[wheel.position] for wheel in self._wheels])

    def _to_twist(self, values: list[float]) -> Twist:
        x = y = yaw = 0.0
        for wheel, value in zip(self._wheels, values, strict=True):
            by_x, by_y, by_yaw = wheel.to_twist
            x, y, yaw = x + by_x * value, y + by_y * value, yaw + by_yaw * value
        return x, y, yaw

    def roll(self) -> Twist:
        """The angles. Also adapts the base's servo to the load, and limits the wind-up of all servos."""
        for wheel in self._wheels:
            middle = wheel.lag * self._qvel[wheel.speed]
            ahead = self._act[wheel.state] - middle
            self._act[wheel.state] = middle + min(max(ahead, -wheel.reach), wheel.reach)
        if not self._wheels:
            (x, y, yaw), (by_x, by_y, by_yaw) = self._driven, self.speeds()
            period = CONTROL_PERIOD
            self._driven = x + by_x * period, y + by_y * period, yaw + by_yaw * period
        self._load = self._measured_load()
        self._limit_force()
        x, y, yaw = map(self._hold, self._axes, self._wanted, self._held)
        self._held = (x, y, yaw)
        self._command_base()
        return self.angles()

    def _hold(self, axis: _Axis, wanted: float, held: float) -> float:
        """The integral part of a servo, after one more control period."""
        most = self._most(axis) / axis.gain
        held += HOLDING * CONTROL_PERIOD * (wanted - self._velocity[axis.actuator])
        return min(max(held, -most), most)

    def _most(self, axis: _Axis) -> float:
        """The largest force in N or torque in N m under the current load."""
        return min(axis.friction * self._load, axis.motors)

    def _limit_force(self) -> None:
        for axis in self._axes:
            most = self._most(axis)
            self._range[axis.actuator] = (-most, most)

    def _measured_load(self) -> float:
        """The force in N with which the ground carried the wheels in the last step."""
        contact = self._data.contact
        is_ground = self._carries[contact.geom].any(axis=1) & (abs(contact.frame[:, 2]) > _LEVEL)
        rows = contact.efc_address[is_ground]
        return float(self._data.efc_force[rows[rows >= 0]].sum())

    def settle(self) -> None:
        """Stop the wheels at their current angles and clear the servos' state."""
        for wheel in self._wheels:
            self._qvel[wheel.speed] = 0.0
            self._act[wheel.state] = 0.0
        self._held = STILL
        self._command_base()
