"""The objects of a picture: a robot and the world around it, at their current poses."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics import FrameTree
from kbot.kinematics.transform import Transform
from kbot.model import RobotModel
from kbot.render.bounds import visible_bounds
from kbot.render.surfaces import PaintedSurface, body_surfaces, robot_surfaces
from kbot.world.sdf.materials import link_colours

if TYPE_CHECKING:  # the engine's modules, which a picture of a robot alone does not need
    from kbot.sim import Simulation


@dataclass(frozen=True, slots=True)
class PictureScene:
    """The visible surfaces of each link and of all other objects, in the world frame.

    `centre` (3,) and `radius` enclose the robot, `ground` is the height of the floor, and `view_radius` is
    the radius that the picture shows; all in m.
    """

    links: Mapping[str, tuple[PaintedSurface, ...]]
    others: tuple[PaintedSurface, ...]
    centre: NDArray[np.float64]
    radius: float
    ground: float
    view_radius: float


def robot_alone(robot: RobotModel, joints: Mapping[str, float] | None = None) -> PictureScene:
    """Return a robot with its joints at `joints` (rad, m; others at 0), on a floor under its lowest point.

    Raises:
        KbotError: an unknown joint, or a position that is not finite.
    """
    return _things(robot, FrameTree(robot).poses(joints), (), on_ground=False)


def robot_in_world(simulation: Simulation) -> PictureScene:
    """Return a simulated robot and its world at their current poses, in Gazebo's colours where the files set
    them."""
    now = simulation.models.body_poses()
    others = (
        surface.moved(now.get(body.name, body.pose))
        for body in simulation.world.bodies
        for surface in body_surfaces(body)
    )
    return _things(simulation.robot, simulation.link_poses(), others, on_ground=True)


def _things(
    robot: RobotModel, poses: Mapping[str, Transform], others: Iterable[PaintedSurface], *, on_ground: bool
) -> PictureScene:
    low, high = visible_bounds(robot)
    colours = link_colours(robot) if on_ground else {}
    links = {
        name: tuple(surface.moved(poses[name]) for surface in surfaces)
        for name, surfaces in robot_surfaces(robot, colours).items()
    }
    corners = [surface.vertices for surfaces in links.values() for surface in surfaces]
    ground = 0.0 if on_ground else min(0.0, *(float(part[:, 2].min()) for part in corners), 0.0)
    centre = poses[robot.root].translation + (low + high) / 2.0
    radius = max(0.02, float(np.linalg.norm(high - low)) / 2.0)
    return PictureScene(links, tuple(others), centre, radius, ground, radius * (2.0 if on_ground else 1.0))
