"""A folder with a package that has a robot."""

from pathlib import Path

import pytest

from .ros2_files import ROBOT


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "package.xml").write_text("<package format='3'><name>mine</name></package>")
    (tmp_path / "r.urdf").write_text(ROBOT)
    return tmp_path
