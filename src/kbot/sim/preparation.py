"""Prepares a robot for a simulation: finds its drive and controllers, and plans its model."""

from __future__ import annotations

import dataclasses
import os
import reprlib

import numpy as np

from kbot.kinematics.drive.drive import DifferentialDrive, NoDrive, SteeredDrive, find_drive
from kbot.kinematics.drive.findings import findings_of_drive
from kbot.kinematics.drive.nearby import with_nearby_drive
from kbot.kinematics.drive.programs import setting_findings
from kbot.kinematics.planar_pose import PlanarPose
from kbot.kinematics.transform import Transform
from kbot.model import RobotModel
from kbot.model.load import load_robot
from kbot.robot import Robot
from kbot.sim.drive.settings import DriveSettings, drive_settings
from kbot.sim.drive.twist_controller import DriveLimits
from kbot.sim.engine.inertia import drive_with_masses, held_joints
from kbot.sim.engine.robot_builder import RobotPlan
from kbot.sim.joint_control.brakes import braked_joints
from kbot.sim.joint_control.control import JointControl
from kbot.sim.joint_control.controllers import joint_control, spawned_for
from kbot.sim.naming import Naming
from kbot.sim.numbers import FURTHEST, is_finite, vector
from kbot.sim.recipe import Contacts
from kbot.text import Diagnostic, DiagnosticCollector, KbotError

_NAMED = 8
"""Most joints that a finding names."""


@dataclasses.dataclass(frozen=True, slots=True)
class Prepared:
    """A robot that is ready to be added to a simulation.

    `settings` are those of the robot's own drive controller, or None if it cannot drive. `control` has the
    controllers of its other joints. The engine builds the robot from `plan`. `findings` are the problems
    with its drive and controllers.
    """

    robot: Robot
    naming: Naming
    drive: DifferentialDrive | NoDrive
    settings: DriveSettings | None
    control: JointControl
    plan: RobotPlan
    findings: tuple[Diagnostic, ...]

    @property
    def base(self) -> str:
        """The link whose motion on the plane odometry and ground truth describe."""
        if isinstance(self.drive, DifferentialDrive):
            return self.drive.base
        return "base_footprint" if "base_footprint" in self.robot.links else self.robot.root

    @property
    def driving(self) -> tuple[str, ...]:
        """The joints that the drive moves, including steering joints."""
        return _driving_joints(self.drive)


def prepare(
    robot: RobotModel, naming: Naming, pose: PlanarPose, limits: DriveLimits | None, contacts: Contacts
) -> Prepared:
    """Prepare a robot with the names in `naming` that starts at `pose` in the world.

    `limits` replace the limits of the robot's own controller.
    """
    findings = DiagnosticCollector()
    robot = with_nearby_drive(robot, findings)
    found = find_drive(robot)
    drive = drive_with_masses(robot, _unless_commanded(robot, found))
    findings.diagnostics += (*findings_of_drive(robot, found), *setting_findings(robot))
    settings: DriveSettings | None = None
    if isinstance(drive, DifferentialDrive):
        settings = drive_settings(robot, drive, findings, naming)
        if limits is not None:
            settings = dataclasses.replace(settings, limits=limits)
    name = naming.name
    # gz puts the model's name in the world into topic names
    driving = _driving_joints(drive)
    control = joint_control(dataclasses.replace(robot, name=name), driving, findings, naming)
    control = _with_brakes(robot, drive, driving, control, findings)
    place = Transform.from_xyz_rpy((pose.x, pose.y, 0.0), (0.0, 0.0, pose.yaw))
    torque = settings.torque if settings is not None else None
    plan = RobotPlan(name, robot, drive, contacts, place, others=False, torque=torque)
    return Prepared(Robot.of(robot), naming, drive, settings, control, plan, tuple(findings.diagnostics))


def controller_findings(robot: RobotModel) -> tuple[Diagnostic, ...]:
    """The problems with a robot's joint controllers. The robot need not be simulated."""
    findings = DiagnosticCollector()
    joint_control(robot, _driving_joints(_unless_commanded(robot, find_drive(robot))), findings)
    return tuple(findings.diagnostics)


def check_settings(seed: int, timestep: float, limits: DriveLimits | None, start: PlanarPose) -> None:
    """Raises KbotError: the seed, the timestep (s), the limits or the start of a simulation is not valid."""
    if not isinstance(start, PlanarPose):
        raise KbotError(f"start must be a PlanarPose(x, y, yaw) in m and rad, not {reprlib.repr(start)}")
    if not (limits is None or isinstance(limits, DriveLimits)):
        raise KbotError(f"limits must be DriveLimits(linear_velocity=...), not {reprlib.repr(limits)}")
    vector("start", (start.x, start.y, start.yaw), FURTHEST)
    if not (is_finite(timestep) and 1e-5 <= timestep <= 0.02):
        raise KbotError(f"timestep must be from 0.00001 to 0.02 seconds, not {timestep!r}")
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
        raise KbotError(f"seed must be a whole number of at least 0, not {seed!r}")


def read_robot(robot: object) -> Robot:
    """Return the robot of a model, or load it from a file.

    Raises:
        KbotError: `robot` is neither a model nor a file name.
        DescriptionError: the description has errors. It carries all of them.
    """
    if isinstance(robot, RobotModel):
        return Robot.of(robot)
    if isinstance(robot, str | os.PathLike):
        return Robot.of(load_robot(robot))
    raise KbotError(f"robot must be a file name or the result of kbot.load(FILE), not {reprlib.repr(robot)}")


def _unless_commanded(robot: RobotModel, drive: DifferentialDrive | NoDrive) -> DifferentialDrive | NoDrive:
    """The drive, unless a launch file starts controllers that command the wheels one by one."""
    reason = spawned_for(robot, _driving_joints(drive))
    return NoDrive(reason) if reason else drive


def _with_brakes(
    robot: RobotModel,
    drive: DifferentialDrive | NoDrive,
    driving: tuple[str, ...],
    control: JointControl,
    findings: DiagnosticCollector,
) -> JointControl:
    """The control, with brakes on the joints that nothing commands, which are reported."""
    commanded = (joint for c in control.controllers if c.is_active for joint in c.joints)
    taken = held_joints(robot).union(driving, control.holds, commanded)
    free = {joint.name for joint in robot.movable_joints if joint.name not in taken and joint.mimic is None}
    braked = braked_joints(robot, drive, free)
    if not braked:
        return control
    count, names = len(braked), ", ".join(f"'{name}'" for name in braked[:_NAMED])
    more = f" and {count - _NAMED} more" if count > _NAMED else ""
    what = (
        "1 joint where it starts, as a brake does"
        if count == 1
        else f"{count} joints where they start, as brakes do"
    )
    findings.info(
        "W147",
        f"no controller commands {names}{more}: KBot holds {what}",
        robot.joints[braked[0]].origin,
        "add a controller, or let a joint move freely with robot.release_joint(NAME)",
    )
    return dataclasses.replace(control, holds=control.holds.union(braked))


def _driving_joints(drive: DifferentialDrive | NoDrive) -> tuple[str, ...]:
    if isinstance(drive, SteeredDrive):
        return tuple(dict.fromkeys((*drive.joints, *drive.wheels, *drive.steering)))
    return drive.joints if isinstance(drive, DifferentialDrive) else ()
