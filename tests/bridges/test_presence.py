"""The files by which the verbs of `kbot topic` find a running KBot, after anything has written to them."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from kbot.ros.graph import presence
from kbot.ros.graph.presence import Presence, announce, running


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(presence, "_folder", lambda: tmp_path)
    return tmp_path


OWN = Presence(os.getpid(), "ws://127.0.0.1:1/", "caf\udce9", "empty", "kbot sim", 5.0)


def test_a_running_kbot_is_found() -> None:
    announce(OWN)
    assert running() == [OWN]


def test_the_file_of_a_killed_kbot_is_deleted_by_the_next_one(folder: Path) -> None:
    with subprocess.Popen([sys.executable, "-c", ""]) as ended:
        ended.wait()
        left = announce(replace(OWN, pid=ended.pid))
    assert left.exists()
    announce(OWN)
    assert [path.name for path in folder.glob("*.json")] == [f"{OWN.pid}.json"]


@pytest.mark.parametrize("text", ["", "[]", "null", "{}", "[" * 100_000, "\udcff", '{"pid": 1}'])
def test_a_file_of_another_kind_is_ignored(text: str, folder: Path) -> None:
    announce(OWN)
    (folder / "other.json").write_bytes(text.encode("utf-8", "surrogateescape"))
    assert running() == [OWN]


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("pid", "1"), ("pid", -1), ("pid", 10**30), ("pid", True), ("pid", None), ("address", 1),
        ("robot", []), ("world", {}), ("command", None), ("since", "now"), ("since", 1e300),
        ("since", -1), ("more", 1),
    ],
)  # fmt: skip
def test_a_file_with_other_values_is_ignored(key: str, value: object, folder: Path) -> None:
    path = announce(OWN)
    path.write_text(json.dumps({**json.loads(path.read_text()), key: value}))
    assert running() == []
    assert path.exists()


@pytest.mark.skipif(os.name == "nt", reason="the folder is the user's own on Windows")
def test_files_of_a_stranger_are_not_read(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Anyone can make the folder under /tmp first. Its address would receive what the user publishes."""
    announce(OWN)
    monkeypatch.setattr(os, "getuid", lambda: folder.stat().st_uid + 1)
    for use in (running, lambda: announce(OWN)):
        with pytest.raises(PermissionError, match="belongs to another user") as refused:
            use()
        assert refused.value.filename == str(folder)
