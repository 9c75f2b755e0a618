"""Command lines of nodes, as roslaunch and ros2 launch write them."""

import re
from pathlib import Path

import pytest

from kbot.ros.client.arguments import NodeArguments, read_arguments
from kbot.text import KbotError


def read(*words: str, **environment: str) -> NodeArguments:
    return read_arguments("n", words, environment)


def test_ros_1_arguments() -> None:
    found = read("own", "__name:=m", "__log:=/tmp/x", "_rate:=2.5", "_on:=true", "scan:=/base/scan", "--fast")
    assert (found.full_name, found.rest) == ("/m", ("own", "--fast"))
    assert found.parameters == {"rate": 2.5, "on": True}
    assert found.resolve("scan") == "/base/scan"
    assert found.resolve("/scan") == "/base/scan"
    assert found.resolve("odom") == "/odom"
    assert found.resolve("~x") == "/m/x"


def test_namespace_from_the_environment() -> None:
    found = read("a:=b", ROS_NAMESPACE="left/arm")
    assert found.full_name == "/left/arm/n"
    assert (found.resolve("a"), found.resolve("c"), found.resolve("/c")) == (
        "/left/arm/b",
        "/left/arm/c",
        "/c",
    )


def test_ros_2_arguments(tmp_path: Path) -> None:
    file = tmp_path / "p.yaml"
    file.write_text(
        "/**:\n  ros__parameters: {rate: 3, gain: {p: 1.5}}\n/other:\n  ros__parameters: {rate: 4}\n"
    )
    found = read(
        *("own", "--ros-args", "-r", "__node:=m", "-r", "__ns:=/left", "-r", "scan:=/s", "-p", "side:=left"),
        *("--params-file", str(file), "--log-level", "debug", "--", "more"),
    )
    assert (found.full_name, found.rest) == ("/left/m", ("own", "more"))
    assert found.parameters == {"rate": 3, "gain.p": 1.5, "side": "left"}
    assert found.resolve("scan") == "/s"


def test_a_parameter_file_may_nest_namespaces(tmp_path: Path) -> None:
    file = tmp_path / "p.yaml"
    file.write_text(
        "left:\n  n:\n    ros__parameters: {a: 1}\n  '*':\n    ros__parameters: {b: 2}\n"
        "/left/*x:\n  ros__parameters: {c: 3}\n/left/n/**:\n  ros__parameters: [4]\n"
    )
    found = read("--ros-args", "-r", "__ns:=/left", "--params-file", str(file))
    assert found.parameters == {"a": 1, "b": 2}


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--ros-args", "-p"), "-p needs a value"),
        (("--ros-args", "-p", "rate=2"), "-p needs NAME:=VALUE, not 'rate=2'"),
        (("--ros-args", "--params-file", "/no/such.yaml"), "--params-file: /no/such.yaml does not exist"),
    ],
)
def test_errors_of_incomplete_options(words: tuple[str, ...], message: str) -> None:
    with pytest.raises(KbotError, match=re.escape(message)):
        read(*words)
