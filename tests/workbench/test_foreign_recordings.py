"""Recordings of other programs: what is needed to display a robot, and the errors if it is missing."""

from array import array
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer

import kbot
from kbot.messages import Header, JointState, String, TFMessage
from kbot.messages.sensing import LaserScan
from kbot.messages.types import Quaternion, Time, Transform, TransformStamped, Vector3
from kbot.record import Recorder, mcap_file
from kbot.record.encodings.type_names import ros_name
from kbot.record.encodings.types import ros2_definition
from kbot.record.feed import Feed, Packet
from kbot.record.mcap_file import chunk_records
from kbot.sim import Simulation
from kbot.sim.naming import Naming
from kbot.text import KbotError
from kbot.workbench.protocol import Pause, Seek
from kbot.workbench.session.played_session import played_session
from kbot.workbench.timeline.series import Field

from .test_playback import finished

TILTED = """<robot name="arm"><link name="base"/><link name="arm"/><link name="slide"/>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="arm"/>
<origin xyz="0 0 0.5" rpy="0.3 0 0"/><axis xyz="0 0 2"/>
<limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
<joint name="rail" type="prismatic"><parent link="arm"/><child link="slide"/>
<axis xyz="1 0 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint></robot>"""


def write(path: Path, *packets: tuple[str, float, object]) -> str:
    """Write an MCAP file as a ROS 2 program would, without anything specific to KBot."""
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=2000)
        writer.start("ros2", "test")
        channels: dict[str, int] = {}
        for topic, at, message in packets:
            if topic not in channels:
                name = ros_name(type(message))
                schema = writer.register_schema(name, "ros2msg", ros2_definition(name)[0].encode())
                channels[topic] = writer.register_channel(topic, "cdr", schema)
            nanoseconds = round(at * 1e9)
            writer.add_message(
                channels[topic], nanoseconds, Packet(topic, message, nanoseconds).cdr, nanoseconds
            )
        writer.finish()
    return str(path)


def moved(
    at: float, parent: str, child: str, xyz: tuple[float, ...], xyzw: tuple[float, ...] = (0, 0, 0, 1)
) -> TFMessage:
    stamp = Time.from_nanoseconds(round(at * 1e9))
    transform = Transform(Vector3(*map(float, xyz)), Quaternion(*map(float, xyzw)))
    return TFMessage((TransformStamped(Header(stamp, parent), child, transform),))


def test_a_ros_recording_needs_only_description_and_tf(tmp_path: Path) -> None:
    """One frame was published once, long before the others. Joints are read from tf: 0.5 rad about the
    axis."""
    turned = (
        np.sin(0.15) * np.cos(0.25),
        -np.sin(0.15) * np.sin(0.25),
        np.cos(0.15) * np.sin(0.25),
        np.cos(0.15) * np.cos(0.25),
    )
    path = write(
        tmp_path / "real.mcap",
        ("/robot_description", 1e9, String(TILTED)),
        ("/tf", 1e9, moved(1e9, "map", "odom", (1, 0, 0))),
        *(("/tf", 1e9 + t, moved(1e9 + t, "odom", "base", (0.1 * t, 2, 0))) for t in range(1, 31)),
        ("/tf", 1e9 + 30.1, moved(1e9 + 30.1, "base", "arm", (0, 0, 0.5), turned)),
        ("/tf", 1e9 + 30.2, moved(1e9 + 30.2, "arm", "slide", (0.25, 0, 0))),
    )
    session = played_session(path)
    session.handle(Seek(30.2), 1)
    state = session.state()
    assert state.time == pytest.approx(1e9 + 30.2, abs=1e-3)
    assert state.positions == pytest.approx((0.5, 0.25), abs=1e-6)
    assert state.poses[:3] == pytest.approx((4.0, 2.0, 0.0))
    assert {name for name, _ in state.frames} == {"map", "odom"}
    session.handle(Seek(10.5), 1)
    assert session.state().poses[:3] == pytest.approx((2.0, 2.0, 0.0))


