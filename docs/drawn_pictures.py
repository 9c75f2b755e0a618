"""The pictures that KBot draws without a browser: those of the tutorial's steps, and of the built-in worlds.

    python docs/drawn_pictures.py

draws those of the tutorial again, which are committed, so that the pages have pictures on GitHub too.
"""

from __future__ import annotations

import io
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image

from kbot import Simulation, load
from kbot.render.look import Look
from kbot.render.path_plot import draw as draw_paths
from kbot.render.picture import draw_picture
from kbot.render.picture_scene import PictureScene, robot_alone, robot_in_world
from kbot.sim.report import Odometer
from kbot.sim.script import Script
from kbot.world import BUILDERS

LOOK = Look(width=480, height=300, theme="light")
WORLD_LOOK = Look(width=360, height=225, elevation=50.0, theme="light")
COLOURS = 64
"""Enough for shaded robots on a floor; a picture then has 5 to 15 kB."""
WIDEST = (720, 720)
STEPS = ("02_base", "04_wheels", "05_caster", "07_colours")
"""The steps whose picture is the robot alone. `page_pictures.py` takes those of the page."""


def draw_pictures(docs: Path) -> None:
    """Draw all pictures into a copy of the folder `docs`."""
    draw_tutorial(docs)
    for world in BUILDERS:
        scene = overview(robot_in_world(Simulation("kbot", world=world)))
        path = docs / "reference" / "images" / f"{world}.png"
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(draw_picture(scene, WORLD_LOOK))


def overview(scene: PictureScene) -> PictureScene:
    """The scene with the camera moved back so that all objects are visible."""
    if not scene.others:
        return scene
    corners = np.concatenate([scene.centre[None], *(surface.vertices for surface in scene.others)])
    low, high = corners.min(axis=0), corners.max(axis=0)
    radius = float(np.linalg.norm(high - low)) / 2.0
    return replace(scene, centre=(low + high) / 2.0, view_radius=0.6 * radius)  # the corners may be cut off


def draw_tutorial(docs: Path) -> None:
    steps, images = docs / "tutorial" / "steps", docs / "tutorial" / "images"
    for step in STEPS:
        _write(images / f"{step}.png", draw_picture(robot_alone(load(steps / f"{step}.xacro")), LOOK))
    simulation = Simulation(steps / "09_drive.xacro")
    odometer = Odometer(simulation, keeps=True)
    Script(str(steps / "drive.py")).run(simulation)
    paths = draw_paths(odometer.truth, odometer.odometry, simulation.world, "my_robot drives a square")
    _write(images / "11_square.png", paths)
    simulation = Simulation(steps / "09_drive.xacro", world="rooms:columns=1,rows=1,size=2")
    Script(str(steps / "avoid.py")).run(simulation)
    _write(images / "12_room.png", draw_picture(robot_in_world(simulation), LOOK))


def _write(path: Path, png: bytes) -> None:
    """Store a picture with few colours."""
    path.parent.mkdir(exist_ok=True)
    picture = Image.open(io.BytesIO(png)).convert("RGB")
    picture.thumbnail(WIDEST)
    picture.quantize(COLOURS).save(path, optimize=True)


if __name__ == "__main__":
    sys.exit(draw_tutorial(Path(__file__).parent))
