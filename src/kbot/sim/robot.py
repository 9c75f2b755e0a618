"""One robot within a simulation: its commands in, its motion and joints out."""

from __future__ import annotations

from typing import Any, Protocol

from kbot.kinematics.differential_drive import DifferentialDrive, NoDrive
from kbot.kinematics.odometry import PlanarPose, PlanarTwist
from kbot.kinematics.steered_drive import SteeredDrive
from kbot.kinematics.transform import Transform
from kbot.sim.drive.steered_servos import SteeredServos
from kbot.sim.drive.twist_controller import TwistController
from kbot.sim.drive.wheel_servos import WheelServos
from kbot.sim.engine.engine import Engine
from kbot.sim.engine.servo import speed_limit
from kbot.sim.motion import Motion, WheelOdometry
from kbot.sim.preparation import Prepared
from kbot.sim.recipe import SLEW_PERIOD, WATCHDOG
from kbot.sim.robot_joints import JointHost, RobotJoints
from kbot.text import KbotError


class Host(JointHost, Protocol):
    """The simulation that takes commands, and writes them in its journal."""

    def take_command(
        self, robot: SimulatedRobot, linear: float, angular: float, watchdog: float | None
    ) -> None:
        """Take a twist that holds, or, with a watchdog (s), is taken for lost after that time."""
        ...


