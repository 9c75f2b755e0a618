"""What the page and Python programs write in a folder whose name is not UTF-8."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import kbot
from kbot.kinematics.planar_pose import PlanarPose
from kbot.text import KbotError
from kbot.workbench.displays.display_file import DisplayFile
from kbot.workbench.protocol import Mark, SaveSource
from kbot.workbench.protocol.codec import encode
from kbot.workbench.source.saving import save
from kbot.workbench.timeline.marks import Marks
from kbot.world.occupancy import OccupancyGrid
from kbot.world.occupancy_files import read_map, write_map

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="file names are bytes on Linux alone")
NAME = os.fsdecode(b"r\xfe")
ROBOT = '<robot name="{}"><link name="a"/></robot>'
GRID = OccupancyGrid(np.zeros((2, 3), dtype=np.int8), 0.1, PlanarPose(0.0, 0.0, 0.0))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    folder = tmp_path / os.fsdecode(b"f\xff")
    folder.mkdir()
    return folder


def save_source(folder: Path) -> None:
    file = folder / f"{NAME}.urdf"
    file.write_text(ROBOT.format("old"))
    saved = save(SaveSource(str(file), ROBOT.format("old"), ROBOT.format("new")))
    assert file.read_text() == ROBOT.format("new")
    encode(saved).encode("utf-8")  # as it is sent to the page


def save_bookmarks(folder: Path) -> None:
    recording = str(folder / f"{NAME}.mcap")
    Marks(recording).handle(Mark(1.0, 2.0))
    assert [mark.at for mark in Marks(recording).view.all] == [1.0]


def save_displays(folder: Path) -> None:
    for suffix in (".kbot.yaml", ".rviz"):
        saved = DisplayFile(str(folder / f"{NAME}{suffix}")).save("file", {}, "base")
        encode(saved).encode("utf-8")
        assert DisplayFile(str(folder / f"{NAME}{suffix}")).greeting is not None


def save_page(folder: Path) -> None:
    (folder / f"{NAME}.urdf").write_text(ROBOT.format("r"))
    kbot.load(str(folder / f"{NAME}.urdf")).show().save(str(folder / f"{NAME}.html"))
    assert "<html" in (folder / f"{NAME}.html").read_text("utf-8")


def save_map(folder: Path) -> None:
    write_map(GRID, folder / "map.yaml")
    assert read_map(folder / "map.yaml").cells.shape == (2, 3)


@pytest.mark.parametrize("write", [save_source, save_bookmarks, save_displays, save_page, save_map])
def test_a_file_is_written_and_read_again(write: Callable[[Path], None], folder: Path) -> None:
    write(folder)


def test_a_map_cannot_name_an_image_that_is_not_utf_8(folder: Path) -> None:
    with pytest.raises(
        KbotError, match=r"is not UTF-8, so the map cannot name its image\. Choose another file name"
    ):
        write_map(GRID, folder / f"{NAME}.yaml")
    assert not list(folder.iterdir())


def test_a_map_names_its_image_whatever_its_characters(tmp_path: Path) -> None:
    for name in ("it's", "a\nb", "a: b #c", "\x85"):
        write_map(GRID, tmp_path / f"{name}.yaml")
        assert read_map(tmp_path / f"{name}.yaml").cells.shape == (2, 3)
