"""Debian's rviz shows a simulated KBot in its colours and where it drives."""

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import yaml

from .conftest import Ros, stop, wait_until
from .test_kbot_description import picture

PIXELS_PER_METRE = 400
PLATE = 0.16
"""Size of KBot's base_link in m."""
CONFIG = {
    "Panels": [],
    "Visualization Manager": {
        "Class": "",
        "Displays": [
            {
                "Class": "rviz/RobotModel",
                "Enabled": True,
                "Name": "Robot",
                "Robot Description": "robot_description",
            }
        ],
        "Global Options": {"Background Color": "255; 255; 255", "Fixed Frame": "odom"},
        "Views": {
            "Current": {
                "Class": "rviz/TopDownOrtho",
                "Name": "Current View",
                "Scale": PIXELS_PER_METRE,
                "Angle": 0,
                "X": 0,
                "Y": 0,
                "Target Frame": "<Fixed Frame>",
            }
        },
    },
    "Window Geometry": {"Hide Left Dock": True, "Hide Right Dock": True, "Width": 1280, "Height": 900},
}


@pytest.fixture
def shown(ros: Ros, display: Path, tmp_path: Path) -> Iterator[Ros]:
    """A simulation in real time with KBot's master, and rviz with a view from above."""
    config = tmp_path / "above.rviz"
    config.write_text(yaml.safe_dump(CONFIG))
    running = [ros.start(sys.executable, "-m", "kbot", "sim", "kbot", "--headless", "--ros1")]
    try:
        wait_until(lambda: "/robot_description" in output_of(ros, "rosparam", "list"), "description")
        running.append(ros.start("rviz", "-d", str(config)))
        yield ros
    finally:
        for process in reversed(running):
            stop(process)


def output_of(ros: Ros, *command: str) -> str:
    try:
        return ros.run(*command)
    except AssertionError:
        return ""


def blue(display: Path) -> np.ndarray:
    """Rows and columns of the pixels that have the blue of the base."""
    pixels = picture(display).astype(int)
    return np.argwhere((pixels[..., 2] > 80) & (pixels[..., :2].max(axis=2) < 12))


def plate_centre(display: Path, docks: int = 0) -> np.ndarray | None:
    """The centre of the plate on the screen, or None unless its full size, PLATE by PLATE, is visible.
    `docks` is the width in pixels of rviz's docks on the left, where a camera's window can also show the
    plate."""
    found = blue(display)
    found = found[found[:, 1] >= docks]
    if len(found) == 0:
        return None
    low, high = found.min(axis=0), found.max(axis=0)
    is_whole = (np.abs(high + 1 - low - PLATE * PIXELS_PER_METRE) <= 2).all()
    return (low + high) / 2 if is_whole else None


def odometry(ros: Ros) -> float:
    return float(ros.run("rostopic", "echo", "-n", "1", "/odom/pose/pose/position/x").partition("---")[0])


def test_rviz_shows_the_robot_in_its_colours_and_follows_it(shown: Ros, display: Path) -> None:
    wait_until(lambda: plate_centre(display) is not None, "blue plate on rviz's screen", 120)
    before = plate_centre(display)
    black = (picture(display).max(axis=2) < 8).sum()
    assert black > 60  # the wheels, beside the plate
    driving = shown.start(
        "rostopic", "pub", "-r", "10", "/cmd_vel", "geometry_msgs/Twist", "{linear: {x: 0.15}}"
    )
    try:
        wait_until(lambda: odometry(shown) > 0.4, "driving robot")
    finally:
        stop(driving)
    wait_until(lambda: is_standing(shown), "standing robot")
    distance = odometry(shown)

    def has_followed() -> bool:
        now = plate_centre(display)
        return now is not None and abs(np.linalg.norm(now - before) - distance * PIXELS_PER_METRE) < 6

    wait_until(has_followed, f"plate {distance:.2f} m further on rviz's screen", 30)


def is_standing(ros: Ros) -> bool:
    text = output_of(ros, "rostopic", "echo", "-n", "1", "/odom/twist/twist/linear/x").partition("---")[0]
    return bool(text.strip()) and abs(float(text)) < 1e-3
