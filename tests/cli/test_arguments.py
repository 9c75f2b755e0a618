"""Tests how the words of a command line are parsed."""

import os
from pathlib import Path

import pytest

from kbot.cli.arguments import file_and_arguments, split_arguments
from kbot.text import KbotError


def test_files_and_arguments_are_distinguished() -> None:
    words = ["robot.xacro", "wheel_radius:=0.04", "name:=a:=b", "empty:="]
    assert split_arguments(words) == (
        ["robot.xacro"],
        {"wheel_radius": "0.04", "name": "a:=b", "empty": ""},
    )


def test_the_last_value_of_a_name_wins() -> None:
    assert split_arguments(["r:=1", "r:=2"]) == ([], {"r": "2"})


def test_a_single_equals_sign_is_rejected_with_the_correct_form() -> None:
    with pytest.raises(KbotError, match=r"'r=0\.04' is not an argument\. Write r:=0\.04"):
        split_arguments(["robot.xacro", "r=0.04"])


def test_a_file_whose_name_has_an_equals_sign_is_a_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a=b.xacro").write_text("<robot/>")
    assert split_arguments(["a=b.xacro"]) == (["a=b.xacro"], {})


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such names")
def test_a_folder_whose_name_looks_like_an_argument_is_a_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("students", "wheel_radius:=1").mkdir(parents=True)
    words = ["students/wheel_radius:=1/", "wheel_radius:=2"]
    assert split_arguments(words) == (words[:1], {"wheel_radius": "2"})
    monkeypatch.chdir(tmp_path / "students")
    assert split_arguments(["wheel_radius:=1/"]) == (["wheel_radius:=1/"], {})


def test_an_argument_without_a_name_is_rejected() -> None:
    with pytest.raises(KbotError, match="no name"):
        split_arguments([":=0.04"])


def test_windows_paths_are_files() -> None:
    assert split_arguments([r"C:\robots\a.xacro"]) == ([r"C:\robots\a.xacro"], {})


def test_exactly_one_file_is_accepted() -> None:
    assert file_and_arguments(["kbot", "r:=1"]) == ("kbot", {"r": "1"})
    with pytest.raises(KbotError, match="FILE is missing"):
        file_and_arguments(["r:=1"])
    with pytest.raises(KbotError, match="not 2"):
        file_and_arguments(["a", "b"])
