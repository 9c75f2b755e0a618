"""One robot within a simulation: its commands in, its motion and joints out."""

from __future__ import annotations

import math
from typing import Any, Protocol

import mujoco
import numpy as np

from kbot.kinematics.differential_drive import DifferentialDrive, NoDrive
from kbot.kinematics.frames import FrameTree
from kbot.kinematics.odometry import PlanarPose, PlanarTwist
from kbot.kinematics.transform import Transform
from kbot.model import Robot
from kbot.sim.drive import TwistController
from kbot.sim.drive_settings import DriveSettings
from kbot.sim.holds import JointHolds
from kbot.sim.inertia import held_joints
from kbot.sim.joints import rest
from kbot.sim.motion import Motion, WheelOdometry
from kbot.sim.numbers import is_finite, numbers
from kbot.sim.recipe import SLEW_PERIOD, WATCHDOG
from kbot.sim.servo import speed_limit
from kbot.sim.wheel_servos import WheelServos
from kbot.sim.world_builder import body_pose
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean


class Host(Protocol):
    """The simulation a robot is in."""

    def refresh(self) -> None:
        """Bring the engine's frames up to the positions of now."""
        ...

    def take_command(
        self, robot: SimulatedRobot, linear: float, angular: float, watchdog: float | None
    ) -> None:
        """Take a twist that holds, or, with a watchdog (s), is taken for lost after that time."""
        ...


