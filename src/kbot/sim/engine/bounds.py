"""Limits on the size of a robot and a world that can be simulated."""

from __future__ import annotations

from kbot.model import Box, Geometry, Mesh, RobotModel
from kbot.text import DiagnosticCollector
from kbot.world.world import FURTHEST, HEAVIEST, World

DEEPEST = 500
"""Movable joints in one chain. The time of a step grows with the cube of it: 0.05 s for 500 joints."""


def check_bounds(robot: RobotModel, findings: DiagnosticCollector) -> None:
    """Report what exceeds the limits: W112 too many joints in a chain, W113 a number out of range."""
    for link in robot.links.values():
        inertial = link.inertial
        if inertial is not None:
            values = (inertial.mass, inertial.ixx, inertial.iyy, inertial.izz)
            if max(map(abs, values)) > HEAVIEST:
                message = f"link '{link.name}' has a mass or moment of inertia above {HEAVIEST:g}"
                findings.error("W113", message, inertial.origin, "give masses in kg and inertias in kg m^2")
        for collision in link.collisions:
            if max((*_sizes(collision.geometry), *map(abs, collision.pose.xyz))) > FURTHEST:
                findings.error(
                    "W113", f"link '{link.name}' has a shape larger or further away than {FURTHEST:g} m",
                    collision.geometry.origin, "give sizes and positions in metres",
                )  # fmt: skip
    for joint in robot.joints.values():
        if max(map(abs, joint.pose.xyz)) > FURTHEST:
            findings.error(
                "W113", f"joint '{joint.name}' is more than {FURTHEST:g} m from its parent", joint.origin,
                "give positions in metres",
            )  # fmt: skip
    _check_depth(robot, findings)


def check_world(world: World, findings: DiagnosticCollector) -> None:
    """Report a chain of too many joints: W112."""
    depths: dict[str, int] = {}
    for body in world.bodies:  # a parent is before its children
        if body.joint is not None:
            depths[body.name] = depths.get(body.joint.parent, 0) + 1
            if depths[body.name] > DEEPEST:
                findings.error(
                    "W112",
                    f"the world's body '{body.name}' is in a chain of more than {DEEPEST} movable joints",
                    None,
                    "a step would take too long: make some of the joints fixed",
                )
                return


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
                    "W112", f"joint '{joint.name}' is in a chain of more than {DEEPEST} movable joints",
                    joint.origin, "a step would take too long: make some of the joints fixed",
                )  # fmt: skip
                return
            waiting.append((joint.child, below))