def test_joint_states_without_tf_are_sufficient(tmp_path: Path) -> None:
    path = write(
        tmp_path / "joints.mcap",
        ("/arm/robot_description", 1.0, String(TILTED)),
        ("/arm/joint_states", 1.5, JointState(Header(), ("shoulder", "of another robot"), (0.75, 9.0))),
        ("/arm/joint_states", 1.6, JointState(Header(), ("rail",), (-0.5,))),
    )
    session = played_session(path)
    session.handle(Seek(0.6), 1)
    assert session.state().positions == (0.75, -0.5)


@pytest.mark.parametrize(
    ("own", "other"),
    [("", "/robot_2"), ("/robot1", "/robot2"), ("/robot2", "/robot1"), ("/robot2", "")],
)
def test_joints_of_another_robot_are_ignored(tmp_path: Path, own: str, other: str) -> None:
    """The other robot has joints of the same names, and publishes just before and after each message."""
    names = ("shoulder", "rail")
    path = write(
        tmp_path / "two.mcap",
        (f"{own}/robot_description", 1.0, String(TILTED)),
        *(
            (f"{space}/joint_states", 1.0 + t + late, JointState(Header(), names, (value * t, -value * t)))
            for t in (0.0, 1.0, 2.0)
            for space, late, value in ((other, 0.0, 9.0), (own, 0.1, 0.25), (other, 0.2, 9.0))
        ),
    )
    session = played_session(path)
    session.handle(Seek(1.2), 1)
    assert session.state().positions == (0.25, -0.25)
    session.handle(Pause(paused=False), 1)
    session.advance(1.0)
    assert session.state().positions == (0.5, -0.5)
    making = session.series([Field.named("state positions.shoulder")], 0.0, 2.2)
    assert making is not None
    rows = {row for (row,) in finished(making).rows}
    assert rows == {None, 0.0, 0.25, 0.5}


def test_the_stored_namespace_selects_the_robots_topics(tmp_path: Path) -> None:
    """KBot stores the description at the root, whatever the namespace of the robot."""
    sim = Simulation(kbot.load("kbot"), naming=Naming(namespace="robot2"))
    path = str(tmp_path / "named.mcap")
    other = sim.bus.advertise("/robot1/joint_states", JointState)
    with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), path):
        sim.cmd_vel(0.3, 0.0)
        sim.run(0.5)
        other.publish(JointState(Header(), ("left_wheel_joint",), (99.0,)))
    session = played_session(path)
    session.handle(Seek(1.0), 1)
    joints = dict(zip(sim.joint_positions, session.state().positions, strict=False))
    assert joints["left_wheel_joint"] == pytest.approx(sim.joint_positions["left_wheel_joint"], abs=1e-6)


def test_a_missing_topic_is_one_clear_error(tmp_path: Path) -> None:
    with pytest.raises(KbotError, match="has no topics that KBot can display"):
        played_session(write(tmp_path / "a.mcap"))
    with pytest.raises(KbotError, match="neither /tf nor /joint_states"):
        played_session(write(tmp_path / "b.mcap", ("/robot_description", 0.0, String(TILTED))))
    with pytest.raises(KbotError, match="does not exist"):
        played_session(str(tmp_path / "c.mcap"))
    (tmp_path / "d.mcap").write_bytes(b"not at all")
    with pytest.raises(KbotError, match="not an MCAP file"):
        played_session(str(tmp_path / "d.mcap"))


def scan(at: float, frame: str) -> LaserScan:
    stamp = Time.from_nanoseconds(round(at * 1e9))
    ranges = array("f", (1.0, 2.0, 3.0))
    return LaserScan(Header(stamp, frame), -0.1, 0.1, 0.1, 0.0, 0.1, 0.1, 9.0, ranges, array("f"))


def no_robot(tmp_path: Path) -> str:
    """A recording of frames and a scan, without a description."""
    return write(
        tmp_path / "frames.mcap",
        ("/tf_static", 0.0, moved(0.0, "base_link", "laser", (0.2, 0, 0.1))),
        *(("/tf", 0.1 * t, moved(0.1 * t, "odom", "base_link", (0.1 * t, 0, 0))) for t in range(31)),
        *(("/scan", 0.1 * t, scan(0.1 * t, "laser")) for t in range(31)),
    )


