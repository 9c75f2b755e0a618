"""Reads and sets the poses and velocities of a robot's links and joints in the engine."""

from __future__ import annotations

import math

import mujoco
import numpy as np

from kbot.kinematics.angles import FULL_TURN
from kbot.kinematics.drive.drive import DifferentialDrive, HolonomicDrive
from kbot.kinematics.frames import FrameTree
from kbot.kinematics.planar_pose import PlanarTwist
from kbot.kinematics.transform import Transform
from kbot.messages.types import yaw_of
from kbot.sim.engine.arrays import numbers
from kbot.sim.engine.base_servo import AXES
from kbot.sim.engine.engine import Engine
from kbot.sim.engine.inertia import held_joints
from kbot.sim.engine.joints import resistance, rest
from kbot.sim.engine.motors import EffortTerm, Motors
from kbot.sim.engine.world_builder import body_pose
from kbot.sim.preparation import Prepared
from kbot.sim.wheel_odometry import Motion
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean, suggest_or_list

_TURNS = 1e-3
"""Speed in rad/s above which a joint turns. Below it, noise would decide the direction of its friction."""


class RobotBody:
    """The links and joints of one robot that is in the engine."""

    def __init__(self, prepared: Prepared, engine: Engine) -> None:
        robot = self.robot = prepared.robot
        self._name = prepared.naming.name
        self._base = prepared.base
        drive = self._drive = prepared.drive
        self._driving = frozenset(drive.joints if isinstance(drive, DifferentialDrive) else ())
        self._engine = engine
        self.base_from_root = FrameTree(robot).pose(robot.root, self._base)
        """Constant, because the base is rigidly connected to the root."""
        root_from_base = self.base_from_root.inverse()
        self._root_from_base = root_from_base.rotation.tolist()
        self._base_in_root = root_from_base.translation.tolist()
        self._base_yaw = root_from_base.yaw
        held = held_joints(robot)
        self.held = {joint.name: rest(joint) for joint in robot.movable_joints if joint.name in held}
        """Joints that cannot move because their links have no mass, with their positions (rad or m)."""
        self._no_speed = dict.fromkeys(self.held, 0.0)
        self._turns = 0
        self._is_left = True
        self.bind()

    def bind(self) -> None:
        """Find the links and joints in the engine's model."""
        model, data = self._engine.model, self._engine.data
        self._qpos, self._qvel = numbers(data.qpos), numbers(data.qvel)
        self._qacc = numbers(data.qacc)
        body, joint = mujoco.mjtObj.mjOBJ_BODY, mujoco.mjtObj.mjOBJ_JOINT
        self._bodies: dict[str, int] = {
            link: mujoco.mj_name2id(model, body, self.prefix + link) for link in self.robot.links
        }
        movable = [j.name for j in self.robot.movable_joints if j.name not in self.held]
        indices = {name: mujoco.mj_name2id(model, joint, self.prefix + name) for name in movable}
        self._joints = {
            name: (int(model.jnt_qposadr[index]), int(model.jnt_dofadr[index]))
            for name, index in indices.items()
        }
        self._overcome = {
            name: friction
            for name, (_, dof) in self._joints.items()
            if (friction := resistance(self.robot.joints[name])[1] - float(model.dof_frictionloss[dof])) > 0.0
        }
        """The dry friction in N m of the joints whose servos overcome it, which the engine leaves out."""
        root = mujoco.mj_name2id(model, joint, self.prefix)
        self.root_qpos = int(model.jnt_qposadr[root]) if root >= 0 else -1
        self._root_dof = int(model.jnt_dofadr[root]) if root >= 0 else -1
        terms = self._effort_terms()
        motors = {name: (dof, terms[name]) for name, (_, dof) in self._joints.items()}
        self._motors = Motors(model, data, motors, pushes=not isinstance(self._drive, HolonomicDrive))

    @property
    def prefix(self) -> str:
        """The prefix of the names of its bodies and joints in the engine."""
        return f"{self._name}/"

    # reading

    @property
    def ground_truth(self) -> Motion:
        """The base's true pose in the world and its twist in its own frame.

        It is computed from the root's position and velocity, which is ten times as fast as `link_pose` and
        `link_velocity`, because controllers and policies read it at every command.
        """
        if self.root_qpos < 0:
            base = self.link_pose(self._base)
            x, y, _ = base.translation.tolist()
            return Motion.of((x, y, base.yaw), PlanarTwist())
        px, py, _, w, x, y, z = self.root_place
        (ax, bx, cx), (ay, by, cy), (az, bz, cz) = self._root_from_base
        tx, ty, tz = self._base_in_root
        xx, xy, xz = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)
        yx, yy, yz = 2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)
        zx, zy, zz = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)
        place_x, place_y = px + xx * tx + xy * ty + xz * tz, py + yx * tx + yy * ty + yz * tz
        yaw = math.atan2(yx * ax + yy * ay + yz * az, xx * ax + xy * ay + xz * az)
        heading = math.atan2(yx, xx) + FULL_TURN * self._turns
        yaw += FULL_TURN * round((heading + self._base_yaw - yaw) / FULL_TURN)
        v, at = self._qvel, self._root_dof
        vx, vy, vz, wx, wy, wz = v[at], v[at + 1], v[at + 2], v[at + 3], v[at + 4], v[at + 5]
        # the velocity of the base's origin in the axes of the root
        ux = xx * vx + yx * vy + zx * vz + wy * tz - wz * ty
        uy = xy * vx + yy * vy + zy * vz + wz * tx - wx * tz
        uz = xz * vx + yz * vy + zz * vz + wx * ty - wy * tx
        forward, left = ax * ux + ay * uy + az * uz, bx * ux + by * uy + bz * uz
        turn = cx * wx + cy * wy + cz * wz
        return Motion.of((place_x, place_y, yaw), PlanarTwist(forward, left, turn))

    @property
    def root_place(self) -> tuple[float, float, float, float, float, float, float]:
        """`world_from_root` as x, y, z in m and the quaternion w, x, y, z. Not for a robot that is fixed.

        It is ten times as fast as `link_pose`, and current without `Engine.refresh`.
        """
        q, at = self._qpos, self.root_qpos
        return q[at], q[at + 1], q[at + 2], q[at + 3], q[at + 4], q[at + 5], q[at + 6]

    @property
    def root_velocity(self) -> tuple[float, float, float]:
        """Velocity of the root's origin in m/s, in world axes. Not for a robot that is fixed."""
        v, at = self._qvel, self._root_dof
        return v[at], v[at + 1], v[at + 2]

    @property
    def heading(self) -> float:
        """Heading of the root in rad. It counts full turns."""
        return self._yaw() + FULL_TURN * self._turns

    @property
    def joint_positions(self) -> dict[str, float]:
        """Position in rad or m of every joint that has one."""
        return {name: self._qpos[at[0]] for name, at in self._joints.items()} | self.held

    @property
    def joint_velocities(self) -> dict[str, float]:
        """rad/s or m/s."""
        return {name: self._qvel[at[1]] for name, at in self._joints.items()} | self._no_speed

    @property
    def joint_efforts(self) -> dict[str, float]:
        """The effort in N m or N of each joint, as `joint_effort`."""
        return {name: self.joint_effort(name) for name in self._joints} | self._no_speed

    def joint_effort(self, joint: str) -> float:
        """The effort in N m or N of the motor of a joint that can move, over the last step.

        For a driving joint it is the torque on the wheel: the motor exerts that besides what its own inertia,
        and the damping and dry friction of the joint, take. For others it is all that the servo exerts.
        """
        return self._motors.on_link(joint) if joint in self._driving else self._motors.effort(joint)

    def joint_power(self, joint: str) -> float:
        """The mean power in W of a joint's effort over the last step."""
        dof = self._joints[joint][1]
        half_a_step = self._engine.timestep / 2.0
        return self.joint_effort(joint) * (self._qvel[dof] - half_a_step * self._qacc[dof])

    def motor_torque(self, joint: str) -> float:
        """All the torque in N m that the motor of a driving joint exerts, which its effort limit limits."""
        friction, speed = self._overcome.get(joint, 0.0), self._qvel[self._joints[joint][1]]
        overcome = math.copysign(friction, speed) if abs(speed) > _TURNS else 0.0
        return self._motors.effort(joint) + overcome

    def _effort_terms(self) -> dict[str, list[EffortTerm]]:
        """What exerts the effort of each joint."""
        terms = {
            name: [EffortTerm(self.prefix + name, 1.0), EffortTerm(f"{self.prefix}{name}:damping", 1.0)]
            for name in self._joints
        }
        if isinstance(self._drive, HolonomicDrive):
            # The wheels slide, and a servo moves the base. Its force that accelerates the base is left out,
            # because accelerating the armatures of the wheels takes that effort already. The rest, such as
            # the weight on a slope, is divided among the wheels by virtual work.
            model, root = self._engine.model, self._root_dof
            mass = float(model.body_subtreemass[self.index(self.robot.root)])
            masses = (mass, mass, float(model.dof_M0[root + 5])) if root >= 0 else (0.0, 0.0, 0.0)
            to_twist = np.linalg.pinv(self._drive.wheels_from_twist).T.tolist()
            for name, row in zip(self._drive.joints, to_twist, strict=True):
                terms[name] += [
                    EffortTerm(self.prefix + AXES[axis], row[axis], masses[axis]) for axis in range(3)
                ]
        return terms

    @property
    def links(self) -> tuple[str, ...]:
        return tuple(self._bodies)

    @property
    def joints(self) -> tuple[str, ...]:
        """The joints that can move."""
        return tuple(self._joints)

    def link_pose(self, link: str) -> Transform:
        """`world_from_link`. Raises KbotError for an unknown link."""
        self._engine.refresh()
        return body_pose(self._engine.data, self.index(link))

    def link_poses(self) -> dict[str, Transform]:
        """`world_from_link` of every link."""
        return {link: self.link_pose(link) for link in self._bodies}

    def link_velocity(self, link: str) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """Angular velocity in rad/s and linear velocity in m/s of a link's origin, in the link's axes."""
        self._engine.refresh()
        velocity = np.zeros(6)
        kind = mujoco.mjtObj.mjOBJ_XBODY
        mujoco.mj_objectVelocity(self._engine.model, self._engine.data, kind, self.index(link), velocity, 1)
        wx, wy, wz, x, y, z = velocity.tolist()
        return (wx, wy, wz), (x, y, z)

    def index(self, link: str) -> int:
        """The engine's index of a link. Raises KbotError for an unknown link."""
        if not isinstance(link, str) or link not in self._bodies:
            hint = suggest_or_list(str(link), self._bodies)
            raise KbotError(f"robot '{self._name}' has no link '{link}': {hint}")
        return self._bodies[link]

    def dof(self, joint: str) -> int:
        """The engine's index of a joint's velocity. Raises KbotError for an unknown joint."""
        self.require_joint(joint)
        return self._joints[joint][1]

    def servo_command(self, joint: str) -> float:
        """The command of a joint's servo, for a driving wheel its speed in rad/s."""
        kind = mujoco.mjtObj.mjOBJ_ACTUATOR
        index = mujoco.mj_name2id(self._engine.model, kind, self.prefix + joint)
        return float(self._engine.data.ctrl[index])

    # writing (the callers write the journal)

    def stand_at(self, x: float, y: float, yaw: float, height: float) -> None:
        """Place the base upright and at rest at x, y (m) and yaw (rad), and the root at `height`."""
        self.require_free()
        root_from_base = self.base_from_root.inverse()
        upright = Transform.from_xyz_rpy((0.0, 0.0, 0.0), (0.0, 0.0, yaw - root_from_base.yaw))
        bx, by, _ = upright.apply(root_from_base.translation).tolist()
        qx, qy, qz, qw = upright.quaternion_xyzw
        for index, value in enumerate((x - bx, y - by, height, qw, qx, qy, qz)):
            self._qpos[self.root_qpos + index] = value
        for index in range(6):
            self._qvel[self._root_dof + index] = 0.0
        self._turns = round((yaw - root_from_base.yaw - self._yaw()) / FULL_TURN)
        self._is_left = self._yaw() >= 0.0

    def set_position(self, joint: str, position: float) -> None:
        """Set a joint's position and keep its velocity. Raises KbotError for an unknown joint."""
        self.require_joint(joint)
        self._qpos[self._joints[joint][0]] = position

    def set_twist(self, linear: tuple[float, float, float], angular: tuple[float, float, float]) -> None:
        """Set the velocity of the root link: m/s and rad/s in world axes.

        Raises:
            KbotError: the robot is fixed to the world.
        """
        self.require_free()
        turn = self.link_pose(self.robot.root).rotation.T
        for index, value in enumerate((*linear, *(turn @ np.array(angular)).tolist())):
            self._qvel[self._root_dof + index] = value

    def start_counting_turns(self) -> None:
        self._turns, self._is_left = 0, self._yaw() >= 0.0

    def count_turns(self) -> None:
        """Count a turn when the heading passes from 180 degrees left to 180 degrees right, or back."""
        q, at = self._qpos, self.root_qpos
        is_left = q[at + 3] * q[at + 6] + q[at + 4] * q[at + 5] >= 0.0
        if is_left is not self._is_left:
            self._is_left = is_left
            if abs(self._yaw()) > math.pi / 2:
                self._turns += -1 if is_left else 1

    def save(self) -> tuple[int, bool]:
        """The state for `restore`. The engine does not count full turns."""
        return self._turns, self._is_left

    def restore(self, saved: tuple[int, bool]) -> None:
        self._turns, self._is_left = saved

    def _yaw(self) -> float:
        """Heading of the root in rad, from -pi to pi."""
        if self.root_qpos < 0:
            return 0.0
        q, at = self._qpos, self.root_qpos
        return yaw_of(q[at + 4], q[at + 5], q[at + 6], q[at + 3])

    def require_free(self) -> None:
        """Raises KbotError for a robot that is fixed to the world."""
        if self.root_qpos < 0:
            raise KbotError(f"robot '{self._name}' is fixed to the world and cannot be moved")

    def require_joint(self, joint: str) -> None:
        if not isinstance(joint, str):
            raise KbotError(f"the name of a joint must be a string, not {joint!r}")
        if joint in self.held:
            raise KbotError(f"joint '{joint}' cannot move, because its child has no mass")
        if joint not in self._joints:
            hint = did_you_mean(joint, self._joints)
            raise KbotError(
                f"robot '{self._name}' has no revolute, continuous or prismatic joint '{joint}'"
                + (f": {hint}" if hint else "")
            )
