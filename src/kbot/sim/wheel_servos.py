"""The drive wheels' places in the engine's state, reached as plain numbers."""

from __future__ import annotations

from typing import Any, NamedTuple

import mujoco

from kbot.kinematics.differential_drive import DifferentialDrive
from kbot.sim.numbers import numbers


class _Wheel(NamedTuple):
    position: int
    speed: int
    command: int
    state: int
    forward: float
    reach: float
    """How far the servo's state may be from where its speed would have it, in rad."""
    lag: float
    """How far behind its state a servo's wheel runs, in s of its speed."""


class WheelServos:
    """Commands to and angles of both sides' wheels, forwards positive."""

    def __init__(self, model: Any, data: Any, drive: DifferentialDrive, prefix: str) -> None:  # noqa: ANN401
        self._qpos, self._qvel = numbers(data.qpos), numbers(data.qvel)
        self._ctrl, self._act = numbers(data.ctrl), numbers(data.act)
        self._left = tuple(_find(model, prefix, name, drive.forward[name]) for name in drive.left)
        self._right = tuple(_find(model, prefix, name, drive.forward[name]) for name in drive.right)
        self._left_count, self._right_count = len(self._left), len(self._right)
        self._all = self._left + self._right

    def command(self, left: float, right: float) -> None:
        """Wheel speeds in rad/s."""
        ctrl = self._ctrl
        for _, _, command, _, forward, _, _ in self._left:
            ctrl[command] = left * forward
        for _, _, command, _, forward, _, _ in self._right:
            ctrl[command] = right * forward

    def settle(self) -> None:
        """Stand still where the wheels are now, as if they had never been told to turn."""
        for position, speed, _, state, _, _, _ in self._all:
            self._qvel[speed] = 0.0
            self._act[state] = self._qpos[position]

    def angles(self) -> tuple[float, float]:
        """Mean angle of each side's wheels in rad."""
        qpos = self._qpos
        left = right = 0.0
        for position, _, _, _, forward, _, _ in self._left:
            left += qpos[position] * forward
        for position, _, _, _, forward, _, _ in self._right:
            right += qpos[position] * forward
        return left / self._left_count, right / self._right_count

    def unwind(self) -> None:
        """A blocked wheel's servo must not store up the way it did not go."""
        qpos, qvel, act = self._qpos, self._qvel, self._act
        for position, speed, _, state, _, reach, lag in self._all:
            middle = qpos[position] + lag * qvel[speed]
            ahead = act[state] - middle
            if ahead > reach:
                act[state] = middle + reach
            elif ahead < -reach:
                act[state] = middle - reach


def _find(model: Any, prefix: str, joint: str, forward: float) -> _Wheel:  # noqa: ANN401
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, prefix + joint)
    actuator = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, prefix + joint)
    stiffness = float(model.actuator_gainprm[actuator, 0])
    damping = -float(model.actuator_biasprm[actuator, 2])
    torque = float(model.actuator_forcerange[actuator, 1])
    return _Wheel(
        position=int(model.jnt_qposadr[index]),
        speed=int(model.jnt_dofadr[index]),
        command=actuator,
        state=int(model.actuator_actadr[actuator]),
        forward=forward,
        reach=2.0 * torque / stiffness,
        lag=damping / stiffness,
    )
