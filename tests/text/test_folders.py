"""Searches in folders of any size, depth and content."""

import os
import sys
from pathlib import Path

import pytest

from kbot.text import KbotError, folders
from kbot.text.folders import files_below, names_in


def made(folder: Path, *names: str) -> Path:
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).touch()
    return folder


def test_the_wanted_files_of_all_folders_are_found_nearest_first(tmp_path: Path) -> None:
    made(
        tmp_path, "b/c/x.urdf", "b/x.urdf", "x.urdf", "x.txt", "build/x.urdf", ".git/x.urdf", "d.urdf/y.urdf"
    )
    searched: list[str] = []
    found = files_below(tmp_path, lambda name: name.endswith(".urdf"), searched.append)
    near, *between, far = (os.path.relpath(file, tmp_path) for file in found)
    assert (near, far) == ("x.urdf", str(Path("b/c/x.urdf")))
    assert sorted(between) == [str(Path("b/x.urdf")), str(Path("d.urdf/y.urdf"))]
    assert {os.path.relpath(each, tmp_path) for each in searched} == {".", "b", "d.urdf", str(Path("b/c"))}


def test_paths_begin_as_the_folder_was_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(made(tmp_path, "a/x"))
    for folder in (".", "./", ""):
        assert list(files_below(folder or ".", lambda name: True)) == [str(Path("a/x"))]


@pytest.mark.skipif(sys.platform == "win32", reason="links need a privilege on Windows")
def test_links_to_folders_are_not_followed(tmp_path: Path) -> None:
    """Two links to the folder that contains them would make 2^n paths of length n."""
    made(tmp_path, "a/x")
    for name in ("b", "c"):
        (tmp_path / "a" / name).symlink_to(tmp_path)
    (tmp_path / "file").symlink_to(tmp_path / "a" / "x")
    found = files_below(tmp_path, lambda name: True)
    assert sorted(os.path.relpath(file, tmp_path) for file in found) == [str(Path("a/x")), "file"]


@pytest.mark.skipif(sys.platform == "win32", reason="links need a privilege on Windows")
def test_a_broken_link_does_not_end_the_search_of_its_folder(tmp_path: Path) -> None:
    """A link to itself has no target. Whoever reads it reports that."""
    names = [f"{n}.urdf" for n in range(20)]
    made(tmp_path, *names)
    for name in ("loop.urdf", "loop"):
        (tmp_path / name).symlink_to(tmp_path / name)
    found = files_below(tmp_path, lambda name: name.endswith(".urdf"))
    assert sorted(os.path.relpath(file, tmp_path) for file in found) == sorted([*names, "loop.urdf"])


def test_a_search_stops_at_its_limit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made(tmp_path, "a/1", "a/2", "3")  # with the folder: four
    monkeypatch.setattr(folders, "MOST_SEARCHED", 4)
    assert len(list(files_below(tmp_path, lambda name: True))) == 3
    monkeypatch.setattr(folders, "MOST_SEARCHED", 3)
    with pytest.raises(KbotError) as raised:
        list(files_below(tmp_path, lambda name: True))
    assert str(raised.value) == (
        f"{tmp_path} has more than 3 files and folders, too many to search. Choose a folder in it"
    )


def test_names_of_a_folder_are_listed_up_to_a_limit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made(tmp_path, "a", "b", "c")
    assert sorted(names_in(tmp_path)) == ["a", "b", "c"]
    monkeypatch.setattr(folders, "_MOST_NAMES", 2)
    assert len(names_in(tmp_path)) == 2
    assert names_in(tmp_path / "missing") == names_in(tmp_path / "a") == names_in("a\0b") == []
