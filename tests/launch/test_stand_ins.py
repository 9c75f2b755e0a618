"""The settings of the nodes that KBot replaces, read as their documentation describes."""

import math
from datetime import datetime
from pathlib import Path

import pytest

from kbot.ros.launch import read_launch, read_launch_2
from kbot.ros.launch.node_settings.rosbag_record import RecordRequest
from kbot.ros.launch.staging import Stage, stage
from kbot.ros.nodes.joint_state_publisher import Dependent
from kbot.ros.nodes.twist_mux import MuxInput

HALF = math.sqrt(0.5)
NOW = datetime(2026, 3, 4, 5, 6, 7)


def staged(folder: Path, body: str) -> Stage:
    file = folder / "a.launch"
    file.write_text(f"<launch>\n{body}\n</launch>\n")
    return stage(read_launch(str(file)).require())


@pytest.mark.parametrize(
    ("package", "args"),
    [
        ("tf", "1 2 3 1.5707963267948966 0 0 base camera 100"),
        ("tf", f"1 2 3 0 0 {HALF} {HALF} /base /camera 100"),
        ("tf2_ros", "1 2 3 1.5707963267948966 0 0 base camera"),
        ("tf2_ros", f"1 2 3 0 0 {HALF} {HALF} base camera"),
        ("tf2_ros", "--x 1 --y 2 --z 3 --yaw 1.5707963267948966 --frame-id base --child-frame-id camera"),
        (
            "tf2_ros",
            f"--x 1 --y 2 --z 3 --qz {HALF} --qw {HALF} --frame-id base --child-frame-id camera",
        ),
    ],
)
def test_static_transform_is_read_in_every_form(tmp_path: Path, package: str, args: str) -> None:
    found = staged(
        tmp_path, f'<node pkg="{package}" type="static_transform_publisher" name="t" args="{args}"/>'
    )
    (transform,) = found.stand_ins.transforms
    assert (transform.parent, transform.child, transform.xyz) == ("base", "camera", (1.0, 2.0, 3.0))
    assert transform.xyzw == pytest.approx((0.0, 0.0, HALF, HALF))
    assert found.notes == ()


def test_order_of_angles_is_yaw_pitch_roll(tmp_path: Path) -> None:
    args = "0 0 0 0 0 1.5707963267948966 a b"
    found = staged(
        tmp_path, f'<node pkg="tf2_ros" type="static_transform_publisher" name="t" args="{args}"/>'
    )
    assert found.stand_ins.transforms[0].xyzw == pytest.approx((HALF, 0.0, 0.0, HALF))


@pytest.mark.parametrize("args", ["", "1 2 3 base camera", "0 0 0 0 0 0 0 base camera", "1 2 3 4 5 six a b"])
def test_invalid_transform_is_an_error(tmp_path: Path, args: str) -> None:
    found = staged(
        tmp_path, f'<node pkg="tf2_ros" type="static_transform_publisher" name="t" args="{args}"/>'
    )
    assert [(note.code, note.is_error) for note in found.notes] == [("L062", True)]


def test_relay_and_twist_mux_are_read_with_namespace_and_remaps(tmp_path: Path) -> None:
    found = staged(
        tmp_path,
        """<group ns="a"><node pkg="topic_tools" type="relay" name="r" args="scan /front/scan"/>
          <node pkg="twist_mux" type="twist_mux" name="m">
          <remap from="cmd_vel_out" to="base/cmd_vel"/><rosparam>
          topics: [{name: keys, topic: keys, timeout: 0.5, priority: 10}, {name: bad, topic: x}]
          locks: [{name: stop, topic: /stop, timeout: 0.0, priority: 255}]</rosparam></node></group>""",
    )
    assert [(r.source, r.target) for r in found.stand_ins.relayed] == [("/a/scan", "/front/scan")]
    (mux,) = found.stand_ins.muxes
    assert (mux.commands, mux.locks) == (
        (MuxInput("/a/keys", 0.5, 10.0),),
        (MuxInput("/stop", 0.0, 255.0),),
    )
    assert (mux.output, mux.is_stamped) == ("/a/base/cmd_vel", None)
    assert [note.code for note in found.notes] == ["L062"]


def test_twist_mux_with_topics_that_are_not_mappings_is_reported(tmp_path: Path) -> None:
    for topics, codes in (("5", []), ("[keys]", ["L062"])):
        node = '<node pkg="twist_mux" type="twist_mux" name="m">'
        found = staged(tmp_path, f"{node}<rosparam>topics: {topics}</rosparam></node>")
        assert found.stand_ins.muxes[0].commands == ()
        assert [note.code for note in found.notes] == codes


