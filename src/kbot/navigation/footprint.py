"""How much room a robot takes as it drives and turns."""

from __future__ import annotations

from itertools import product
from math import hypot

from kbot.kinematics.differential_drive import NoDrive, find_drive
from kbot.kinematics.frames import FrameTree
from kbot.kinematics.transform import Transform
from kbot.model import Robot
from kbot.model.shapes import bounds
from kbot.text import KbotError


def turning_radius(robot: Robot) -> float:
    """Metres from the base's origin to the robot's furthest point seen from above, joints at zero: what it
    takes to stand there with any heading. A box about each shape stands for it.

    Raises:
        KbotError: the robot does not drive, or has nothing that could touch an obstacle.
    """
    tree = FrameTree(robot)
    drive = find_drive(robot, tree)
    if isinstance(drive, NoDrive):
        raise KbotError(f"robot '{robot.name}' cannot drive: {drive.reason}")
    furthest = 0.0
    for link in robot.links.values():
        for collision in link.collisions:
            reach = bounds(collision.geometry)
            if reach is None:
                continue
            pose = Transform.from_xyz_rpy(collision.pose.xyz, collision.pose.rpy)
            in_base = tree.pose(link.name, in_frame=drive.base) @ pose
            for corner in product(*zip(*(v.tolist() for v in reach), strict=True)):
                x, y, _ = in_base.apply(corner).tolist()
                furthest = max(furthest, hypot(x, y))
    if furthest == 0.0:
        raise KbotError(f"robot '{robot.name}' has no <collision>: nothing says how much room it needs")
    return furthest
