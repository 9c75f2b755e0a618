"""Computes the efforts of the motors of joints.

MuJoCo's `actuator_force` is not this effort. It is the servo's force at the start of a step, but the
`discrete` integrator evaluates servos at the end of the step: a servo with stiffness K and damping D then
exerts h K v + (h D + h^2 K) a less, at a time step h (MuJoCo, Computation, "Integrators": the right-hand side
f - h K v and the metric M + h D + h^2 K). A servo at its force limit exerts exactly the limit.

What moves a link is less: a motor also speeds up its own inertia (the joint's armature), and overcomes the
joint's damping and dry friction.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from kbot.sim.engine.arrays import numbers


class EffortTerm(NamedTuple):
    """A term of a joint's effort: `factor` times the force of the engine's actuator `name`, less what
    accelerates a `mass` (kg or kg m^2).

    The mass is 0, unless the effort already contains that part as the acceleration of an armature.
    """

    name: str
    factor: float
    mass: float = 0.0


class _Motor(NamedTuple):
    """`actuators` has the engine's index of each, and the `factor` and the `mass` of its `EffortTerm`."""

    dof: int
    armature: float
    damping: float
    has_friction: bool
    actuators: tuple[tuple[int, float, float], ...]


class Motors:
    """The motors of a robot's joints."""

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        joints: Mapping[str, tuple[int, Sequence[EffortTerm]]],
        *,
        pushes: bool,
    ) -> None:
        """`joints`: for each joint the index of its speed, and what exerts its effort.

        Actuators that the engine does not have are left out. `pushes`: whether the wheels push the robot. If
        they do not, their armatures replace what they would have to push, and count as a part of the links.
        """
        self._timestep = float(model.opt.timestep)
        self._force, self._speed = numbers(data.actuator_force), numbers(data.actuator_velocity)
        self._data = data
        self._qvel, self._qacc = numbers(data.qvel), numbers(data.qacc)
        self._moment, self._columns = numbers(data.actuator_moment), data.moment_colind
        self._first, self._count = data.moment_rowadr, data.moment_rownnz
        self._biases = numbers(model.actuator_biasprm.reshape(-1))
        self._ranges = numbers(model.actuator_forcerange.reshape(-1))
        self._limited = tuple(map(bool, model.actuator_forcelimited))
        self._motors = {
            joint: _Motor(
                dof,
                float(model.dof_armature[dof]) if pushes else 0.0,
                float(model.dof_damping[dof]),
                bool(model.dof_frictionloss[dof] > 0.0),
                _found(model, terms),
            )
            for joint, (dof, terms) in joints.items()
        }

    def effort(self, joint: str) -> float:
        """The effort in N m or N of a joint's motor over the last step.

        Dry friction that the engine leaves out, because the motor overcomes it, is not part of it.
        """
        return sum(
            factor * (self._exerted(index) - (mass * self._acceleration(index) if mass else 0.0))
            for index, factor, mass in self._motors[joint].actuators
        )

    def on_link(self, joint: str) -> float:
        """The part of the effort in N m or N that moved the joint's link, and what the link pushes."""
        motor = self._motors[joint]
        effort = self.effort(joint) - motor.armature * self._qacc[motor.dof]
        effort -= motor.damping * self._qvel[motor.dof]
        if motor.has_friction:
            data = self._data
            rows = (data.efc_type == mujoco.mjtConstraint.mjCNSTR_FRICTION_DOF) & (data.efc_id == motor.dof)
            effort += float(np.sum(data.efc_force[rows]))
        return effort

    def _exerted(self, index: int) -> float:
        """The force in N or torque in N m of an actuator over the last step."""
        force = self._force[index]
        if self._limited[index] and not self._ranges[2 * index] < force < self._ranges[2 * index + 1]:
            return force
        # the integrator leaves out gains that would make a joint unstable
        first = index * mujoco.mjNBIAS
        stiffness, damping = max(-self._biases[first + 1], 0.0), max(-self._biases[first + 2], 0.0)
        if not (stiffness or damping):
            return force
        faster = self._timestep * self._acceleration(index)
        return force - self._timestep * stiffness * (self._speed[index] + faster) - damping * faster

    def _acceleration(self, index: int) -> float:
        """The acceleration along an actuator in rad/s^2 or m/s^2 over the last step."""
        start = int(self._first[index])
        return sum(
            self._moment[at] * self._qacc[int(self._columns[at])]
            for at in range(start, start + int(self._count[index]))
        )


def _found(model: mujoco.MjModel, terms: Sequence[EffortTerm]) -> tuple[tuple[int, float, float], ...]:
    kind = mujoco.mjtObj.mjOBJ_ACTUATOR
    indices = ((mujoco.mj_name2id(model, kind, term.name), term) for term in terms)
    return tuple((index, term.factor, term.mass) for index, term in indices if index >= 0)