def test_relay_and_twist_mux_of_ros2_are_read_from_parameters(tmp_path: Path) -> None:
    (tmp_path / "mux.yaml").write_text(
        "twist_mux:\n  ros__parameters:\n    use_stamped: true\n    topics:\n"
        "      keys: {topic: keys, timeout: 0.5, priority: 10}\n"
    )
    file = tmp_path / "a.launch.xml"
    file.write_text(
        f"""<launch><node pkg="twist_mux" exec="twist_mux" name="twist_mux">
        <param from="{tmp_path}/mux.yaml"/></node>
        <node pkg="topic_tools" exec="relay" name="r">
        <param name="input_topic" value="/a"/><param name="output_topic" value="/b"/></node></launch>"""
    )
    found = stage(read_launch_2(str(file)).require())
    assert [(r.source, r.target) for r in found.stand_ins.relayed] == [("/a", "/b")]
    (mux,) = found.stand_ins.muxes
    assert (mux.commands, mux.is_stamped) == ((MuxInput("/keys", 0.5, 10.0),), True)
    assert found.notes == ()


def test_joint_state_publisher_parameters_are_read(tmp_path: Path) -> None:
    found = staged(
        tmp_path,
        """<node pkg="joint_state_publisher" type="joint_state_publisher" name="jsp">
          <param name="rate" value="25"/><param name="use_mimic_tags" value="false"/>
          <rosparam>{source_list: [/arm/joint_states], zeros: {lift: 0.5}, dependent_joints:
            {right: {parent: left, factor: -1, offset: 0.25}}}</rosparam></node>""",
    )
    joints = found.joints
    assert (joints.rate, joints.sources, joints.use_mimic_tags) == (25.0, ("/arm/joint_states",), False)
    assert joints.zeros == {"lift": 0.5}
    assert joints.dependent == {"right": Dependent("left", -1.0, 0.25)}
    assert found.notes == ()


def test_misspelled_joint_state_publisher_parameter_is_reported_with_a_hint(tmp_path: Path) -> None:
    found = staged(
        tmp_path,
        """<node pkg="joint_state_publisher" type="joint_state_publisher" name="jsp">
          <param name="rat" value="25"/></node>""",
    )
    (note,) = found.notes
    assert note.origin is not None
    assert (note.code, note.hint, note.origin.span.line) == ("L062", "did you mean 'rate'?", 3)


@pytest.mark.parametrize(
    ("args", "path", "topics"),
    [
        ("-a -O /tmp/run", "/tmp/run.bag", ()),
        ("-O run.bag odom /scan", "run.bag", ("/odom", "/scan")),
        ("--output-name=x -a", None, ()),
        ("-j --buffsize 512 -o day odom", None, ("/odom",)),
    ],
)
def test_rosbag_record_sets_file_and_topics(
    tmp_path: Path, args: str, path: str | None, topics: tuple[str, ...]
) -> None:
    found = staged(tmp_path, f'<node pkg="rosbag" type="record" name="r" args="{args}"/>')
    (recording,) = found.stand_ins.recordings
    assert recording.topics == topics
    if path is not None:
        assert recording == RecordRequest(path, topics)
    else:
        assert recording.path.endswith(".bag")


def test_ros2_bag_record_process_sets_file_and_topics(tmp_path: Path) -> None:
    file = tmp_path / "a.launch.py"
    file.write_text(
        "from launch import LaunchDescription\nfrom launch.actions import ExecuteProcess\n"
        "def generate_launch_description():\n    return LaunchDescription([ExecuteProcess(\n"
        "        cmd=['ros2', 'bag', 'record', '-o', 'a run', '/odom', 'scan'])])\n"
    )
    found = stage(read_launch_2(str(file), trusted=True).require())
    assert found.stand_ins.recordings == (RecordRequest("a run", ("/odom", "/scan")),)


def test_map_server_names_the_map(tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text("")
    found = staged(tmp_path, '<node pkg="map_server" type="map_server" name="m" args="$(dirname)/m.yaml"/>')
    assert found.stand_ins.maps == (str(tmp_path / "m.yaml"),)
    found = staged(tmp_path, '<node pkg="map_server" type="map_server" name="m" args="/no/map.yaml"/>')
    assert [(note.code, note.is_error) for note in found.notes] == [("L059", True)]


@pytest.mark.parametrize(
    ("arguments", "world", "paused", "window"),
    [
        ("'-r empty.sdf'", "empty.sdf", False, True),
        ("'empty.sdf'", "empty.sdf", True, True),
        ("'-r -s -v 4 shapes.sdf'", "shapes.sdf", False, False),
        ("'-r -v4 --render-engine ogre maze.sdf'", "maze.sdf", False, True),
    ],
)
def test_gz_sim_arguments_set_world_pause_and_window(
    tmp_path: Path, arguments: str, world: str, paused: bool, window: bool
) -> None:
    file = tmp_path / "a.launch.xml"
    file.write_text(
        '<launch><include file="$(find-pkg-share ros_gz_sim)/launch/gz_sim.launch.py">'
        f'<arg name="gz_args" value={arguments}/></include></launch>'
    )
    found = stage(read_launch_2(str(file)).require())
    assert (found.gazebo.world, found.gazebo.paused, found.has_window) == (world, paused, window)
