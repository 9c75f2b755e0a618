"""One robot of a simulation: it receives commands and reports its motion and joint states."""

from __future__ import annotations

import reprlib
from collections.abc import Iterator, Mapping, Sequence

from kbot.brief import Brief
from kbot.kinematics.drive.drive import DifferentialDrive, HolonomicDrive, NoDrive, SteeredDrive
from kbot.kinematics.planar_pose import PlanarPose, PlanarTwist
from kbot.kinematics.transform import Transform
from kbot.sim.command_delivery import CommandDelivery
from kbot.sim.drive.drive_controller import DriveController, SavedDrive
from kbot.sim.engine.engine import Engine
from kbot.sim.engine.joints import rest
from kbot.sim.joint_control.kinds import Interface
from kbot.sim.joint_control.servos import SavedServos
from kbot.sim.joint_control.trajectory import joint_command, trajectory_points
from kbot.sim.journal import Journal
from kbot.sim.numbers import is_finite
from kbot.sim.preparation import Prepared
from kbot.sim.recipe import SLEW_PERIOD, STEERING_PERIOD, WATCHDOG
from kbot.sim.robot_body import RobotBody
from kbot.sim.robot_joints import RobotJoints
from kbot.sim.wheel_odometry import Motion
from kbot.text import KbotError

SavedRobot = tuple[SavedDrive | None, int, tuple[int, bool], SavedServos]


