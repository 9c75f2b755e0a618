"""Temporary folders are removed at their end, and at the next start if their process was killed."""

from __future__ import annotations

import os
import signal
import stat
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from kbot.cli.main import run
from kbot.cli.output import report_error
from kbot.text import temporary
from kbot.text.temporary import TemporaryFolder, private_folder, remove_left, user_folder

ON_POSIX = pytest.mark.skipif(os.name == "nt", reason="Windows has no owners and links like these")


@pytest.fixture(autouse=True)
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The user's folder in a temporary folder of this test."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setenv("TEMP", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", None)
    return user_folder()


def names(place: Path) -> list[str]:
    return sorted(path.name for path in place.iterdir())


def test_a_folder_is_removed_at_the_end_of_its_block(place: Path) -> None:
    with TemporaryFolder("a") as first, TemporaryFolder("a") as second:
        (first / "file").write_text("x")
        assert first != second
        assert first.parent == second.parent == place
    assert names(place) == []


def test_a_folder_is_removed_after_an_error(place: Path) -> None:
    with pytest.raises(ZeroDivisionError), TemporaryFolder("a"):
        _ = 1 / 0
    assert names(place) == []


def test_a_folder_that_is_kept_is_never_removed(place: Path) -> None:
    folder = TemporaryFolder("logs")
    (folder.path / "a.log").write_text("x")
    folder.keep()
    folder.remove()
    remove_left()
    assert (folder.path / "a.log").read_text() == "x"
    with TemporaryFolder("logs") as other:
        assert other != folder.path
    assert names(place) == [folder.path.name]


