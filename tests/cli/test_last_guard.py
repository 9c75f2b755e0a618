"""Tests internal errors: one line, a crash file and exit status 2."""

import sys
import threading
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any, NoReturn

import pytest

from kbot.cli import start
from kbot.record.entry import RecordedMessage, Types
from kbot.record.index import open_index
from kbot.record.reader import Recording
from kbot.text import crash
from kbot.text.errors import KbotError, reading


class Panic(BaseException):
    """An error like those of extensions in Rust, which do not derive from Exception."""


def fails(error: BaseException) -> Callable[..., NoReturn]:
    def fail(*_: Any, **__: Any) -> NoReturn:
        raise error

    return fail


def deep(*_: Any, **__: Any) -> NoReturn:
    deep()


@pytest.fixture
def crashes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(crash, "state_folder", lambda: tmp_path / "state")
    monkeypatch.delenv("KBOT_DEBUG")
    monkeypatch.setattr(threading, "excepthook", threading.excepthook)  # main replaces it
    return tmp_path / "state" / "crashes"


@pytest.fixture
def kbot(monkeypatch: pytest.MonkeyPatch) -> Callable[..., int]:
    """Run a command line in this process and return its exit status."""

    def run(*words: str) -> int:
        monkeypatch.setattr(sys, "argv", ["kbot", *words])
        with pytest.raises(SystemExit) as stop:
            start.main()
        return stop.value.code if isinstance(stop.value.code, int) else 0

    return run


@pytest.fixture
def robot(tmp_path: Path) -> str:
    file = tmp_path / "robot.xacro"
    file.write_text('<robot name="x"><link name="a"/></robot>')
    return str(file)


