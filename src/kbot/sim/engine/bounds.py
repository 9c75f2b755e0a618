"""Limits on the size of a robot that can be simulated."""

from __future__ import annotations

from kbot.model import Box, Geometry, Mesh, RobotModel
from kbot.text import DiagnosticCollector
from kbot.world.world import FURTHEST, HEAVIEST

DEEPEST = 500
"""Movable joints one above another. A step takes time with the cube of it: 0.05 s for 500 of them."""


def check_bounds(robot: RobotModel, findings: DiagnosticCollector) -> None:
    """Report what is beyond the bounds: W112 too many joints in a row, W113 an absurd number."""
    for link in robot.links.values():
        inertial = link.inertial
        if inertial is not None:
            values = (inertial.mass, inertial.ixx, inertial.iyy, inertial.izz)
            if max(map(abs, values)) > HEAVIEST:
                message = f"link '{link.name}' has a mass or an inertia above {HEAVIEST:g}"
                findings.error("W113", message, inertial.origin, "masses are in kilograms")
        for collision in link.collisions:
            if max((*_sizes(collision.geometry), *map(abs, collision.pose.xyz))) > FURTHEST:
                findings.error(
                    "W113", f"link '{link.name}' has a shape beyond {FURTHEST:g} m",
                    collision.geometry.origin, "sizes are in metres",
                )  # fmt: skip
    for joint in robot.joints.values():
        if max(map(abs, joint.pose.xyz)) > FURTHEST:
            findings.error(
                "W113", f"joint '{joint.name}' stands beyond {FURTHEST:g} m from its parent", joint.origin,
                "lengths are in metres",
            )  # fmt: skip
    _check_depth(robot, findings)


def _sizes(shape: Geometry) -> tuple[float, ...]:
    if isinstance(shape, Mesh):
        return tuple(abs(value) for value in shape.scale)
    if isinstance(shape, Box):
        return shape.size
    return (shape.radius, getattr(shape, "length", 0.0))


def _check_depth(robot: RobotModel, findings: DiagnosticCollector) -> None:
    waiting = [(robot.root, 0)]
    while waiting:
        link, depth = waiting.pop()
        for joint in robot.child_joints[link]:
            below = depth + joint.is_movable
            if below > DEEPEST:
                findings.error(
                    "W112", f"joint '{joint.name}' hangs on {DEEPEST} others that move, one above another",
                    joint.origin, "that is more than can be simulated: fix some of them",
                )  # fmt: skip
                return
            waiting.append((joint.child, below))
