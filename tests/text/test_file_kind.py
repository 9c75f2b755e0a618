"""The kind of a file, by its content and, if that does not tell, by its name."""

from pathlib import Path

import pytest

from kbot.text.file_kind import file_kind, kind_of_file

XML = "<launch><node pkg='p' exec='e'/></launch>"
PYTHON = "from launch import LaunchDescription\n\ndef generate_launch_description():\n    pass\n"
YAML = "# of ROS 2\n%YAML 1.2\n---\n\nlaunch:\n- node: {pkg: p, exec: e}\n"


@pytest.mark.parametrize(
    ("name", "text", "kind"),
    [
        ("show_launch.xml", XML, "launch"),
        ("a.launch", XML, "launch"),
        ("a.urdf", XML, "launch"),
        ("a.xml", f'<?xml version="1.0"?>\n<!-- <robot> -->\n{XML}', "launch"),
        ("a.xml", f'<!DOCTYPE launch [<!ENTITY a "<b>">]>\n{XML}', "launch"),
        ("a.xml", f"\ufeff  {XML}", "launch"),
        ("demo_launch.py", PYTHON, "launch"),
        ("demo_launch.py", "from base import generate_launch_description\n", "launch"),
        ("demo_launch.py", "generate_launch_description = lambda: None\n", "launch"),
        ("script.py", "# generate_launch_description()\n", ""),
        ("broken.launch.py", "def generate(", "launch"),
        ("demo_launch.yaml", YAML, "launch"),
        ("params.yaml", "node:\n  launch: 1\n", ""),
        ("a.launch.yaml", "launch", "launch"),
        ("robot.xml", "<robot name='r'/>", "robot"),
        ("a.launch", "<robot name='r'/>", "robot"),
        ("a.urdf", "", "robot"),
        ("a.launch", "", "launch"),
        ("package.xml", "<package/>", "package"),
        ("package.xml", "<pack", "pack"),
        ("package.xml", "", "package"),
        ("my_package.xml", "", ""),
        ("world.xml", "<sdf version='1.9'/>", "sdf"),
        ("scene.xml", "<mujoco/>", "mujoco"),
        ("notes.xml", "no XML", ""),
    ],
)
def test_kind_of_a_text(name: str, text: str, kind: str) -> None:
    assert file_kind(f"folder/{name}", text) == kind


def test_only_the_beginning_of_a_file_is_read(tmp_path: Path) -> None:
    for encoding in ("utf-8", "utf-16"):
        file = tmp_path / f"{encoding}.xml"
        # the end of what is read can be within a character
        file.write_text(f"<!-- {'ü' * 9000} -->{XML}{'é' * 70_000}", encoding=encoding)
        assert kind_of_file(str(file)) == "launch"


def test_file_that_cannot_be_read_has_the_kind_of_its_name(tmp_path: Path) -> None:
    assert kind_of_file(str(tmp_path / "none.launch")) == "launch"
    assert kind_of_file(str(tmp_path)) == ""


@pytest.mark.parametrize("piece", ["\n", " ", "#\n", "<!", "<!--", "<!DOCTYPE", "[", "<?", "<!DOCTYPE a ["])
def test_time_does_not_explode(piece: str) -> None:
    """With an expression that tries all ways to divide the text, this takes longer than the tests may."""
    for name in ("a.xml", "a.yaml", "a.py"):
        file_kind(name, piece * 2000)
