"""Debian's rviz opens a configuration that KBot wrote, with every display that both support."""

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

from kbot.workbench.displays.display_settings import Display, DisplaySettings
from kbot.workbench.displays.kinds import KINDS
from kbot.workbench.displays.rviz import write_rviz

from .conftest import Ros, stop, wait_until
from .test_bridge_rviz import CONFIG, output_of, plate_centre

SHARED = [kind for kind in KINDS if kind.rviz]
HIDDEN = {"Grid", "TF", "Axes"}
"""Displays that would cover the robot, or have its colour beside it."""
DOCKS = 342
"""Width in pixels of the docks on the left, where rviz shows the windows of images and cameras."""


@pytest.fixture
def opened(ros: Ros, display: Path, tmp_path: Path) -> Iterator[tuple[Ros, Path]]:
    """rviz beside a simulation, with an rviz 1 file that KBot changed. Yields also the log of rviz."""
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
        wait_until(lambda: "/robot_description" in output_of(ros, "rosparam", "list"), "description")
        running.append(ros.start("rviz", "-d", str(config)))
        yield ros, log
    finally:
        for process in reversed(running):
            stop(process)


def test_rviz_opens_a_file_that_kbot_wrote(opened: tuple[Ros, Path], display: Path) -> None:
    _, log = opened
    wait_until(lambda: plate_centre(display, DOCKS) is not None, "blue plate on rviz's screen", 120)
    output = log.read_text()
    assert "ERROR" not in output, output
    assert "could not be loaded" not in output.lower(), output