class SimulatedRobot(Brief):
    """A robot in a simulation: its `body`, its `joints`, and its `wheels` if it can drive."""

    def __init__(
        self, prepared: Prepared, engine: Engine, commands: CommandDelivery, journal: Journal
    ) -> None:
        self._engine, self._commands, self._journal = engine, commands, journal
        self.robot = prepared.robot
        self.naming = prepared.naming
        self.name = prepared.naming.name
        self.base = prepared.base
        """The link whose motion on the plane odometry and ground truth describe."""
        self.drive = prepared.drive
        """How the robot drives, or why it cannot."""
        self.settings = prepared.settings
        period = STEERING_PERIOD if isinstance(prepared.drive, SteeredDrive) else SLEW_PERIOD
        self._period = max(1, round(period / engine.timestep))
        """Steps between two commands to the servos."""
        seconds = self._period * engine.timestep
        self.body = RobotBody(prepared, engine)
        self.joints = RobotJoints(prepared, self.body, engine, seconds, journal.report)
        self.wheels: DriveController | None = None
        if isinstance(prepared.drive, DifferentialDrive) and prepared.settings is not None:
            self.wheels = DriveController(
                prepared.robot,
                prepared.drive,
                prepared.settings,
                engine,
                self.body.prefix,
                seconds,
                lambda: self.body.ground_truth,
            )
        self._next_advance = 0
        self.jumps = 0
        """How often the robot was moved to another pose. Resets count too."""

    # commands

    def cmd_vel(self, linear: float, angular: float, lateral: float = 0.0) -> None:
        """Drive forward at `linear` m/s while turning at `angular` rad/s, until the next command.

        A holonomic base also drives to the left at `lateral` m/s.

        Raises:
            KbotError: the robot cannot drive, or cannot drive sideways (the message gives the reason), or a
                number is not finite.
        """
        self.send_twist(linear, angular, None, lateral)

    def command(
        self, linear: float, angular: float, watchdog: float | None = None, lateral: float = 0.0
    ) -> None:
        """Drive as `cmd_vel` does, but stop `watchdog` seconds of simulated time after the last command.

        Topics and the page use this. The default is the timeout of the robot's own controller, or 0.5 s.
        """
        if watchdog is None:
            watchdog = self.settings.watchdog if self.settings is not None else WATCHDOG
        self.send_twist(linear, angular, watchdog, lateral)

    def send_twist(self, linear: float, angular: float, watchdog: float | None, lateral: float = 0.0) -> None:
        """Drive until the next command, or with a watchdog for at most that many seconds.

        The fault LostCommands drops only commands that have a watchdog.

        Raises:
            KbotError: the robot cannot drive, or cannot drive sideways (the message gives the reason), or a
                number is not finite.
        """
        if not (is_finite(linear) and is_finite(angular) and is_finite(lateral)):
            given = [linear, angular] if is_finite(lateral) and lateral == 0.0 else [linear, angular, lateral]
            count = "three" if len(given) > 2 else "two"
            values = ", ".join(map(reprlib.repr, given))
            raise KbotError(f"a velocity command must be {count} finite numbers, not {values}")
        if lateral and self.can_drive and not self.drives_sideways:
            raise KbotError(f"robot '{self.name}' cannot drive sideways: only a holonomic base can")
        # the journal is JSON, which has no numpy numbers
        linear, angular, lateral = float(linear), float(angular), float(lateral)
        deadline = self._commands.deadline(watchdog)
        if watchdog is None or not self._commands.is_lost():
            wheels = self.wheels
            if wheels is None:
                reason = self.drive.reason if isinstance(self.drive, NoDrive) else ""
                raise KbotError(f"robot '{self.name}' cannot drive: {reason}")
            if wheels.drive_at(linear, lateral, angular, deadline):
                self._commands.follow(self)
        if self._journal.write is not None:
            self._journal.note(
                "twist",
                robot=self.name,
                linear=linear,
                angular=angular,
                deadline=deadline,
                **({"lateral": lateral} if lateral else {}),
            )

    def set_joint(self, joint: str, position: float) -> None:
        """Hold a joint at a position (rad or m) with a servo, within its effort limit.

        Raises:
            KbotError: the joint does not exist, drives the robot or mimics another joint, or the position is
                not finite.
        """
        self.body.dof(joint)
        self.joints.command({joint: position}, Interface.POSITION)
        self._commands.follow(self)
        self._journal.note("set_joint", joint=joint, position=float(position), robot=self.name)

    def release_joint(self, joint: str) -> None:
        """Let a commanded joint move freely again. Raises KbotError for an unknown joint."""
        self.joints.release(joint)
        self._journal.note("release_joint", joint=joint, robot=self.name)

    def command_joints(self, values: Mapping[str, float], interface: str = Interface.POSITION) -> None:
        """Command joints within their limits, until the next command.

        `interface` is `position` (rad or m), `velocity` (rad/s or m/s) or `effort` (N m or N).

        Raises:
            KbotError: a joint or the interface does not exist, a joint drives the robot or mimics another
                joint, or a value is not a number.
        """
        wanted, kind = joint_command(values, interface)
        self.joints.command(wanted, kind)
        self._commands.follow(self)
        numbers = {joint: float(value) for joint, value in wanted.items()}
        self._journal.note("command_joints", values=numbers, interface=str(kind), robot=self.name)

    def follow_trajectory(self, joints: Sequence[str], points: Sequence[Sequence[object]]) -> None:
        """Move joints along a trajectory, as joint_trajectory_controller does.

        Each point is a time from now (s), then positions (rad or m) in the order of `joints`, then optionally
        velocities and accelerations. Without points the joints hold their current positions.

        Raises:
            KbotError: a joint does not exist, drives the robot or mimics another joint, the points have the
                wrong shape, or the times do not increase.
        """
        names, checked = trajectory_points(joints, points)
        self.joints.follow(names, checked, self._engine.steps)
        self._commands.follow(self)
        self._journal.note(
            "follow_trajectory",
            joints=list(names),
            points=[list(point) for point in checked],
            robot=self.name,
        )

    # state for readers

    @property
    def odometry(self) -> Motion:
        """The base's pose in the odometry frame and its twist in its own frame, computed from the wheels."""
        return Motion(PlanarPose(), PlanarTwist()) if self.wheels is None else self.wheels.odometry

    @property
    def ground_truth(self) -> Motion:
        """The base's true pose in the world and its twist in its own frame."""
        return self.body.ground_truth

    @property
    def odom_from_root(self) -> Transform:
        """Pose of the root link by odometry, with the base upright on the ground."""
        pose = self.odometry.pose
        odom_from_base = Transform.from_xyz_rpy((pose.x, pose.y, 0.0), (0.0, 0.0, pose.yaw))
        return odom_from_base @ self.body.base_from_root

    @property
    def can_drive(self) -> bool:
        return self.wheels is not None

    @property
    def drives_sideways(self) -> bool:
        """Whether the robot follows sideways commands."""
        return isinstance(self.drive, SteeredDrive | HolonomicDrive) and self.drive.sideways

    @property
    def commanded_twist(self) -> PlanarTwist:
        """The last command as given, in the base's frame. Zero for a robot that cannot drive."""
        return PlanarTwist() if self.wheels is None else PlanarTwist(*self.wheels.wanted)

    @property
    def twist(self) -> PlanarTwist:
        """The commanded twist after acceleration limits. Zero for a robot that cannot drive."""
        return PlanarTwist() if self.wheels is None else PlanarTwist(*self.wheels.twist)

    # control

    @property
    def is_following(self) -> bool:
        """Whether `advance` has to be called."""
        return self.joints.servos.is_active or (self.wheels is not None and self.wheels.is_driving)

    def advance(self, step: int) -> int:
        """Send wheels and joints their next commands if these are due.

        Returns the steps until the next ones are due, 0 when all have reached the command.
        """
        if step >= self._next_advance:
            wheels, servos = self.wheels, self.joints.servos
            if wheels is not None and wheels.is_driving:
                wheels.advance()
            if servos.is_active:
                servos.advance(step)
            elif wheels is None or not wheels.is_driving:
                return 0
            self._next_advance = step + self._period
        return self._next_advance - step

    def tick(self, step: int) -> bool:
        """Update what is due every control period. Returns whether `advance` has to be called from now on."""
        if self.body.root_qpos >= 0:
            self.body.count_turns()
        return self.wheels is not None and self.wheels.tick(step)

    # state

    def bind(self) -> None:
        """Continue in the engine's new model, with the same commands."""
        self.body.bind()
        self.joints.bind()
        if self.wheels is not None:
            self.wheels.bind()

    def restart(self) -> None:
        """Clear commands and odometry, and set joints to their start positions.

        A joint starts where the description says, else at 0, or at the limit nearest to 0.
        """
        for joint in self.robot.movable_joints:
            if joint.name not in self.body.held:
                self.body.set_position(joint.name, rest(joint))
        self.body.start_counting_turns()
        if self.wheels is not None:
            self.wheels.reset()
        self._next_advance = 0
        self.jumps += 1
        self.joints.start()

    def stand_at(self, x: float, y: float, yaw: float, height: float) -> None:
        """Place the base at x, y (m) and yaw (rad), and the root at `height`. Commands continue."""
        self.body.stand_at(x, y, yaw, height)
        self.jumps += 1
        if self.wheels is not None:
            self.wheels.settle()

    def take_over(self, other: SimulatedRobot) -> None:
        """Continue the odometry and the commands of another robot, which this one replaces."""
        if self.wheels is not None:
            self.wheels.take_over(other.wheels)
        self.joints.servos.restore(other.joints.servos.save())

    def shift_time(self, steps: int) -> None:
        """Shift what is due after the time was set back by `steps`."""
        self._next_advance -= steps
        self.joints.servos.shift_time(steps)
        if self.wheels is not None:
            self.wheels.shift_time(steps)

    def save(self) -> SavedRobot:
        """The state for `restore`, without the engine's own state."""
        wheels = None if self.wheels is None else self.wheels.save()
        return wheels, self._next_advance, self.body.save(), self.joints.servos.save()

    def restore(self, saved: SavedRobot) -> None:
        wheels, self._next_advance, body, joints = saved
        self.body.restore(body)
        if self.wheels is not None and wheels is not None:
            self.wheels.restore(wheels)
        self.joints.servos.restore(joints)

    def _shown(self) -> Iterator[str]:
        pose = self.body.ground_truth.pose
        yield repr(self.name)
        yield type(self.drive).__name__
        yield f"x={pose.x:.3g}"
        yield f"y={pose.y:.3g}"
        yield f"yaw={pose.yaw:.3g}"