def test_frames_and_sensors_are_shown_without_a_robot(tmp_path: Path) -> None:
    path = no_robot(tmp_path)
    session = played_session(path)
    assert session.note == (
        f"{path} has no readable /robot_description: only frames and sensors are shown."
        " Add the robot with --robot FILE."
    )
    session.handle(Seek(2.0), 1)
    state = session.state()
    assert state.poses[0] == pytest.approx(2.0)
    names = [name for name, _ in state.frames]
    poses = np.array(state.frame_poses).reshape(len(names), -1)
    assert poses[names.index("laser"), :3] == pytest.approx((2.2, 0.0, 0.1))
    assert "odom" in names
    displays = session.display_file.greeting.setup["displays"]
    assert [(d["kind"], d["properties"].get("topic")) for d in displays] == [
        ("Grid", None),
        ("TF", None),
        ("LaserScan", "/scan"),
    ]


def test_a_sensor_is_shown_without_frames(tmp_path: Path) -> None:
    session = played_session(
        write(tmp_path / "s.mcap", *(("/scan", t, scan(t, "laser")) for t in (0.0, 1.0)))
    )
    assert list(session.shown.robot.links) == ["laser"]
    assert session.state().poses[:3] == pytest.approx((0.0, 0.0, 0.0))


def test_a_given_robot_is_shown_in_a_recording(tmp_path: Path) -> None:
    file = tmp_path / "robot.xacro"
    file.write_text(
        '<robot name="given" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:arg name="base" default="x"/>'
        '<link name="$(arg base)"/></robot>'
    )
    texts: list[str] = []
    session = played_session(
        no_robot(tmp_path),
        (),
        lambda played: texts.append(played.description),
        str(file),
        {"base": "base_link"},
    )
    assert session.note == ""
    assert '<link name="base_link"/>' in texts[0]
    session.handle(Seek(2.0), 1)
    assert session.shown.robot.name == "given"
    assert session.state().poses[0] == pytest.approx(2.0)


def test_too_many_static_transforms_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All are held in memory. A hostile recording has gigabytes of them in a few kilobytes."""
    monkeypatch.setattr("kbot.workbench.playback.recorded_run.MOST_STATIC_BYTES", 100)
    path = write(
        tmp_path / "static.mcap",
        ("/robot_description", 0.0, String(TILTED)),
        *(("/tf_static", t, moved(t, "odom", "base", (0, 0, 0))) for t in (0.0, 1.0)),
    )
    with pytest.raises(KbotError, match="has more than 100 bytes on /tf_static"):
        played_session(path)


def test_an_incomplete_recording_plays_to_its_last_complete_chunk(tmp_path: Path) -> None:
    path = write(
        tmp_path / "whole.mcap",
        ("/robot_description", 0.0, String(TILTED)),
        *(("/tf", 0.1 * t, moved(0.1 * t, "odom", "base", (0.1 * t, 0, 0))) for t in range(301)),
    )
    whole = Path(path).read_bytes()
    (tmp_path / "broken.mcap").write_bytes(whole[: len(whole) // 2])
    session = played_session(str(tmp_path / "broken.mcap"))
    end = session.timeline().end
    assert 5.0 < end < 25.0
    session.handle(Seek(end), 1)
    assert session.state().poses[0] == pytest.approx(end)


def test_only_displayed_parts_are_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A time in a long recording is found by the index. Opening and seeking read few chunks."""
    path = write(
        tmp_path / "long.mcap",
        ("/robot_description", 0.0, String(TILTED)),
        *(("/tf", 0.02 * t, moved(0.02 * t, "odom", "base", (0.02 * t, 0, 0))) for t in range(20_000)),
    )
    read: list[object] = []
    monkeypatch.setattr(mcap_file, "chunk_records", lambda *a: read.append(a) or chunk_records(*a))
    session = played_session(path)
    for at in (380.0, 3.0, 200.0):
        session.handle(Seek(at), 1)
        assert session.state().poses[0] == pytest.approx(at, abs=0.021)
    assert 10 < len(read) < 200 < count_of_chunks(path) / 2


def count_of_chunks(path: str) -> int:
    with Path(path).open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    return len(summary.chunk_indexes)
