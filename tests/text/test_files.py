"""Files are read with one clear error, and written whole or not at all."""

import os
import stat
from pathlib import Path

import pytest

from kbot.text import DescriptionError, KbotError, read_source, write_text


def code(path: Path, **options: int) -> str:
    with pytest.raises(DescriptionError) as caught:
        read_source(path, **options)
    return caught.value.diagnostics[0].code


def test_reading(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes("\ufeffé".encode())
    assert read_source(tmp_path / "a").text == "é"
    (tmp_path / "latin").write_bytes(b"\xe9")
    assert code(tmp_path / "gone") == "F001"
    assert code(tmp_path) == "F002"
    assert code(tmp_path / "a" / "b") == "F003"
    assert code(tmp_path / "a", max_bytes=2) == "F004"
    assert code(tmp_path / "latin") == "F005"


def test_a_missing_file_has_a_neighbour(tmp_path: Path) -> None:
    (tmp_path / "robot.xacro").write_text("<a/>")
    with pytest.raises(DescriptionError) as caught:
        read_source(tmp_path / "robt.xacro")
    assert caught.value.diagnostics[0].hint == "did you mean 'robot.xacro'?"


def test_writing_replaces_the_whole_and_keeps_the_mode(tmp_path: Path) -> None:
    path = tmp_path / "out"
    path.write_text("old and longer")
    path.chmod(0o640)
    write_text(path, "new\r\n")
    assert path.read_bytes() == b"new\r\n"
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    assert [child.name for child in tmp_path.iterdir()] == ["out"]


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "real").write_text("old")
    (tmp_path / "link").symlink_to(tmp_path / "real")
    write_text(tmp_path / "link", "new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real").read_text() == "new"


@pytest.mark.skipif(os.name == "nt", reason="Windows has no devices among its files")
def test_a_device_is_written_to_and_not_replaced() -> None:
    write_text("/dev/null", "text")
    assert stat.S_ISCHR(Path("/dev/null").stat().st_mode)


def test_a_folder_that_is_not_there_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(KbotError, match="cannot be written"):
        write_text(tmp_path / "none" / "out", "text")