class SimulatedRobot(RobotJoints):
    """A robot in a simulation: commands in; motion, joints and links out."""

    def __init__(self, prepared: Prepared, host: Host, engine: Engine, timestep: float) -> None:
        self._slew_steps = max(1, round(SLEW_PERIOD / timestep))
        period = self._slew_steps * timestep
        super().__init__(prepared, host, engine, period, timestep)
        self._host: Host = host
        drive, settings = prepared.drive, prepared.settings
        self.drive = drive
        self._is_driving = False
        self._next_slew = 0
        self.settings = settings
        self._controller: TwistController | None = None
        self._odometry: WheelOdometry | None = None
        self._reckoned: DifferentialDrive | None = None
        self._servos = self._servos_of_wheels()
        self.jumps = 0
        """How often it was put elsewhere, by a reset too."""
        if isinstance(drive, DifferentialDrive) and settings is not None:
            reckoned = self._reckoned = settings.reckoned(drive)
            fastest = min(speed_limit(self.robot, joint) for joint in drive.joints)
            self._controller = TwistController(reckoned, settings.limits, fastest, period)
            self._odometry = WheelOdometry(reckoned)

    def _bind(self) -> None:
        """Wheels and joints go on as they were told."""
        super()._bind()
        rolled = self._servos.state if isinstance(self._servos, SteeredServos) else None
        self._servos = self._servos_of_wheels()
        if isinstance(self._servos, SteeredServos) and rolled:
            self._servos.state = rolled

    def _servos_of_wheels(self) -> WheelServos | SteeredServos | None:
        model, data = self._engine.model, self._engine.data
        if isinstance(self.drive, SteeredDrive):
            return SteeredServos(model, data, self.drive, self.prefix)
        if isinstance(self.drive, DifferentialDrive):
            return WheelServos(model, data, self.drive, self.prefix)
        return None

    def _reset(self) -> None:
        """Forget commands and odometry; the engine's state is the simulation's to reset. Joints that the
        description's controllers hold are held from here on."""
        if self._controller is not None:
            self._controller.reset()
        if self._odometry is not None:
            self._odometry.reset()
        if isinstance(self._servos, SteeredServos):
            self._servos.restart()
        self._is_driving, self._next_slew = False, 0
        self.jumps += 1
        self._start_joints()
        self._start_counting_turns()

    @property
    def can_drive(self) -> bool:
        return self._controller is not None

    @property
    def commanded_twist(self) -> PlanarTwist:
        """The last command as it came, in the base's frame; zero for a robot that cannot drive."""
        linear, angular = self._controller.wanted if self._controller is not None else (0.0, 0.0)
        return PlanarTwist(linear, 0.0, angular)

    @property
    def twist(self) -> PlanarTwist:
        """The commanded twist as it is slewed now."""
        linear, angular = self._controller.twist if self._controller is not None else (0.0, 0.0)
        return PlanarTwist(linear, 0.0, angular)

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

    def _obey(self, linear: float, angular: float, deadline: int | None) -> bool:
        """Take a twist (m/s, rad/s) that holds until the step `deadline`; whether `_slew` has to be called.

        Raises:
            KbotError: the robot cannot drive; the reason is said.
        """
        controller = self._controller
        if controller is None:
            reason = self.drive.reason if isinstance(self.drive, NoDrive) else ""
            raise KbotError(f"robot '{self.name}' cannot drive: {reason}")
        if controller.wanted == (linear, angular):
            controller.deadline = deadline
        elif controller.command(linear, angular, deadline):
            self._is_driving = True
        return self._is_driving

    @property
    def _is_slewing(self) -> bool:
        """Whether `_slew` has to be called."""
        return self._is_driving or self._joint_servos.is_active

    def _slew(self, step: int) -> int:
        """Hand wheels and joints their next commands when that is due; steps until it is due again, 0 when
        they have what was commanded."""
        if step >= self._next_slew:
            if self._is_driving and self._controller is not None and self._servos is not None:
                left, right, settled = self._controller.advance()
                self._servos.command(left, right)
                self._is_driving = not settled
            if self._joint_servos.is_active:
                self._joint_servos.advance(step)
            elif not self._is_driving:
                return 0
            self._next_slew = step + self._slew_steps
        return self._next_slew - step

    def _tick(self, step: int) -> bool:
        """Called every control period: reckon odometry, keep the servos from winding up, and drop a
        command that has grown old. Returns whether there is a new twist to slew to."""
        if self.root_qpos >= 0:
            self._count_turns()
        servos, odometry, controller = self._servos, self._odometry, self._controller
        if servos is None or odometry is None or controller is None:
            return False
        odometry.update(*servos.roll())
        if controller.deadline is not None and step >= controller.deadline:
            return self._obey(0.0, 0.0, None)
        return False

    # what can be read

    @property
    def odometry(self) -> Motion:
        """What the wheels tell: `pose` of the base in the odometry frame, `twist` in its own."""
        reckoned = self._reckoned
        if self._odometry is None or self._servos is None or reckoned is None:
            return Motion(PlanarPose(), PlanarTwist())
        linear, angular = reckoned.twist(*self._servos.speeds())
        return Motion(self._odometry.pose(*self._servos.angles()), self._odometry.twist(linear, angular))

    @property
    def odom_from_root(self) -> Transform:
        """Where the odometry has the root link: the base upright on the ground."""
        pose = self.odometry.pose
        return Transform.from_xyz_rpy((pose.x, pose.y, 0.0), (0.0, 0.0, pose.yaw)) @ self.base_from_root

    def _stand_at(self, x: float, y: float, yaw: float, height: float) -> None:
        """See `RobotBody._stand_at`; commands go on."""
        super()._stand_at(x, y, yaw, height)
        self.jumps += 1
        if self._servos is not None:
            self._servos.settle()

    def _take_over(self, other: SimulatedRobot) -> None:
        """Go on as another robot did: its odometry and what it was told. Joints have been set before."""
        if self._odometry is not None and self._servos is not None:
            self._servos.settle()
            self._odometry.start_at(other.odometry.pose, *self._servos.angles())
        mine, theirs = self._controller, other._controller
        if mine is not None and theirs is not None:
            self._obey(*theirs.target, theirs.deadline)
        self._restore_joints(other._save_joints())

    def _set_back(self, steps: int) -> None:
        """Let what is due come so many steps earlier, for time itself was set back by as much."""
        self._next_slew -= steps
        self._joint_servos.set_back(steps)
        if self._controller is not None and self._controller.deadline is not None:
            self._controller.deadline -= steps

    def _restart_odometry(self) -> None:
        """Reckon from zero, from where the robot and its wheels are now."""
        if self._odometry is not None and self._servos is not None:
            self._odometry.reset(*self._servos.angles())

    def _save(self) -> tuple[Any, ...]:
        """What a saved state holds beside the engine's own."""
        controller = self._controller
        commanded = controller.save() if controller else None
        odometry = self._odometry.state if self._odometry else None
        slewing = self._is_driving, self._next_slew
        rolled = self._servos.state if isinstance(self._servos, SteeredServos) else None
        return commanded, slewing, odometry, self._turns, self._is_left, self._save_joints(), rolled

    def _restore(self, saved: tuple[Any, ...]) -> None:
        """Take back what `_save` gave; the engine's own state has been restored before."""
        commanded, slewing, odometry, self._turns, self._is_left, told, rolled = saved
        self._is_driving, self._next_slew = slewing
        if self._controller is not None and commanded is not None:
            self._controller.restore(commanded)
        if self._odometry is not None and odometry is not None:
            self._odometry.state = odometry
        self._restore_joints(told)
        if isinstance(self._servos, SteeredServos):
            self._servos.state = rolled
