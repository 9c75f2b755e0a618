"""The settings of ros_gz_bridge in YAML, arguments and remaps."""

from pathlib import Path

import pytest

from kbot.ros.launch import read_launch_2
from kbot.ros.launch.staging import Stage, stage
from kbot.ros.nodes.gz_bridge import Direction
from kbot.xacro import Packages

TWIST = "geometry_msgs/msg/Twist"
ODOMETRY = "nav_msgs/msg/Odometry"


def staged(folder: Path, node: str) -> Stage:
    file = folder / "a.launch.xml"
    file.write_text(f"<launch>{node}</launch>")
    return stage(read_launch_2(str(file), packages=Packages(around=str(file))).require())


def by_yaml(folder: Path, text: str, attributes: str = "", inner: str = "") -> Stage:
    (folder / "bridge.yaml").write_text(text)
    file = f'<param name="config_file" value="{folder}/bridge.yaml"/>'
    return staged(
        folder, f'<node pkg="ros_gz_bridge" exec="parameter_bridge" {attributes}>{file}{inner}</node>'
    )


def by_words(folder: Path, words: str, inner: str = "") -> Stage:
    return staged(folder, f'<node pkg="ros_gz_bridge" exec="parameter_bridge" args="{words}">{inner}</node>')


def rules(found: Stage) -> list[tuple[str, str, str, str]]:
    return [(b.gz, b.ros, b.ros_type, b.direction) for b in found.stand_ins.bridged]


def test_yaml_sets_topics_types_and_direction(folder: Path) -> None:
    found = by_yaml(
        folder,
        '- ros_topic_name: "cmd_vel"\n  gz_topic_name: "/model/r/cmd_vel"\n'
        f'  ros_type_name: "{TWIST}"\n  gz_type_name: "gz.msgs.Twist"\n  direction: ROS_TO_GZ\n  lazy: true\n'
        f"- {{topic_name: /odom, ros_type_name: nav_msgs/Odometry, gz_type_name: ignition.msgs.Odometry}}\n",
        'namespace="robot1"',
    )
    assert found.notes == ()
    assert rules(found) == [
        ("/model/r/cmd_vel", "/robot1/cmd_vel", TWIST, Direction.TO_GZ),
        ("/odom", "/odom", ODOMETRY, Direction.BOTH),
    ]


def test_marks_in_an_argument_set_the_direction(folder: Path) -> None:
    words = (
        f"/a@{TWIST}@gz.msgs.Twist /b@{TWIST}]gz.msgs.Twist /c@{ODOMETRY}[gz.msgs.Odometry"
        " /world/w/control@ros_gz_interfaces/srv/ControlWorld --ros-args -r /c:=/odom"
    )
    found = by_words(folder, words, '<remap from="/b" to="/cmd_vel"/>')
    (note,) = found.notes
    assert (note.code, note.message) == ("L063", "KBot does not provide the gz service /world/w/control")
    assert rules(found) == [
        ("/a", "/a", TWIST, Direction.BOTH),
        ("/b", "/cmd_vel", TWIST, Direction.TO_GZ),
        ("/c", "/odom", ODOMETRY, Direction.TO_ROS),
    ]


def test_image_bridge_takes_topics(folder: Path) -> None:
    found = staged(folder, '<node pkg="ros_gz_image" exec="image_bridge" args="/camera /depth"/>')
    assert [bridged.ros for bridged in found.stand_ins.bridged] == ["/camera", "/depth"]


def test_launch_file_of_the_bridge_takes_a_config_file(folder: Path) -> None:
    (folder / "bridge.yaml").write_text(
        f"- {{topic_name: /odom, ros_type_name: {ODOMETRY}, gz_type_name: gz.msgs.Odometry}}\n"
    )
    include = (
        '<include file="$(find-pkg-share ros_gz_bridge)/launch/ros_gz_bridge.launch.py">'
        f'<arg name="bridge_name" value="b"/><arg name="config_file" value="{folder}/bridge.yaml"/></include>'
    )
    assert [bridged.gz for bridged in staged(folder, include).stand_ins.bridged] == ["/odom"]


@pytest.mark.parametrize(
    ("text", "line", "column", "message"),
    [
        (
            f"- ros_topic_name: /a\n  ros_type_name: {TWIST}\n",
            1,
            3,
            "the bridge entry of /a needs gz_type_name",
        ),
        ("- ros_topic: /a\n", 1, 3, "a bridge entry has no key 'ros_topic'"),
        (
            f"- topic_name: /a\n  ros_type_name: {TWIST}\n  gz_type_name: gz.msgs.Odometry\n",
            2,
            3,
            f"{TWIST} converts to gz.msgs.Twist, not to gz.msgs.Odometry",
        ),
        (
            f"- topic_name: /a\n  ros_type_name: {TWIST}\n  gz_type_name: gz.msgs.Twist\n"
            "  direction: ROS_TO_GAZEBO\n",
            4,
            3,
            "unknown direction 'ROS_TO_GAZEBO'",
        ),
        ("- topic_name: /a\n  ros_type_name: [\n", 3, 1, "the YAML cannot be read: while parsing"),
        ("\n- 17\n", 2, 3, "17 is not a bridge entry"),
        ("- topic_name: 17\n", 1, 3, "17 is not a ROS topic name"),
        ("- gz_topic_name: a b\n", 1, 3, "'a b' is not a gz topic name"),
        ("- topic_name: /a\n  ros_type_name: T\n", 2, 3, "'T' is not a ROS type, for example geometry_"),
        (
            f"- topic_name: /a\n  ros_type_name: {TWIST}\n  gz_type_name: [gz.msgs.Twist]\n",
            3,
            3,
            "['gz.msgs.Twist'] is not a gz type",
        ),
    ],
)
def test_error_in_yaml_is_reported_at_its_line(
    folder: Path, text: str, line: int, column: int, message: str
) -> None:
    found = by_yaml(folder, text)
    note = found.notes[0]
    assert note.origin is not None
    span = note.origin.span
    assert (Path(span.file).name, span.line, span.column) == ("bridge.yaml", line, column)
    assert message in note.message
    assert found.stand_ins.bridged == ()


def test_yaml_with_invalid_utf8_is_reported_in_the_yaml(folder: Path) -> None:
    by_yaml(folder, "")
    (folder / "bridge.yaml").write_bytes(b"- topic_name: \xff\n")
    found = stage(
        read_launch_2(str(folder / "a.launch.xml"), packages=Packages(around=str(folder))).require()
    )
    (note,) = found.notes
    assert note.origin is not None
    assert Path(note.origin.span.file).name == "bridge.yaml"


def test_invalid_argument_is_reported_at_its_node(folder: Path) -> None:
    (note,) = by_words(folder, f"/ok@{TWIST}@gz.msgs.Twist /cmd_vel@{TWIST}").notes
    assert note.origin is not None
    assert note.origin.span.text.startswith("<node")
    assert f"'/cmd_vel@{TWIST}' is not a bridge argument" in note.message


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path
