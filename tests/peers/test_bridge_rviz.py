"""Debian's rviz on a simulated KBot: it shows the robot, in its colours, and where it drives to."""

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import yaml

from .conftest import Ros, stop, wait_until
from .test_kbot_description import picture

PIXELS_A_METRE = 400
PLATE = 0.16
"""Metres, as KBot's base_link is written."""
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
                "Scale": PIXELS_A_METRE,
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
    """A simulation in real time with our own master, and rviz looking down on it."""
    config = tmp_path / "above.rviz"
    config.write_text(yaml.safe_dump(CONFIG))
    running = [ros.start(sys.executable, "-m", "kbot", "sim", "kbot", "--headless", "--ros1")]
    try:
        wait_until(lambda: "/robot_description" in said(ros, "rosparam", "list"), "a description")
        running.append(ros.start("rviz", "-d", str(config)))
        yield ros
    finally:
        for process in reversed(running):
            stop(process)


def said(ros: Ros, *command: str) -> str:
    try:
        return ros.run(*command)
    except AssertionError:
        return ""


def blue(display: Path) -> np.ndarray:
    """Where the screen is blue as the base: rows and columns of its pixels."""
    pixels = picture(display).astype(int)
    return np.argwhere((pixels[..., 2] > 80) & (pixels[..., :2].max(axis=2) < 12))


def stands(display: Path, docks: int = 0) -> np.ndarray | None:
    """The middle of the plate on the screen, once it is as large there as it is: PLATE by PLATE. So many
    pixels on the left are of docks, where a camera's window may show it too."""
    found = blue(display)
    found = found[found[:, 1] >= docks]
    if len(found) == 0:
        return None
    low, high = found.min(axis=0), found.max(axis=0)
    is_whole = (np.abs(high + 1 - low - PLATE * PIXELS_A_METRE) <= 2).all()
    return (low + high) / 2 if is_whole else None


def odometry(ros: Ros) -> float:
    return float(ros.run("rostopic", "echo", "-n", "1", "/odom/pose/pose/position/x").partition("---")[0])


def test_rviz_shows_it_in_its_colours_and_where_it_drives(shown: Ros, display: Path) -> None:
    wait_until(lambda: stands(display) is not None, "a blue plate on rviz's screen", 120)
    before = stands(display)
    black = (picture(display).max(axis=2) < 8).sum()
    assert black > 60  # the wheels, beside the plate
    driving = shown.start(
        "rostopic", "pub", "-r", "10", "/cmd_vel", "geometry_msgs/Twist", "{linear: {x: 0.15}}"
    )
    try:
        wait_until(lambda: odometry(shown) > 0.4, "it driving")
    finally:
        stop(driving)
    wait_until(lambda: still(shown), "it standing")
    gone = odometry(shown)

    def has_followed() -> bool:
        now = stands(display)
        return now is not None and abs(np.linalg.norm(now - before) - gone * PIXELS_A_METRE) < 6

    wait_until(has_followed, f"the plate {gone:.2f} m further on rviz's screen", 30)


def still(ros: Ros) -> bool:
    text = said(ros, "rostopic", "echo", "-n", "1", "/odom/twist/twist/linear/x").partition("---")[0]
    return bool(text.strip()) and abs(float(text)) < 1e-3
