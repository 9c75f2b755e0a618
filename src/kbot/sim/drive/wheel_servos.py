"""Sets and reads the drive wheels of a robot in the engine."""

from __future__ import annotations

from typing import Any

import mujoco

from kbot.kinematics.drive.drive import DifferentialDrive
from kbot.sim.engine.arrays import numbers

ServoState = tuple[Any, ...]  # steered wheels and those of a differential drive have different states


class WheelServos:
    """Commands and angles of both sides' wheels, forwards positive.

    The methods that run every control period loop over plain tuples, because they take a considerable part
    of the time that a simulation spends outside the engine.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        drive: DifferentialDrive,
        believed: DifferentialDrive,
        prefix: str,
    ) -> None:
        """`believed` is the drive with the sizes that the robot's controller uses."""
        self._qpos, self._qvel = numbers(data.qpos), numbers(data.qvel)
        self._ctrl, self._act = numbers(data.ctrl), numbers(data.act)
        self._wheel_speeds = believed.wheel_speeds
        places = []
        commands: tuple[list[tuple[int, float]], list[tuple[int, float]]] = ([], [])
        for side, names in enumerate((drive.left, drive.right)):
            for name in names:
                index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, prefix + name)
                actuator = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, prefix + name)
                forward = drive.forward[name]
                share = forward / len(names)
                shares = (share, 0.0) if side == 0 else (0.0, share)
                position, speed = int(model.jnt_qposadr[index]), int(model.jnt_dofadr[index])
                state = int(model.actuator_actadr[actuator])
                places.append((position, speed, state, *shares, *slack(model, actuator)))
                commands[side].append((actuator, forward))
        self._places = tuple(places)
        """For each wheel: the indices of its position, velocity and servo state, its share in the left and in
        the right angle, and the `reach` (rad) and `lag` (s) that `slack` returns."""
        self._left, self._right = map(tuple, commands)
        """For each wheel of a side: the index of its actuator, and the sign of its axis."""
        self.state: ServoState = ()
        """Empty, because the engine holds the wheel angles. Steered wheels have a state of their own."""

    def move(self, x: float, y: float, yaw: float) -> bool:
        """Drive at a twist of the axle's middle, without its sideways speed `y`.

        Returns whether the command stays the same for this twist.
        """
        ctrl = self._ctrl
        left, right = self._wheel_speeds(x, yaw)
        for actuator, forward in self._left:
            ctrl[actuator] = left * forward
        for actuator, forward in self._right:
            ctrl[actuator] = right * forward
        return True

    def speeds(self) -> tuple[float, float]:
        """Mean speed of each side's wheels in rad/s."""
        left = right = 0.0
        for _, speed, _, to_left, to_right, _, _ in self._places:
            left += self._qvel[speed] * to_left
            right += self._qvel[speed] * to_right
        return left, right

    def settle(self) -> None:
        """Stop the wheels at their current angles and clear their servos' state."""
        for _, speed, state, _, _, _, _ in self._places:
            self._qvel[speed] = 0.0
            self._act[state] = 0.0

    def angles(self) -> tuple[float, float]:
        """Mean angle of each side's wheels in rad."""
        left = right = 0.0
        for position, _, _, to_left, to_right, _, _ in self._places:
            angle = self._qpos[position]
            left += angle * to_left
            right += angle * to_right
        return left, right

    def roll(self) -> tuple[float, float]:
        """The angles. Also limits the wind-up of a blocked wheel's servo."""
        qpos, qvel, act = self._qpos, self._qvel, self._act
        left = right = 0.0
        for position, speed, state, to_left, to_right, reach, lag in self._places:
            angle = qpos[position]
            left += angle * to_left
            right += angle * to_right
            middle = lag * qvel[speed]
            ahead = act[state] - middle
            if ahead > reach:
                act[state] = middle + reach
            elif ahead < -reach:
                act[state] = middle - reach
        return left, right


def slack(model: mujoco.MjModel, actuator: int) -> tuple[float, float]:
    """`reach` and `lag` of a servo, which limit its wind-up.

    The servo's state is how far its wheel is behind: in steady motion its speed times `lag` (s). From there,
    the state may be `reach` (rad) off: twice what saturates the torque.
    """
    stiffness = float(model.actuator_gainprm[actuator, 0])
    damping = -float(model.actuator_biasprm[actuator, 2])
    torque = float(model.actuator_forcerange[actuator, 1])
    return 2.0 * torque / stiffness, damping / stiffness