@pytest.mark.parametrize("verb", ["expand", "check", "info"])
def test_an_internal_error_is_one_line(
    verb: str,
    kbot: Callable[..., int],
    robot: str,
    crashes: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr("kbot.xacro.engine._walk", fails(ZeroDivisionError("a bug\nof two lines")))
    assert kbot(verb, robot) == 2
    out, err = capsys.readouterr()
    (file,) = crashes.iterdir()
    assert out == ""
    assert err == (
        f"error: internal error while reading {robot} (ZeroDivisionError); "
        f"KBot {version('kbot')} wrote a crash file, please report it: {file}\n"
    )
    text = file.read_text()
    assert f"KBot {version('kbot')}\n" in text
    assert f"Python {sys.version}" in text
    assert f"kbot {verb} {robot}\n" in text
    assert "Traceback (most recent call last)" in text
    assert "ZeroDivisionError: a bug\nof two lines" in text


@pytest.mark.parametrize("words", [["info"], ["cut", "part.mcap", "--start", "0"]])
def test_an_error_within_a_recording_names_it(
    words: list[str],
    kbot: Callable[..., int],
    crashes: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    file = tmp_path / "run.mcap"
    file.write_bytes(b"\x89MCAP0\r\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("kbot.record.mcap_file.records", fails(ZeroDivisionError()))
    assert kbot("bag", words[0], str(file), *words[1:]) == 2
    assert f"error: internal error while reading {file} (ZeroDivisionError)" in capsys.readouterr().err
    assert len(list(crashes.iterdir())) == 1
    for read in (open_index, lambda path: next(Recording(path).entries())):
        with pytest.raises(ZeroDivisionError) as failure:
            read(str(file))
        assert f"while reading {file}" in failure.value.__notes__


def test_an_error_within_a_message_names_the_recording(monkeypatch: pytest.MonkeyPatch) -> None:
    types = Types("run.mcap")
    monkeypatch.setattr(types.ros2, "deserialize_cdr", fails(ZeroDivisionError()), raising=False)
    entry = RecordedMessage("/chatter", "std_msgs/msg/String", 1, b"", types)
    with pytest.raises(ZeroDivisionError) as failure:
        entry.message()
    assert failure.value.__notes__ == ["while reading run.mcap"]


@pytest.mark.parametrize(
    ("fault", "name"),
    [(deep, "RecursionError"), (fails(MemoryError()), "MemoryError"), (fails(Panic("rust")), "Panic")],
)
def test_every_error_is_caught(
    fault: Callable[..., NoReturn],
    name: str,
    kbot: Callable[..., int],
    crashes: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr("kbot.cli.main.run", fault)
    assert kbot("rule") == 2
    assert capsys.readouterr().err.startswith(f"error: internal error ({name}); KBot ")
    assert name in next(crashes.iterdir()).read_text()


def test_ctrl_c_and_exit_statuses_pass_through(
    kbot: Callable[..., int], crashes: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("kbot.cli.main.run", fails(KeyboardInterrupt()))
    assert kbot("rule") == 130
    monkeypatch.setattr("kbot.cli.main.run", lambda *_: 7)
    assert kbot("rule") == 7
    assert not crashes.exists()


def test_the_line_is_printed_without_a_crash_file(
    kbot: Callable[..., int],
    crashes: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    crashes.parent.write_text("a file where the folder should be")
    monkeypatch.setattr("kbot.cli.main.run", fails(ValueError("a bug")))
    assert kbot("rule") == 2
    err = capsys.readouterr().err
    assert err.startswith(f"error: internal error (ValueError); KBot {version('kbot')} could not write")
    assert err.count("\n") == 1


def test_the_traceback_is_printed_with_kbot_debug(
    kbot: Callable[..., int],
    crashes: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("KBOT_DEBUG", "1")
    monkeypatch.setattr("kbot.cli.main.run", fails(ValueError("a bug")))
    assert kbot("rule") == 2
    assert "Traceback" in capsys.readouterr().err


def test_the_newest_crash_files_are_kept(crashes: Path) -> None:
    crashes.mkdir(parents=True)
    old = [crashes / f"20200101-0000{second:02}-x.txt" for second in range(crash.KEPT + 5)]
    for file in old:
        file.touch()
    crash.internal_error(ValueError("a bug"))
    kept = sorted(crashes.iterdir())
    assert kept[:-1] == old[-(crash.KEPT - 1) :]
    assert "a bug" in kept[-1].read_text()


def test_a_crash_file_is_bounded(crashes: Path) -> None:
    crash.internal_error(ValueError("x" * 50_000_000))
    assert next(crashes.iterdir()).stat().st_size < 2 * crash.MOST_BYTES


def test_the_innermost_file_is_named(crashes: Path) -> None:
    with pytest.raises(ValueError, match="a bug") as caught, reading("world.sdf"), reading("a\nb.stl"):
        raise ValueError("a bug")
    assert crash.internal_error(caught.value).startswith(
        r"internal error while reading 'a\nb.stl' (ValueError)"
    )


def test_user_errors_get_no_note() -> None:
    for error in (KbotError("a fault of the file"), OSError("no space")):
        with pytest.raises(type(error)) as caught, reading("world.sdf"):
            raise error
        assert not hasattr(caught.value, "__notes__")


def test_a_failed_thread_is_one_line(
    kbot: Callable[..., int], crashes: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert kbot("rule", "W101") == 0  # from here on, errors in threads are reported
    capsys.readouterr()
    thread = threading.Thread(target=fails(ValueError("a bug")), name="kbot-ros2")
    thread.start()
    thread.join()
    err = capsys.readouterr().err
    assert err.startswith("error: thread kbot-ros2 failed: internal error (ValueError); KBot ")
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("platform", "environment", "folder"),
    [
        ("linux", {}, "HOME/.local/state/kbot"),
        ("linux", {"XDG_STATE_HOME": "/var/state"}, "/var/state/kbot"),
        ("linux", {"XDG_STATE_HOME": "relative"}, "HOME/.local/state/kbot"),
        ("darwin", {}, "HOME/Library/Application Support/kbot"),
        ("win32", {"LOCALAPPDATA": "/local"}, "/local/kbot"),
        ("win32", {}, "HOME/AppData/Local/kbot"),
    ],
)
def test_the_state_folder_is_the_platform_s(
    platform: str, environment: dict[str, str], folder: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("XDG_STATE_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(name, raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(sys, "platform", platform)
    assert crash.state_folder() == Path(folder.replace("HOME", str(Path.home())))
