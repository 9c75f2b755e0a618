"""The variables that ROS sets, in launch files and descriptions that are read without ROS."""

import os
from pathlib import Path

import pytest

from kbot.ros.launch import read_launch
from kbot.text.notes import notes_sent_to
from kbot.xacro import expand_text

from .ros2_files import arguments_of, node, python, read

NAMES = ("ROS_DISTRO", "ROS_VERSION", "ROS_PYTHON_VERSION", "ROS_MASTER_URI", "AMENT_PREFIX_PATH")
NOTE = "the environment variable {} is not set: KBot uses '{}'. Set it to use another value"


@pytest.fixture(autouse=True)
def without_ros(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in NAMES:
        monkeypatch.delenv(name, raising=False)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        ("os.environ['ROS_DISTRO']", "jazzy"),
        ("os.getenv('ROS_DISTRO')", "jazzy"),
        ("os.environ.get('ROS_DISTRO')", "jazzy"),
        ("__import__('os').environ['ROS_DISTRO']", "jazzy"),
        ("EnvironmentVariable('ROS_DISTRO')", "jazzy"),
        ("EnvVar('ROS_DISTRO').perform(LaunchContext())", "jazzy"),
        ("os.environ['ROS_VERSION']", "2"),
        ("os.environ['ROS_PYTHON_VERSION']", "3"),
        ("str('ROS_VERSION' in os.environ)", "True"),
        ("os.environ['AMENT_PREFIX_PATH'].split(os.pathsep)[0]", "/opt/ros/stand-in"),
    ],
)
def test_variable_has_a_value_and_one_note(folder: Path, value: str, text: str) -> None:
    before = (
        "from launch import LaunchContext\nfrom launch.substitutions import EnvironmentVariable as EnvVar"
    )
    with notes_sent_to((sent := list[str]()).append):
        assert arguments_of(python(folder, node(value, value), before=before)) == f"{text} {text}"
    (found,) = sent
    name = next(name for name in NAMES if name in value)
    assert found.startswith(f"the environment variable {name} is not set: KBot uses '")
    assert not any(name in os.environ for name in NAMES)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        ("os.getenv('ROS_DISTRO', 'foxy')", "foxy"),
        ("os.environ.get('ROS_DISTRO', 'foxy')", "foxy"),
        ("EnvironmentVariable('ROS_DISTRO', default_value='foxy')", "foxy"),
        ("str(os.getenv('KBOT_SURELY_UNSET'))", "None"),
    ],
)
def test_default_of_the_launch_file_comes_first(folder: Path, value: str, text: str) -> None:
    assert arguments_of(python(folder, node(value))) == text


@pytest.mark.parametrize("value", ["os.environ['ROS_DISTRO']", "EnvironmentVariable('ROS_DISTRO')"])
def test_variable_that_is_set_keeps_its_value(
    folder: Path, monkeypatch: pytest.MonkeyPatch, value: str
) -> None:
    monkeypatch.setenv("ROS_DISTRO", "humble")
    assert arguments_of(python(folder, node(value))) == "humble"


def test_changes_of_the_environment_by_a_launch_file_stay(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("KBOT_PROBE", "a")
    python(folder, before="os.environ['KBOT_PROBE'] += 'b'")
    assert os.environ["KBOT_PROBE"] == "ab"


def test_launch_files_in_xml_and_descriptions_have_the_values(folder: Path) -> None:
    sent: list[str] = []
    with notes_sent_to(sent.append):
        xml = '<launch><node pkg="p" exec="e" name="probe" args="$(env ROS_DISTRO)"/></launch>'
        assert arguments_of(read(folder / "a.launch.xml", xml)) == "jazzy"
        (folder / "a.launch").write_text(
            '<launch><param name="a" value="$(env ROS_DISTRO) $(env ROS_MASTER_URI)"/></launch>'
        )
        params = read_launch(str(folder / "a.launch")).params
        assert params["/a"].value == "noetic http://localhost:11311"
        robot = '<robot name="$(env ROS_DISTRO)_$(optenv ROS_DISTRO foxy)" xmlns:xacro="x"/>'
        assert 'name="jazzy_foxy"' in expand_text(robot).plain_text
    assert sent == [
        NOTE.format("ROS_DISTRO", "jazzy"),
        NOTE.format("ROS_DISTRO", "noetic"),
        NOTE.format("ROS_MASTER_URI", "http://localhost:11311"),
    ]
