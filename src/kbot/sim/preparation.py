"""Prepares a robot for a simulation: finds its drive and controllers, and plans its model."""

from __future__ import annotations

import dataclasses
import os
import reprlib

import numpy as np

from kbot.kinematics.drive.drive import DifferentialDrive, NoDrive, SteeredDrive, find_drive
from kbot.kinematics.drive.findings import findings_of_drive
from kbot.kinematics.planar_pose import PlanarPose
from kbot.kinematics.transform import Transform
from kbot.model import RobotModel
from kbot.model.load import load_robot
from kbot.sim.drive.settings import DriveSettings, drive_settings
from kbot.sim.drive.twist_controller import DriveLimits
from kbot.sim.engine.inertia import drive_with_masses
from kbot.sim.engine.robot_builder import RobotPlan
from kbot.sim.joint_control.control import JointControl
from kbot.sim.joint_control.controllers import joint_control, spawned_for
from kbot.sim.naming import Naming
from kbot.sim.numbers import FURTHEST, is_finite, vector
from kbot.sim.recipe import Contacts
from kbot.text import Diagnostic, DiagnosticCollector, KbotError


@dataclasses.dataclass(frozen=True, slots=True)
class Prepared:
    """`settings`: how the robot's own controller drives, None for one that cannot drive; `control`: what
    commands its other joints; `plan`: what the engine is given; `findings`: what is wrong with its drive and
    controllers."""

    robot: RobotModel
    naming: Naming
    drive: DifferentialDrive | NoDrive
    settings: DriveSettings | None
    control: JointControl
    plan: RobotPlan
    findings: tuple[Diagnostic, ...]

    @property
    def base(self) -> str:
        """The link whose motion on the plane is spoken of."""
        if isinstance(self.drive, DifferentialDrive):
            return self.drive.base
        return "base_footprint" if "base_footprint" in self.robot.links else self.robot.root

    @property
    def driving(self) -> tuple[str, ...]:
        """The joints that the drive moves, those that steer too."""
        return _driving_joints(self.drive)


def prepare(
    robot: RobotModel, naming: Naming, pose: PlanarPose, limits: DriveLimits | None, contacts: Contacts
) -> Prepared:
    """A robot that is called `naming` and begins at a pose in the world; `limits` stand in for those of its
    own controller."""
    found = find_drive(robot)
    drive = drive_with_masses(robot, _unless_commanded(robot, found))
    findings = DiagnosticCollector()
    findings.diagnostics += findings_of_drive(robot, found)
    settings: DriveSettings | None = None
    if isinstance(drive, DifferentialDrive):
        settings = drive_settings(robot, drive, findings, naming)
        if limits is not None:
            settings = dataclasses.replace(settings, limits=limits)
    name = naming.name
    # topics that gz names by the model bear its name in the world
    control = joint_control(dataclasses.replace(robot, name=name), _driving_joints(drive), findings, naming)
    place = Transform.from_xyz_rpy((pose.x, pose.y, 0.0), (0.0, 0.0, pose.yaw))
    torque = settings.torque if settings is not None else None
    plan = RobotPlan(name, robot, drive, contacts, place, others=False, torque=torque)
    return Prepared(robot, naming, drive, settings, control, plan, tuple(findings.diagnostics))


def controller_findings(robot: RobotModel) -> tuple[Diagnostic, ...]:
    """What is wrong with the controllers of a robot, before it is simulated."""
    findings = DiagnosticCollector()
    joint_control(robot, _driving_joints(_unless_commanded(robot, find_drive(robot))), findings)
    return tuple(findings.diagnostics)


def check_settings(seed: int, timestep: float, limits: DriveLimits | None, start: PlanarPose) -> None:
    """Raises KbotError: the seed, the timestep (s), the limits or the start of a simulation are not valid."""
    if not isinstance(start, PlanarPose):
        raise KbotError(f"a start is a PlanarPose(x, y, yaw) in m and rad, not {reprlib.repr(start)}")
    if not (limits is None or isinstance(limits, DriveLimits)):
        raise KbotError(f"limits are DriveLimits(linear_velocity=...), not {reprlib.repr(limits)}")
    vector("a start", (start.x, start.y, start.yaw), FURTHEST)
    if not (is_finite(timestep) and 1e-5 <= timestep <= 0.02):
        raise KbotError(f"a step is 0.00001 to 0.02 seconds long, not {timestep!r}")
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
        raise KbotError(f"a seed is a whole number from 0 on, not {seed!r}")


def read_robot(robot: object) -> RobotModel:
    """A robot, or that of a file. Raises KbotError, or DescriptionError with all that is wrong in it."""
    if isinstance(robot, RobotModel):
        return robot
    if isinstance(robot, str | os.PathLike):
        return load_robot(robot).require()
    raise KbotError(
        f"a robot, or the file of one, is simulated, not {reprlib.repr(robot)}: kbot.load(FILE) reads one"
    )


def _unless_commanded(robot: RobotModel, drive: DifferentialDrive | NoDrive) -> DifferentialDrive | NoDrive:
    """The drive, unless a launch has its wheels commanded one by one."""
    reason = spawned_for(robot, _driving_joints(drive))
    return NoDrive(reason) if reason else drive


def _driving_joints(drive: DifferentialDrive | NoDrive) -> tuple[str, ...]:
    if isinstance(drive, SteeredDrive):
        return (*drive.joints, *(wheel.joint for wheel in drive.steering))
    return drive.joints if isinstance(drive, DifferentialDrive) else ()
