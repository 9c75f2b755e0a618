"""Sets the masses and inertias of links in the engine, and reports errors in them."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.bodies import MassProperties, principal_axes
from kbot.kinematics.drive.drive import DifferentialDrive, NoDrive
from kbot.kinematics.drive.wheels import rigid_links
from kbot.kinematics.transform import Transform
from kbot.model import Inertial, Link, RobotModel
from kbot.text import DiagnosticCollector

SMALLEST = 1e-14
"""kg or kg m^2. The engine treats less as zero: MuJoCo's smallest mass of a moving body is 1e-15."""


def set_inertial(body: mujoco.MjsBody, link: Link, findings: DiagnosticCollector) -> None:
    """Give a body its link's mass, centre of mass and inertia. A link without `<inertial>` has no mass."""
    inertial = link.inertial
    if inertial is None or inertial.mass == 0.0:
        return
    if not 0.0 < inertial.mass < np.inf:
        findings.error(
            "W102", f"link '{link.name}' has a mass of {inertial.mass:g} kg", inertial.mass_origin,
            "give it a mass above 0",
        )  # fmt: skip
        return
    matrix = _possible(link, inertial, findings)
    if matrix is None:
        return
    body.explicitinertial = True
    own = MassProperties(inertial.mass, np.zeros(3), matrix).in_frame(Transform.of(inertial.pose))
    body.mass = own.mass
    # without `ipos` the engine would use the body's own position as centre of mass
    body.ipos = own.center
    m = own.tensor
    if not m.any():
        body.iquat, body.inertia = (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        return
    body.fullinertia = (m[0, 0], m[1, 1], m[2, 2], m[0, 1], m[0, 2], m[1, 2])


def check_masses(robot: RobotModel, findings: DiagnosticCollector) -> None:
    """Report the parts without mass, which cannot move as they should. See `is_fixed` and `held_joints`."""
    for head in moving_parts(robot):
        inertials = _inertials(robot, head)
        if _has_mass(inertials):
            if len(inertials) == 1 and not np.any(inertials[0].tensor):
                findings.error(
                    "W103", f"link '{head}' moves but has no inertia", inertials[0].inertia_origin,
                    "give <inertia> the moments of the link's shape",
                )  # fmt: skip
        elif head == robot.root:
            findings.warning(
                "W101",
                f"link '{head}' is the robot's body but has no mass: the robot is fixed to the world",
                robot.links[head].origin,
                "give it an <inertial> with its mass and inertia, so that it can move",
            )
        else:
            joint = robot.parent_joint[head].name
            findings.warning(
                "W114",
                f"link '{head}' has no mass: joint '{joint}' cannot move",
                robot.links[head].origin,
                "give it an <inertial> with its mass and inertia; other simulators drop the link",
            )


def moving_parts(robot: RobotModel) -> list[str]:
    """The links that move on their own: children of movable joints, and the root unless it is `world`."""
    heads = [joint.child for joint in robot.joints.values() if joint.is_movable]
    return heads if robot.root == "world" else [robot.root, *heads]


def is_fixed(robot: RobotModel) -> bool:
    """Whether the robot is fixed to the world: its root is called `world`, or its body has no mass."""
    return robot.root == "world" or not _has_mass(_inertials(robot, robot.root))


def held_joints(robot: RobotModel) -> frozenset[str]:
    """Movable joints that are held still, because what they move has no mass."""
    movable = [joint for joint in robot.joints.values() if joint.is_movable]
    return frozenset(joint.name for joint in movable if not _has_mass(_inertials(robot, joint.child)))


def drive_with_masses(robot: RobotModel, drive: DifferentialDrive | NoDrive) -> DifferentialDrive | NoDrive:
    """The drive, or why it cannot drive: its body or a wheel has no mass."""
    if isinstance(drive, NoDrive):
        return drive
    if is_fixed(robot):
        return NoDrive(f"its root link '{robot.root}' is fixed to the world")
    held = held_joints(robot)
    for joint in drive.joints:
        if joint in held:
            return NoDrive(f"its wheel '{robot.joints[joint].child}' has no mass and cannot move")
    return drive


def _inertials(robot: RobotModel, head: str) -> list[Inertial]:
    links = [robot.links[name] for name in rigid_links(robot, head)]
    return [link.inertial for link in links if link.inertial is not None]


def _has_mass(inertials: list[Inertial]) -> bool:
    # a negative mass counts: it is reported as an error of its own
    return any(abs(i.mass) > SMALLEST or not np.isfinite(i.mass) for i in inertials)


def _possible(link: Link, inertial: Inertial, findings: DiagnosticCollector) -> NDArray[np.float64] | None:
    """The link's inertia tensor, or None with an error.

    No body has a principal moment above the sum of the other two. Such a tensor is replaced, with a warning,
    by the nearest possible one.
    """
    matrix = np.array(inertial.tensor)
    if not np.isfinite(matrix).all():
        message = f"link '{link.name}' has an inertia that is not a finite number"
        findings.error("W103", message, inertial.inertia_origin)
        return None
    moments, axes = principal_axes(matrix)
    if moments[0] < -1e-12 * max(moments[-1], 0.0) or moments[-1] < 0.0:
        findings.error(
            "W103",
            f"link '{link.name}' has a negative moment of inertia ({moments[0]:.4g} kg m^2)",
            inertial.inertia_origin,
            "all three principal moments of a body are above 0",
        )
        return None
    lack = float(moments[2] - moments[0] - moments[1])
    if lack <= 1e-12 * moments[2]:
        return matrix
    if lack > 1e-3 * moments[2]:
        a, b, c = moments
        findings.warning(
            "W104",
            f"link '{link.name}' has an impossible inertia: the largest principal moment, {c:.4g}, exceeds"
            f" the sum of the others, {a:.4g} + {b:.4g} kg m^2. KBot adds {lack / 2:.4g} to each of these",
            inertial.inertia_origin,
            "give <inertia> the moments of the link's shape",
        )
    moments[:2] += lack / 2 * (1.0 + 1e-9) + 1e-15
    possible: NDArray[np.float64] = axes @ np.diag(moments) @ axes.T
    return possible