class SimulatedRobot:
    """A robot in a simulation: commands in; motion, joints and links out."""

    holds: JointHolds

    def __init__(
        self,
        name: str,
        robot: Robot,
        drive: DifferentialDrive | NoDrive,
        settings: DriveSettings | None,
        timestep: float,
        host: Host,
    ) -> None:
        """`settings`: how the robot's own controller drives; None for one that cannot drive."""
        self.name = name
        self.robot = robot
        self._host = host
        self.drive = drive
        self.base = drive.base if isinstance(drive, DifferentialDrive) else _base(robot)
        self.base_from_root = FrameTree(robot).pose(robot.root, self.base)
        """Fixed, for the base hangs rigidly on the root."""
        held = held_joints(robot)
        self.held = {joint.name: rest(joint) for joint in robot.movable_joints if joint.name in held}
        """Joints that stand still for what they move weighs nothing, and where (rad or m)."""
        self._no_speed = dict.fromkeys(self.held, 0.0)
        self._is_bound = False
        self.is_slewing = False
        self._slew_steps = max(1, round(SLEW_PERIOD / timestep))
        self._next_slew = 0
        self.settings = settings
        self._controller: TwistController | None = None
        self._odometry: WheelOdometry | None = None
        self._reckoned: DifferentialDrive | None = None
        if isinstance(drive, DifferentialDrive) and settings is not None:
            reckoned = self._reckoned = settings.reckoned(drive)
            fastest = min(speed_limit(robot, joint) for joint in drive.joints)
            period = self._slew_steps * timestep
            self._controller = TwistController(reckoned, settings.limits, fastest, period)
            self._odometry = WheelOdometry(reckoned)
        self._turns = 0
        self._is_left = True

    def bind(self, model: Any, data: Any) -> None:  # noqa: ANN401 - the engine has no types
        """Look up this robot's places in a compiled model; joints that are held stay so."""
        held = self.holds.engaged if self._is_bound else frozenset()
        self._is_bound = True
        self._model, self._data = model, data
        self._qpos, self._qvel = numbers(data.qpos), numbers(data.qvel)
        self._force = numbers(data.qfrc_actuator)
        prefix = f"{self.name}/"
        body, joint = mujoco.mjtObj.mjOBJ_BODY, mujoco.mjtObj.mjOBJ_JOINT
        self._bodies: dict[str, int] = {
            link: mujoco.mj_name2id(model, body, prefix + link) for link in self.robot.links
        }
        movable = [j.name for j in self.robot.movable_joints if j.name not in self.held]
        indices = {name: mujoco.mj_name2id(model, joint, prefix + name) for name in movable}
        self._joints = {
            name: (int(model.jnt_qposadr[index]), int(model.jnt_dofadr[index]))
            for name, index in indices.items()
        }
        root = mujoco.mj_name2id(model, joint, prefix)
        self.root_qpos = int(model.jnt_qposadr[root]) if root >= 0 else -1
        self._root_dof = int(model.jnt_dofadr[root]) if root >= 0 else -1
        driven = self.drive.joints if isinstance(self.drive, DifferentialDrive) else ()
        self.holds = JointHolds(model, data, prefix, [name for name in self._joints if name not in driven])
        self.holds.engage_only(held)
        self._servos: WheelServos | None = None
        if isinstance(self.drive, DifferentialDrive):
            self._servos = WheelServos(model, data, self.drive, prefix)

    def reset(self) -> None:
        """Forget commands and odometry; the engine's state is the simulation's to reset."""
        if self._controller is not None:
            self._controller.reset()
        if self._odometry is not None:
            self._odometry.reset()
        self.is_slewing, self._next_slew = False, 0
        self.holds.release_all()
        self._turns, self._is_left = 0, self._yaw() >= 0.0

    @property
    def controller(self) -> TwistController:
        """The controller of a robot that can drive.

        Raises:
            KbotError: it cannot; the reason is said.
        """
        if self._controller is None:
            reason = self.drive.reason if isinstance(self.drive, NoDrive) else ""
            raise KbotError(f"robot '{self.name}' cannot drive: {reason}")
        return self._controller

    @property
    def can_drive(self) -> bool:
        return self._controller is not None

    def cmd_vel(self, linear: float, angular: float) -> None:
        """Drive forward at `linear` m/s while turning at `angular` rad/s, until told otherwise.

        Raises:
            KbotError: the robot cannot drive (the reason is said), or a number is not finite.
        """
        self._host.take_command(self, linear, angular, None)

    def command(self, linear: float, angular: float, watchdog: float | None = None) -> None:
        """As `cmd_vel`, but taken for lost, and the robot stopped, `watchdog` seconds of simulated time
        after the last one (half a second, unless the robot's controller says otherwise): for commands
        that come from outside, by topic or page."""
        if watchdog is None:
            watchdog = self.settings.watchdog if self.settings is not None else WATCHDOG
        self._host.take_command(self, linear, angular, watchdog)

    def obey(self, linear: float, angular: float, deadline: int | None) -> bool:
        """Take a twist (m/s, rad/s) that holds until the step `deadline`; whether `slew` has to be called.

        Raises:
            KbotError: the robot cannot drive, or a number is not finite.
        """
        controller = self._controller or self.controller
        if controller.wanted == (linear, angular):
            controller.deadline = deadline
        elif controller.command(linear, angular, deadline):
            self.is_slewing = True
        return self.is_slewing

    def slew(self, step: int) -> int:
        """Hand the wheels their next speeds when that is due; steps until it is due again, 0 when the
        wheels have what was commanded."""
        controller, servos = self._controller, self._servos
        if controller is None or servos is None:
            return 0
        if step >= self._next_slew:
            left, right, settled = controller.advance()
            servos.command(left, right)
            if settled:
                self.is_slewing = False
                return 0
            self._next_slew = step + self._slew_steps
        return self._next_slew - step

    def hold(self, joint: str, position: float) -> None:
        """Hold a joint at a position (rad or m) by a servo, within its effort limit.

        Raises:
            KbotError: no such joint, a joint that drives or follows another, or a number that is none.
        """
        self._require_joint(joint)
        if joint not in self.holds.joints:
            drives = isinstance(self.drive, DifferentialDrive) and joint in self.drive.forward
            why = "drives the robot" if drives else "follows another joint"
            raise KbotError(f"joint '{joint}' {why} and cannot be held")
        if not is_finite(position):
            raise KbotError(f"a joint's position is a finite number, not {position!r}")
        self.holds.hold(joint, position)

    def release(self, joint: str) -> None:
        """Let a held joint move freely again. Raises KbotError for an unknown joint."""
        self._require_joint(joint)
        self.holds.release(joint)

    def tick(self, step: int) -> bool:
        """Called every control period: reckon odometry, keep the servos from winding up, and drop a
        command that has grown old. Returns whether there is a new twist to slew to."""
        if self.root_qpos >= 0:
            self._count_turns()
        servos, odometry, controller = self._servos, self._odometry, self._controller
        if servos is None or odometry is None or controller is None:
            return False
        left, right = servos.angles()
        odometry.update(left, right)
        servos.unwind()
        if controller.deadline is not None and step >= controller.deadline:
            return self.obey(0.0, 0.0, None)
        return False

    def _count_turns(self) -> None:
        """Notice when the heading passes from half a turn left to half a turn right, or back."""
        q, at = self._qpos, self.root_qpos
        is_left = q[at + 3] * q[at + 6] + q[at + 4] * q[at + 5] >= 0.0
        if is_left is not self._is_left:
            self._is_left = is_left
            if abs(self._yaw()) > math.pi / 2:
                self._turns += -1 if is_left else 1

    def _yaw(self) -> float:
        """Heading of the root in rad, within half a turn."""
        if self.root_qpos < 0:
            return 0.0
        q, at = self._qpos, self.root_qpos
        w, x, y, z = q[at + 3], q[at + 4], q[at + 5], q[at + 6]
        return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))

    # what can be read

    @property
    def odometry(self) -> Motion:
        """What the wheels tell: `pose` of the base in the odometry frame, `twist` in its own."""
        reckoned = self._reckoned
        if self._odometry is None or self._servos is None or reckoned is None:
            return Motion(PlanarPose(), PlanarTwist())
        linear, angular = reckoned.twist(*reckoned.wheel_angles(self.joint_velocities))
        return Motion(self._odometry.pose(*self._servos.angles()), self._odometry.twist(linear, angular))

    @property
    def odom_from_root(self) -> Transform:
        """Where the odometry has the root link: the base upright on the ground."""
        pose = self.odometry.pose
        return Transform.from_xyz_rpy((pose.x, pose.y, 0.0), (0.0, 0.0, pose.yaw)) @ self.base_from_root

    @property
    def ground_truth(self) -> Motion:
        """Where the base truly is in the world, its yaw with full turns counted, and its twist."""
        root, base = self.link_pose(self.robot.root), self.link_pose(self.base)
        x, y, _ = base.translation
        full = 2.0 * math.pi
        counted = self._yaw() + full * self._turns + (root.inverse() @ base).yaw
        yaw = base.yaw + full * round((counted - base.yaw) / full)
        spin, speed = self.link_velocity(self.base)
        return Motion(PlanarPose(float(x), float(y), yaw), PlanarTwist(speed[0], speed[1], spin[2]))

    @property
    def joint_positions(self) -> dict[str, float]:
        """rad or m, of every joint with a position."""
        return {name: self._qpos[at[0]] for name, at in self._joints.items()} | self.held

    @property
    def joint_velocities(self) -> dict[str, float]:
        """rad/s or m/s."""
        return {name: self._qvel[at[1]] for name, at in self._joints.items()} | self._no_speed

    @property
    def joint_efforts(self) -> dict[str, float]:
        """What the servos exert, in N m or N."""
        return {name: self._force[at[1]] for name, at in self._joints.items()} | self._no_speed

    @property
    def links(self) -> tuple[str, ...]:
        return tuple(self._bodies)

    def link_pose(self, link: str) -> Transform:
        """`world_from_link`. Raises KbotError for a link that the robot does not have."""
        self._host.refresh()
        return body_pose(self._data, self.body(link))

    def link_poses(self) -> dict[str, Transform]:
        """`world_from_link` of every link."""
        return {link: self.link_pose(link) for link in self._bodies}

    def link_velocity(self, link: str) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """Turning speeds in rad/s and speeds in m/s of a link's origin, along the link's axes."""
        self._host.refresh()
        velocity = np.zeros(6)
        kind = mujoco.mjtObj.mjOBJ_XBODY
        mujoco.mj_objectVelocity(self._model, self._data, kind, self.body(link), velocity, 1)
        wx, wy, wz, x, y, z = velocity.tolist()
        return (wx, wy, wz), (x, y, z)

    def body(self, link: str) -> int:
        """The engine's index of a link. Raises KbotError for a link that the robot does not have."""
        if link not in self._bodies:
            hint = did_you_mean(link, self._bodies)
            raise KbotError(f"robot '{self.name}' has no link '{link}'" + (f": {hint}" if hint else ""))
        return self._bodies[link]

    def stand_at(self, x: float, y: float, yaw: float, height: float) -> None:
        """Stand still with the base at x, y (m) and heading (rad) of the world, upright, the root at
        `height`; commands go on. The engine's frames must be up to date."""
        if self.root_qpos < 0:
            raise KbotError(f"robot '{self.name}' is fixed to the world and cannot be moved")
        root_from_base = self.base_from_root.inverse()
        upright = Transform.from_xyz_rpy((0.0, 0.0, 0.0), (0.0, 0.0, yaw - root_from_base.yaw))
        bx, by, _ = upright.apply(root_from_base.translation).tolist()
        qx, qy, qz, qw = upright.quaternion_xyzw
        for index, value in enumerate((x - bx, y - by, height, qw, qx, qy, qz)):
            self._qpos[self.root_qpos + index] = value
        for index in range(6):
            self._qvel[self._root_dof + index] = 0.0
        if self._servos is not None:
            self._servos.settle()
        self._turns, self._is_left = math.floor((yaw + math.pi) / (2.0 * math.pi)), self._yaw() >= 0.0

    def take_over(self, other: SimulatedRobot) -> None:
        """Go on as another robot did: its odometry and what it was told. Joints have been set before."""
        if self._odometry is not None and self._servos is not None:
            self._servos.settle()
            self._odometry.start_at(other.odometry.pose, *self._servos.angles())
        mine, theirs = self._controller, other._controller
        if mine is not None and theirs is not None:
            self.obey(*theirs.target, theirs.deadline)

    def set_position(self, joint: str, position: float) -> None:
        """Put a joint somewhere at once, its speed left as it is. Raises KbotError for an unknown joint."""
        self._require_joint(joint)
        self._qpos[self._joints[joint][0]] = position

    def set_twist(self, linear: tuple[float, float, float], angular: tuple[float, float, float]) -> None:
        """See `Simulation.set_twist`."""
        if self.root_qpos < 0:
            raise KbotError(f"robot '{self.name}' is fixed to the world and cannot be moved")
        turn = self.link_pose(self.robot.root).rotation.T
        for index, value in enumerate((*linear, *(turn @ np.array(angular)).tolist())):
            self._qvel[self._root_dof + index] = value

    def restart_odometry(self) -> None:
        """Reckon from zero, from where the robot and its wheels are now."""
        if self._odometry is not None and self._servos is not None:
            self._odometry.reset(*self._servos.angles())

    def dof(self, joint: str) -> int:
        """The engine's place of a joint's speed. Raises KbotError for an unknown joint."""
        self._require_joint(joint)
        return self._joints[joint][1]

    def _require_joint(self, joint: str) -> None:
        if joint in self.held:
            raise KbotError(f"joint '{joint}' is held still: what it moves weighs nothing")
        if joint not in self._joints:
            hint = did_you_mean(joint, self._joints)
            raise KbotError(
                f"robot '{self.name}' has no joint '{joint}' with a position" + (f": {hint}" if hint else "")
            )

    def save(self) -> tuple[Any, ...]:
        """What a saved state holds beside the engine's own."""
        controller = self._controller
        commanded = controller.save() if controller else None
        odometry = self._odometry.state if self._odometry else None
        slewing = self.is_slewing, self._next_slew
        return commanded, slewing, odometry, self._turns, self._is_left, self.holds.engaged

    def restore(self, saved: tuple[Any, ...]) -> None:
        """Take back what `save` gave; the engine's own state has been restored before."""
        commanded, slewing, odometry, self._turns, self._is_left, engaged = saved
        self.is_slewing, self._next_slew = slewing
        if self._controller is not None and commanded is not None:
            self._controller.restore(commanded)
        if self._odometry is not None and odometry is not None:
            self._odometry.state = odometry
        self.holds.engage_only(engaged)


def _base(robot: Robot) -> str:
    """The frame that stands for a robot without wheels."""
    return "base_footprint" if "base_footprint" in robot.links else robot.root
