"""Pictures of a running episode with its goal, from behind and above the robot."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kbot.render.bounds import visible_bounds
from kbot.render.look import Look
from kbot.render.picture import Painter
from kbot.render.picture_scene import PictureScene
from kbot.render.surfaces import body_surfaces, robot_surfaces
from kbot.sim import Simulation
from kbot.world.builders import at, cylinder

LOOK = Look(480, 360, elevation=50.0, theme="light")
_VIEW = 8.0
"""How many times larger than the robot the view is: the obstacles around it are seen."""
_FINER = 2
"""Edges need not be as smooth as those of a still picture."""
_GOAL, _GREEN, _FLAT = "/goal of the episode", (0.1, 0.6, 0.25, 1.0), 0.01
"""The body that marks the goal, its colour, and its height in m: it lies on the ground."""


class Picture:
    """Draws one simulation. The surfaces are loaded once."""

    def __init__(self, simulation: Simulation) -> None:
        """Raises KbotError: off-screen OpenGL is not available. The message names what to install."""
        self.simulation = simulation
        robot = simulation.robot
        low, high = visible_bounds(robot)
        self._middle = (low + high) / 2.0
        self._radius = max(0.02, float(np.linalg.norm(high - low)) / 2.0)
        bodies = {f"/{body.name}": tuple(body_surfaces(body)) for body in simulation.world.bodies}
        bodies |= {link: tuple(surfaces) for link, surfaces in robot_surfaces(robot).items()}
        bodies[_GOAL] = tuple(body_surfaces(cylinder(_GOAL, self._radius / 2.0, _FLAT, 0.0, 0.0, _GREEN)))
        drawn = {name: surfaces for name, surfaces in bodies.items() if surfaces}
        self._painter = Painter(drawn, LOOK, self._radius, _FINER)

    def draw(self, goal: tuple[float, float]) -> NDArray[np.uint8]:
        """The picture (height, width, 3) of the current state. `goal` is in m in the world's frame."""
        simulation = self.simulation
        now = simulation.models.body_poses()
        poses = {f"/{body.name}": now.get(body.name, body.pose) for body in simulation.world.bodies}
        poses |= simulation.link_poses()
        poses[_GOAL] = at(*goal, _FLAT / 2.0)
        centre = poses[simulation.robot.root].translation + self._middle
        view = PictureScene({}, (), centre, self._radius, 0.0, self._radius * _VIEW)
        return self._painter.paint(poses, view)
