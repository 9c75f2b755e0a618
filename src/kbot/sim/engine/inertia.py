"""Sets the masses and inertias of links in the engine, and reports errors in them."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.bodies import MassProperties
from kbot.kinematics.drive.drive import DifferentialDrive, NoDrive
from kbot.kinematics.drive.wheels import rigid_links
from kbot.kinematics.inertia_repair import SMALLEST, possible_tensor
from kbot.kinematics.transform import Transform
from kbot.model import Collision, Inertial, Link, RobotModel, Visual
from kbot.model.shapes import bounds
from kbot.text import DiagnosticCollector, KbotError


def set_inertial(body: mujoco.MjsBody, link: Link, moves_alone: bool, findings: DiagnosticCollector) -> None:
    """Give a body its link's mass, centre of mass and inertia. A link without `<inertial>` has no mass.

    A link `moves_alone` if no other link with a mass is fixed to it.
    """
    inertial = link.inertial
    if inertial is None or 0.0 <= inertial.mass <= SMALLEST:
        return
    if not 0.0 < inertial.mass < np.inf:
        findings.error(
            "W102", f"link '{link.name}' has a mass of {inertial.mass:g} kg", inertial.mass_origin,
            "give it a mass above 0",
        )  # fmt: skip
        return
    matrix = _possible(link, inertial, moves_alone, findings)
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
            continue
        if head == robot.root:
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


def lone_links(robot: RobotModel) -> set[str]:
    """The moving links to which no other link with a mass is fixed."""
    found = set()
    for head in moving_parts(robot):
        links = [robot.links[name] for name in rigid_links(robot, head)]
        heavy = [link.name for link in links if link.inertial is not None and _has_mass([link.inertial])]
        if len(heavy) == 1:
            found.add(heavy[0])
    return found


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


def _possible(
    link: Link, inertial: Inertial, moves_alone: bool, findings: DiagnosticCollector
) -> NDArray[np.float64] | None:
    """The link's inertia tensor, repaired if it is impossible. None with an error if it is not finite."""
    matrix = np.array(inertial.tensor)
    if not np.isfinite(matrix).all():
        message = f"link '{link.name}' has an inertia that is not a finite number"
        findings.error("W103", message, inertial.inertia_origin)
        return None

    def corners() -> NDArray[np.float64]:
        shapes = link.collisions or link.visuals
        return np.array([corner for shape in shapes for corner in _corners(inertial, shape)]).reshape(-1, 3)

    def report(code: str, problem: str, instead: str, hint: str) -> None:
        message = f"{problem}. KBot {instead}"
        findings.warning(code, message, inertial.inertia_origin, hint, message)

    name = f"link '{link.name}'"
    return possible_tensor(name, inertial.mass, matrix, corners, report, moves_alone=moves_alone)


def _corners(inertial: Inertial, shape: Visual | Collision) -> list[NDArray[np.float64]]:
    """Two opposite corners of the box around a shape, in the inertial's frame. None for a missing mesh."""
    inertial_from_shape = Transform.of(inertial.pose).inverse() @ Transform.of(shape.pose)
    try:
        box = bounds(shape.geometry, inertial_from_shape.rotation)
    except KbotError:
        return []  # a broken mesh, which is reported elsewhere
    return [] if box is None else [corner + inertial_from_shape.translation for corner in box]
