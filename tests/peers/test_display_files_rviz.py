"""Debian's rviz opens a configuration that KBot wrote with every display that both have."""

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

from kbot.workbench.displays.display_settings import Display, DisplaySettings
from kbot.workbench.displays.kinds import KINDS
from kbot.workbench.displays.rviz import write_rviz

from .conftest import Ros, stop, wait_until
from .test_bridge_rviz import CONFIG, said, stands

SHARED = [kind for kind in KINDS if kind.rviz]
HIDDEN = {"Grid", "TF", "Axes"}
"""What would lie over the robot, or beside it in its colour."""
DOCKS = 342
"""Pixels on the left that rviz gives to the windows of images and cameras."""


@pytest.fixture
def opened(ros: Ros, display: Path, tmp_path: Path) -> Iterator[tuple[Ros, Path]]:
    """rviz beside a simulation, with a file that KBot wrote over one of rviz 1; and what rviz says."""
    original = yaml.safe_load(yaml.safe_dump(CONFIG))
    displays = [Display("RobotModel", "Robot", True, {}, 0)]
    displays += [
        Display(kind.name, kind.name, kind.name not in HIDDEN, {}, -1)
        for kind in SHARED
        if kind.name != "RobotModel"
    ]
    config = tmp_path / "written.rviz"
    config.write_text(write_rviz(DisplaySettings({}, tuple(displays)), original))
    running = [ros.start(sys.executable, "-m", "kbot", "sim", "kbot", "--headless", "--ros1")]
    log = ros.home / "rviz.log"
    log.unlink(missing_ok=True)
    try:
        wait_until(lambda: "/robot_description" in said(ros, "rosparam", "list"), "a description")
        running.append(ros.start("rviz", "-d", str(config)))
        yield ros, log
    finally:
        for process in reversed(running):
            stop(process)


def test_rviz_opens_what_kbot_wrote(opened: tuple[Ros, Path], display: Path) -> None:
    _, log = opened
    wait_until(lambda: stands(display, DOCKS) is not None, "a blue plate on rviz's screen", 120)
    said_by_rviz = log.read_text()
    assert "ERROR" not in said_by_rviz, said_by_rviz
    assert "could not be loaded" not in said_by_rviz.lower(), said_by_rviz