@ON_POSIX
def test_a_folder_is_kept_although_another_kbot_starts_then(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The other one starts as soon as the lock is released."""
    folder, close = TemporaryFolder("logs"), os.close
    with monkeypatch.context() as context:

        def released(descriptor: int) -> None:
            context.undo()
            close(descriptor)
            remove_left()

        context.setattr(os, "close", released)
        folder.keep()
    assert names(place) == [folder.path.name]


MAKE = "import os, sys, time\nfrom kbot.text.temporary import TemporaryFolder\nTemporaryFolder('a')\n"


@pytest.mark.parametrize("then", ["", "sys.exit(3)", "raise KeyboardInterrupt"])
def test_a_folder_is_removed_when_its_process_ends(place: Path, then: str) -> None:
    subprocess.run([sys.executable, "-c", MAKE + then], stderr=subprocess.DEVNULL, check=False)
    assert names(place) == []


@pytest.mark.parametrize("then", ["os._exit(0)", "os.kill(os.getpid(), 9)"])
def test_a_folder_of_a_dead_process_is_removed_by_the_next_one(place: Path, then: str) -> None:
    subprocess.run([sys.executable, "-c", MAKE + then], check=False)
    assert len(names(place)) == 2
    subprocess.run([sys.executable, "-c", MAKE], check=True)
    assert names(place) == []


def test_a_folder_of_a_worker_that_crashed_is_removed_at_the_end(place: Path) -> None:
    with TemporaryFolder("own"):
        subprocess.run([sys.executable, "-c", MAKE + "os._exit(0)"], check=False)
        assert len(names(place)) == 4
        temporary.remove_all()
        assert names(place) == []


def test_a_verb_does_not_remove_what_its_process_still_uses(place: Path) -> None:
    with TemporaryFolder("recording") as folder:
        assert run(["rule", "X101"]) == 0
        assert folder.exists()
    assert names(place) == []


def test_a_folder_is_removed_although_a_thread_goes_on(place: Path) -> None:
    code = (
        f"{MAKE}import threading\n"
        "from kbot.cli.start import main\n"
        "threading.Thread(target=time.sleep, args=[3600]).start()\n"
        "main()\n"
    )
    subprocess.run([sys.executable, "-c", code, "--version"], stdout=subprocess.DEVNULL, check=True)
    assert names(place) == []


@ON_POSIX
def test_the_process_id_does_not_matter(place: Path) -> None:
    """The folder of a dead process whose ID another process has now, and that of a live one."""
    with TemporaryFolder("live") as live:
        left = place / f"dead-{os.getpid()}-0"
        left.mkdir()
        left.with_name(left.name + ".lock").touch()
        subprocess.run([sys.executable, "-c", MAKE], check=True)
        assert names(place) == [live.name, f"{live.name}.lock"]


@ON_POSIX
def test_a_fork_removes_nothing_of_its_parent(place: Path) -> None:
    code = MAKE + "if os.fork() == 0: sys.exit()\nos.wait()\nprint(os.listdir(sys.argv[1]))"
    done = subprocess.run([sys.executable, "-c", code, place], capture_output=True, text=True, check=True)
    assert done.stdout.count("'a-") == 2
    assert names(place) == []


@ON_POSIX
def test_links_are_not_followed(place: Path, tmp_path: Path) -> None:
    precious = tmp_path / "precious"
    precious.mkdir()
    (precious / "file").write_text("x")
    place.mkdir()
    (place / "b-1-0").symlink_to(precious)
    (place / "b-1-0.lock").touch()
    (place / "c-1-0.lock").symlink_to(precious / "file")
    (place / "c-1-0").mkdir()
    (place / "d-1-0").mkdir()
    (place / "d-1-0" / "link").symlink_to(precious)
    (place / "d-1-0.lock").touch()
    remove_left()
    assert (precious / "file").read_text() == "x"
    assert not (place / "d-1-0").exists()


@ON_POSIX
@pytest.mark.parametrize("planted", ["link", "dangling link", "file", "folder of another user"])
def test_what_a_stranger_has_planted_is_not_used(
    place: Path, tmp_path: Path, planted: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    precious = tmp_path / "precious"
    if "link" in planted:
        place.symlink_to(precious)
        if planted == "link":
            precious.mkdir()
            (precious / "a-1-0").mkdir()
            (precious / "a-1-0.lock").touch()
    elif planted == "file":
        place.touch()
    else:
        place.mkdir()
        (place / "a-1-0").mkdir()
        (place / "a-1-0.lock").touch()
        monkeypatch.setattr(temporary, "user_folder", lambda: place)  # not that of the other ID
        monkeypatch.setattr(os, "getuid", lambda: place.stat().st_uid + 1)
    with pytest.raises(OSError) as refused:  # noqa: PT011 - the file that is named is checked
        TemporaryFolder("b")
    assert refused.value.filename == str(place)
    assert refused.value.strerror == (
        "is a link, is a file, or belongs to another user. Remove it, or set TMPDIR to another folder"
    )
    remove_left()
    if planted == "link":
        assert names(precious) == ["a-1-0", "a-1-0.lock"]
    if planted.startswith("folder"):
        assert names(place) == ["a-1-0", "a-1-0.lock"]


def test_files_of_others_are_never_removed(place: Path) -> None:
    """Another program may have locks in a folder of this name too."""
    place.mkdir()
    for name in ("uv.lock", "a-1.lock", "a-1-0-b.lock", "A-1-0.lock", "a-1-0.lck", "-1-0.lock"):
        (place / name).touch()
        (place / name).with_suffix("").mkdir()
    before = names(place)
    remove_left()
    assert names(place) == before


@ON_POSIX
@pytest.mark.parametrize("is_given", [False, True])
def test_the_working_directory_is_used_only_if_the_user_says_so(
    tmp_path: Path, is_given: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """`tempfile` falls back to it, as in a container whose /tmp is read-only."""
    own = tmp_path / "own"
    own.mkdir()
    monkeypatch.chdir(own)
    for name in ("TMPDIR", "TEMP", "TMP"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(tempfile, "tempdir", str(own))
    if is_given:
        monkeypatch.setenv("TMPDIR", ".")
        assert user_folder().parent == own
    else:
        with pytest.raises(FileNotFoundError) as raised:
            TemporaryFolder("a")
        report_error(raised.value)
        shown = f"error: {own}: no temporary folder can be written. Set TMPDIR\n"
        assert capsys.readouterr().err == shown
    remove_left()
    assert names(own) == []


@ON_POSIX
def test_a_folder_that_others_can_read_is_made_private(place: Path) -> None:
    place.mkdir(mode=0o755)
    assert stat.S_IMODE(private_folder(place).stat().st_mode) == 0o700


@ON_POSIX
def test_what_cannot_be_removed_is_tried_again(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as context, TemporaryFolder("a") as folder:
        context.setattr("shutil.rmtree", lambda path, ignore_errors: None)
    assert names(place) == [folder.name, f"{folder.name}.lock"]
    remove_left()
    assert names(place) == []


@ON_POSIX
def test_a_lock_that_was_removed_before_it_was_taken_is_not_used(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another process sees the new file, takes it for that of a dead process, and removes it."""
    lock, attempts = temporary._lock, []

    def removed_first(descriptor: int) -> None:
        if not attempts:
            attempts.append(descriptor)
            remove_left()
        lock(descriptor)

    monkeypatch.setattr(temporary, "_lock", removed_first)
    with TemporaryFolder("a") as folder:
        assert names(place) == [folder.name, f"{folder.name}.lock"]
    assert attempts


@ON_POSIX
def test_a_signal_that_no_handler_catches_leaves_the_folder_to_the_next_process(place: Path) -> None:
    code = MAKE + "print(flush=True); time.sleep(600)"
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.readline()
        remove_left()
        assert len(names(place)) == 2, "it is in use"
        process.send_signal(signal.SIGTERM)
    remove_left()
    assert names(place) == []
