"""Describes a robot for `kbot info`, as data and as text: links, joints, masses, drive and size."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from typing import Any

from kbot.kinematics.bodies import center_of_mass, robot_bounds, total_mass
from kbot.kinematics.drive.declared import Holonomic
from kbot.kinematics.drive.drive import (
    DifferentialDrive,
    HolonomicDrive,
    NoDrive,
    SteeredDrive,
    find_drive,
)
from kbot.kinematics.frames import FrameTree
from kbot.model import Geometry, Joint, Link, Mesh, RobotModel
from kbot.text.columns import aligned

_DEEPEST = 30
"""Deeper links of the tree are drawn at this depth, so that lines do not become too long."""


def describe(robot: RobotModel) -> dict[str, Any]:  # Any: JSON
    """The robot as plain data for JSON, in metres, kilograms and radians. Unknown values are None.

    For a robot without a drive `drive` is None, and `no_drive` is the reason.
    """
    tree = FrameTree(robot)
    return _describe(robot, tree, find_drive(robot, tree))


def _describe(robot: RobotModel, tree: FrameTree, drive: DifferentialDrive | NoDrive) -> dict[str, Any]:
    bounds = robot_bounds(tree)
    center = center_of_mass(tree)
    return {
        "name": robot.name,
        "root": robot.root,
        "mass": total_mass(robot),
        "center_of_mass": None if center is None else center.tolist(),
        "bounds": None if bounds is None else {"lower": bounds[0].tolist(), "upper": bounds[1].tolist()},
        "drive": None if isinstance(drive, NoDrive) else _drive(drive),
        "no_drive": drive.reason if isinstance(drive, NoDrive) else None,
        "links": [_link(link) for link in robot.links.values()],
        "joints": [_joint(joint) for joint in robot.joints.values()],
    }


def describe_as_text(robot: RobotModel) -> str:
    """The robot as text: a heading, the tree of links, the drive, and the bounds."""
    tree = FrameTree(robot)
    drive = find_drive(robot, tree)
    data = _describe(robot, tree, drive)
    links, joints = len(robot.links), len(robot.joints)
    movable = sum(joint.is_movable for joint in robot.joints.values())
    lines = [
        f"{robot.name}: {links} link{_s(links)}, {joints} joint{_s(joints)} ({movable} movable), "
        f"{data['mass']:.4g} kg",
        "",
        *_tree(robot),
        "",
    ]
    if isinstance(drive, SteeredDrive):
        lines += [
            "steered drive",
            f"  driven            {', '.join(drive.joints)}",
            f"  steered           {', '.join(drive.steering)}",
            f"  wheel radius      {drive.radius:.4g} m",
            f"  wheel separation  {drive.separation:.4g} m",
            f"  wheelbase         {drive.wheelbase:.4g} m",
        ]
    elif isinstance(drive, HolonomicDrive):
        lines += _holonomic_lines(drive)
    elif isinstance(drive, NoDrive):
        lines.append(f"no differential drive: {drive.reason}")
    else:
        lines += [
            "differential drive",
            f"  left   {', '.join(drive.left)}",
            f"  right  {', '.join(drive.right)}",
            f"  wheel radius      {drive.radius:.4g} m",
            f"  wheel separation  {drive.separation:.4g} m",
            f"  axle's middle     {_vector(drive.axle_in_base.translation.tolist())} m in {drive.base}",
            f"  casters           {', '.join(drive.casters) or 'none'}",
        ]
    if data["center_of_mass"]:
        lines.append(f"centre of mass  {_vector(data['center_of_mass'])} m in {robot.root}")
    if data["bounds"]:
        lower, upper = data["bounds"]["lower"], data["bounds"]["upper"]
        size = [high - low for low, high in zip(lower, upper, strict=True)]
        lines.append(f"bounds          {_vector(lower)} to {_vector(upper)} m in {robot.root}")
        lines.append(f"size            {_vector(size)} m")
    return "\n".join(lines)


def _holonomic_lines(drive: HolonomicDrive) -> list[str]:
    middle = f"{_vector(drive.axle_in_base.translation.tolist())} m in {drive.base}"
    if drive.kind is Holonomic.BODY:
        sideways = "forwards and sideways" if drive.sideways else "forwards"
        return [
            f"holonomic drive: a plugin moves the base itself, {sideways}",
            f"  base              {drive.base}",
            f"  stands on         {', '.join(drive.casters)}",
        ]
    if drive.kind is Holonomic.TRACKS:
        return [
            "tracked drive",
            f"  tracks            {', '.join(drive.treads)}",
            f"  separation        {drive.separation:.4g} m",
            f"  efficiency        {drive.efficiency:g} (share of the tracks' speeds that turns the robot)",
            f"  turns about       {middle}",
        ]
    lever = "half of track plus wheelbase" if drive.kind is Holonomic.MECANUM else "middle to wheel"
    return [
        f"holonomic drive with {drive.kind} wheels",
        f"  driven            {', '.join(drive.joints)}",
        f"  wheel radius      {drive.radius:.4g} m",
        f"  lever             {drive.separation / 2.0:.4g} m ({lever})",
        f"  wheels' middle    {middle}",
        f"  casters           {', '.join(drive.casters) or 'none'}",
    ]


def _drive(drive: DifferentialDrive) -> dict[str, Any]:
    if isinstance(drive, HolonomicDrive):
        return {
            "kind": str(drive.kind),
            "joints": list(drive.joints),
            "sideways": drive.sideways,
            "radius": drive.radius,
            "lever": drive.separation / 2.0,
            "base": drive.base,
            "axle_in_base": _planar(drive),
            "casters": list(drive.casters),
        }
    if isinstance(drive, SteeredDrive):
        return {
            "kind": "steered",
            "joints": list(drive.joints),
            "steering": list(drive.steering),
            "sideways": drive.sideways,
            "radius": drive.radius,
            "separation": drive.separation,
            "wheelbase": drive.wheelbase,
            "base": drive.base,
            "axle_in_base": _planar(drive),
            "casters": list(drive.casters),
        }
    return {
        "left": list(drive.left),
        "right": list(drive.right),
        "radius": drive.radius,
        "separation": drive.separation,
        "base": drive.base,
        "axle_in_base": _planar(drive),
        "casters": list(drive.casters),
    }


def _planar(drive: DifferentialDrive) -> dict[str, Any]:
    return {"xyz": drive.axle_in_base.translation.tolist(), "yaw": drive.axle_in_base.yaw}


def _link(link: Link) -> dict[str, Any]:
    return {
        "name": link.name,
        "mass": link.inertial.mass if link.inertial else None,
        "visuals": [_shape(v.geometry) for v in link.visuals],
        "collisions": [_shape(c.geometry) for c in link.collisions],
        "file": link.origin.span.file,
        "line": link.origin.span.line,
    }


def _shape(shape: Geometry) -> dict[str, Any]:
    kind = type(shape).__name__.lower()
    if isinstance(shape, Mesh):
        return {"type": kind, "uri": shape.uri, "file": shape.path, "scale": list(shape.scale)}
    sizes = {name: getattr(shape, name) for name in ("size", "radius", "length") if hasattr(shape, name)}
    return {"type": kind, **{k: list(v) if isinstance(v, tuple) else v for k, v in sizes.items()}}


def _joint(joint: Joint) -> dict[str, Any]:
    limit = joint.limit
    return {
        "name": joint.name,
        "type": str(joint.type),
        "parent": joint.parent,
        "child": joint.child,
        "xyz": list(joint.pose.xyz),
        "rpy": list(joint.pose.rpy),
        "axis": list(joint.axis) if joint.is_movable else None,
        "lower": limit.lower if limit else None,
        "upper": limit.upper if limit else None,
        "effort": limit.effort if limit else None,
        "velocity": limit.velocity if limit else None,
        "mimic": joint.mimic.joint if joint.mimic else None,
        "file": joint.origin.span.file,
        "line": joint.origin.span.line,
    }


def _tree(robot: RobotModel) -> Iterator[str]:
    """The links as a tree, each with its joint, its mass and its place in the source."""
    rows: list[tuple[str, str, str, str]] = []
    waiting: list[tuple[str, str, str]] = [(robot.root, "", "")]
    while waiting:
        name, lead, below = waiting.pop()
        link = robot.links[name]
        joint = robot.parent_joint.get(name)
        held = f"{joint.type} {joint.name}" if joint else ""
        mass = f"{link.inertial.mass:.4g} kg" if link.inertial else "-"
        span = link.origin.span
        rows.append((lead + name, held, mass, f"{_short(span.file)}:{span.line}"))
        children = robot.child_joints[name]
        for i, child in reversed(list(enumerate(children))):
            last = i == len(children) - 1
            if len(below) >= 3 * _DEEPEST:  # a level of the tree is three characters wide
                waiting.append((child.child, below[:-3] + "…  ", below))
                continue
            waiting.append(
                (child.child, below + ("└─ " if last else "├─ "), below + ("   " if last else "│  "))
            )
    yield from aligned(rows, left=(0, 1, 3))


def _short(path: str) -> str:
    """The path, or the path relative to the working directory if that is shorter."""
    try:
        relative = os.path.relpath(path)
    except ValueError:  # on another drive of Windows
        return path
    return min(relative, path, key=len)


def _vector(values: Sequence[float]) -> str:
    return "(" + ", ".join(f"{round(value, 9) + 0.0:.4g}" for value in values) + ")"


def _s(count: int) -> str:
    return "" if count == 1 else "s"
