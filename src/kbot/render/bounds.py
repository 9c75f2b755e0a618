"""The bounding box of a robot's visible shapes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from kbot.kinematics.frames import FrameTree
from kbot.kinematics.transform import Transform
from kbot.model import RobotModel
from kbot.model.shapes import bounds
from kbot.text import KbotError


def visible_bounds(robot: RobotModel) -> tuple[np.ndarray, np.ndarray]:
    """Return the robot's lowest and highest corner (3,) with all joints at 0, in m in its root frame.

    A link without visuals counts with its collisions. A robot without shapes counts with the origins of its
    links.
    """
    poses = FrameTree(robot).poses({})
    boxes = list(_bounds(robot, poses))
    if not boxes:
        points = np.array([pose.translation for pose in poses.values()])
        return points.min(axis=0), points.max(axis=0)
    return np.min([low for low, _ in boxes], axis=0), np.max([high for _, high in boxes], axis=0)


def _bounds(robot: RobotModel, poses: dict[str, Transform]) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    for link in robot.links.values():
        for part in link.visuals or link.collisions:
            pose = poses[link.name] @ Transform.of(part.pose)
            try:
                box = bounds(part.geometry, pose.rotation)
            except KbotError:
                box = None
            low, high = box or (0.0, 0.0)  # an unreadable mesh counts as a point at its pose
            yield low + pose.translation, high + pose.translation
