"""Tests reading files with clear errors, and writing files completely or not at all."""

import codecs
import gzip
import os
import stat
import tempfile
import time
from pathlib import Path
from xml.etree import ElementTree

import pytest

from kbot.text import DescriptionError, KbotError, parse_xml, read_source, rewrite, write_text
from kbot.text.files import SCRATCH_SECONDS, from_file_uri


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


def test_a_package_instead_of_a_description_lists_its_files(tmp_path: Path) -> None:
    (tmp_path / "urdf").mkdir()
    (tmp_path / "urdf" / "arm.xacro").touch()
    (tmp_path / "urdf" / "notes.txt").touch()
    with pytest.raises(DescriptionError) as caught:
        read_source(tmp_path)
    assert caught.value.diagnostics[0].hint == f"choose a file in it: {tmp_path / 'urdf' / 'arm.xacro'}"


def message(path: Path | str) -> str:
    with pytest.raises(DescriptionError) as caught:
        read_source(path)
    return caught.value.diagnostics[0].message


@pytest.mark.skipif(os.name == "nt", reason="Windows has no devices among its files")
def test_files_that_may_never_end_are_rejected(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to("/dev/zero")
    for name in (tmp_path / "pipe", tmp_path / "link", Path("/dev/zero"), Path("/dev/null")):
        assert code(name) == "F003"
        assert "is not a regular file" in message(name)


@pytest.mark.skipif(not Path("/dev/fd").exists(), reason="the system has no /dev/fd")
def test_a_pipe_of_the_shell_is_read_to_its_end() -> None:
    reading, writing = os.pipe()
    with os.fdopen(reading, "rb"):
        with os.fdopen(writing, "wb") as stream:
            stream.write(b"<a>" + b" " * 5000 + b"</a>")
        assert read_source(f"/dev/fd/{reading}").text == "<a>" + " " * 5000 + "</a>"


def test_an_empty_name_and_a_broken_link(tmp_path: Path) -> None:
    assert message("") == "the file name is empty"
    (tmp_path / "robot.xacro").symlink_to(tmp_path / "gone.xacro")
    expected = (
        f"{tmp_path / 'robot.xacro'} is a symbolic link to {tmp_path / 'gone.xacro'}, which does not exist"
    )
    assert message(tmp_path / "robot.xacro") == expected


@pytest.mark.parametrize(
    ("declared", "codec"),
    [
        (None, "utf-16"),
        ("UTF-16", "utf-16"),
        ("utf-16", "utf-16-le"),
        ("iso-8859-1", "latin-1"),
        ("windows-1252", "cp1252"),
        ("UTF-8", "utf-8-sig"),
    ],
)
def test_other_encodings_are_read_and_kept(tmp_path: Path, declared: str | None, codec: str) -> None:
    head = f'<?xml version="1.0" encoding="{declared}"?>' if declared else '<?xml version="1.0"?>'
    text = f'{head}<robot name="Räder"/>'
    path = tmp_path / "robot.xacro"
    path.write_bytes(text.encode(codec))
    source = read_source(path)
    assert source.text == text
    assert parse_xml(source).attributes["name"] == "Räder"
    assert ElementTree.parse(path).getroot().attrib["name"] == "Räder"
    write_text(path, text.replace("Räder", "Rädchen"))
    assert ElementTree.parse(path).getroot().attrib["name"] == "Rädchen"


@pytest.mark.parametrize(
    ("declared", "mark", "codec"),
    [
        ("UTF-8", codecs.BOM_UTF8, "utf-8"),
        ("iso-8859-1", b"", "latin-1"),
        ("UTF-16", codecs.BOM_UTF16_LE, "utf-16-le"),
        ("UTF-16", codecs.BOM_UTF16_BE, "utf-16-be"),
        ("UTF-8", codecs.BOM_UTF16_BE, "utf-16-be"),  # the byte order mark overrides the declaration
        ("UTF-16BE", b"", "utf-16-be"),
        ("UTF-16", b"", "utf-16-le"),
    ],
)
def test_a_file_keeps_its_mark_and_its_encoding(
    tmp_path: Path, declared: str, mark: bytes, codec: str
) -> None:
    text = f'<?xml version="1.0" encoding="{declared}"?>\r\n<robot name="Räder"/>'
    path = tmp_path / "robot.xacro"
    path.write_bytes(mark + text.encode(codec))
    before = read_source(path).text
    rewrite({str(path): (before, before.replace("Räder", "Rädchen"))})
    assert path.read_bytes() == mark + text.replace("Räder", "Rädchen").encode(codec)


def test_files_are_rewritten_all_or_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first, two = tmp_path / "one", tmp_path / "folder" / "two"
    two.parent.mkdir()
    first.write_text("a")
    two.write_text("b")
    with pytest.raises(KbotError, match="two has changed in the meantime"):
        rewrite({str(first): ("a", "A"), str(two): ("c", "C")})

    make = tempfile.mkstemp

    def read_only(prefix: str, suffix: str, dir: str) -> tuple[int, str]:
        if dir == str(two.parent):
            raise PermissionError(13, "Permission denied")
        return make(prefix=prefix, suffix=suffix, dir=dir)

    monkeypatch.setattr(tempfile, "mkstemp", read_only)
    with pytest.raises(KbotError, match=r"two cannot be written \(no file was changed\): Permission denied"):
        rewrite({str(first): ("a", "A"), str(two): ("b", "B")})
    assert (first.read_text(), two.read_text()) == ("a", "b")
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["folder", "one", "two"]
    monkeypatch.undo()
    rewrite({str(first): ("a", "A"), str(two): ("b", "B")})
    assert (first.read_text(), two.read_text()) == ("A", "B")


def test_an_edit_saved_during_a_rewrite_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "robot.xacro"
    path.write_text("old")
    make = tempfile.mkstemp

    def saved_meanwhile(prefix: str, suffix: str, dir: str) -> tuple[int, str]:
        path.write_text("saved")
        return make(prefix=prefix, suffix=suffix, dir=dir)

    monkeypatch.setattr(tempfile, "mkstemp", saved_meanwhile)
    with pytest.raises(KbotError, match="changed in the meantime"):
        rewrite({str(path): ("old", "new")})
    assert path.read_text() == "saved"


def test_a_read_only_file_is_not_changed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "robot.xacro"
    path.write_text("old")
    monkeypatch.setattr(os, "access", lambda path, mode: mode != os.W_OK)  # root can write everywhere
    with pytest.raises(KbotError, match="cannot be written: Permission denied"):
        rewrite({str(path): ("old", "new")})
    assert path.read_text() == "old"


def test_a_compressed_file_is_named_as_such(tmp_path: Path) -> None:
    path = tmp_path / "robot.xacro"
    path.write_bytes(gzip.compress(b'<robot name="r"/>'))
    assert code(path) == "F005"
    assert "is compressed with gzip. Decompress it first" in message(path)


@pytest.mark.parametrize("name", ["us-ascii", "UTF-8"])
def test_bytes_that_do_not_match_the_declared_encoding(tmp_path: Path, name: str) -> None:
    path = tmp_path / "robot.xacro"
    path.write_bytes(f'<?xml version="1.0" encoding="{name}"?><robot name="Räder"/>'.encode("latin-1"))
    assert code(path) == "F005"
    assert "byte 0xe4" in message(path)


@pytest.mark.parametrize("name", ["UTF-16", "shift_jis", "klingon"])
def test_an_encoding_that_is_not_possible(tmp_path: Path, name: str) -> None:
    path = tmp_path / "robot.xacro"
    path.write_bytes(f'<?xml version="1.0" encoding="{name}"?><robot name="r"/>'.encode())
    assert code(path) == "F005"
    assert name in message(path)


def test_a_missing_file_has_a_suggestion(tmp_path: Path) -> None:
    (tmp_path / "robot.xacro").write_text("<a/>")
    with pytest.raises(DescriptionError) as caught:
        read_source(tmp_path / "robt.xacro")
    assert caught.value.diagnostics[0].hint == "did you mean 'robot.xacro'?"


def test_writing_replaces_the_file_and_keeps_its_mode(tmp_path: Path) -> None:
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


def test_a_missing_folder_is_one_clear_error(tmp_path: Path) -> None:
    with pytest.raises(KbotError, match="cannot be written"):
        write_text(tmp_path / "none" / "out", "text")


def test_a_file_uri_on_windows_has_a_drive() -> None:
    assert from_file_uri("/C:/robot/a.stl", windows=True) == "C:/robot/a.stl"
    assert from_file_uri("/C:/robot/a.stl", windows=False) == "/C:/robot/a.stl"
    assert from_file_uri("/robot/a.stl", windows=True) == "/robot/a.stl"


def test_a_missing_file_is_found_below_the_working_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for folder in ("mine/urdf", ".hidden"):
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / "robot.xacro").write_text("<robot/>")
    (tmp_path / "mine/round").symlink_to(tmp_path)
    with pytest.raises(DescriptionError) as error:
        read_source("robot.xacro")
    assert error.value.diagnostics[0].hint == f"did you mean {Path('mine/urdf/robot.xacro')}?"
    with pytest.raises(DescriptionError) as error:  # as for an include: a file may have hundreds
        read_source("robot.xacro", from_pipe=False)
    assert error.value.diagnostics[0].hint == ""
    (tmp_path / "robot").mkdir()
    (tmp_path / "robot/robot.xacro").write_text("<robot/>")
    with pytest.raises(DescriptionError) as error:  # two candidates are ambiguous
        read_source("robot.xacro")
    assert error.value.diagnostics[0].hint == ""


def test_scratch_files_of_a_killed_run_are_removed_by_the_next(tmp_path: Path) -> None:
    (tmp_path / ".robot.urdf.1234.kbot-scratch").write_text("new")  # of a run that writes now
    old = tmp_path / ".robot.urdf.abcd.kbot-scratch"
    other = tmp_path / ".other.urdf.abcd.kbot-scratch"
    for file in (old, other):
        file.write_text("half")
        os.utime(file, times=(0.0, time.time() - 2 * SCRATCH_SECONDS))
    write_text(tmp_path / "robot.urdf", "<robot/>")
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        ".other.urdf.abcd.kbot-scratch",
        ".robot.urdf.1234.kbot-scratch",
        "robot.urdf",
    ]
