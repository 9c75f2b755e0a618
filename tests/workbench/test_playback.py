"""Recordings played in the workbench: shown is what was recorded, at any moment, whoever recorded it."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.stream_reader import breakup_chunk
from mcap.writer import Writer

import kbot
from kbot.messages import Header, JointState, String, TFMessage
from kbot.messages.sensing import LaserScan
from kbot.messages.types import Quaternion, Time, Transform, TransformStamped, Vector3
from kbot.nodes import RobotStatePublisher
from kbot.record import Recorder
from kbot.record.mcap import index as mcap_index
from kbot.sensors import Lidar
from kbot.sim import Simulation
from kbot.sim.naming import Naming
from kbot.text import KbotError
from kbot.wire import Feed, Packet, ros2_definition, ros_name
from kbot.workbench.protocol import ApplyFix, Drive, EditSource, Pause, Reset, Seek, SetLoop, Undo
from kbot.workbench.session.played_session import played_session
from kbot.workbench.session.session import Session
from kbot.workbench.timeline.series import Field, Making, Table
from kbot.workbench.timeline.ways import Point

pytestmark = pytest.mark.usefixtures("keeps_up")

TILTED = """<robot name="arm"><link name="base"/><link name="arm"/><link name="slide"/>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="arm"/>
<origin xyz="0 0 0.5" rpy="0.3 0 0"/><axis xyz="0 0 2"/>
<limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
<joint name="rail" type="prismatic"><parent link="arm"/><child link="slide"/>
<axis xyz="1 0 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint></robot>"""


@dataclass
class Run:
    """A recorded run, and how it really went: link poses by time in ms."""

    path: Path
    poses: dict[int, np.ndarray] = field(default_factory=dict)
    joints: dict[int, dict[str, float]] = field(default_factory=dict)


@pytest.fixture(scope="module", params=["run.mcap", "run.bag", "run"])
def run(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Run:
    sim = Simulation(kbot.load("kbot"), "boxes")
    run = Run(tmp_path_factory.mktemp("run") / request.param)
    sim.add_sensor(Lidar(link="base_link", rate=5.0, topic="scan"))
    RobotStatePublisher(sim.robot, sim.bus, sim.clock)
    sim.cmd_vel(0.3, 0.5)
    with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), str(run.path)):
        for step in range(1, 61):
            sim.run(0.05)
            run.poses[50 * step] = np.array([pose.matrix for pose in sim.link_poses().values()])
            run.joints[50 * step] = dict(sim.joint_positions)
    return run


def shown(session: Session) -> np.ndarray:
    return np.array([pose.matrix for pose in session._motion.moment().poses.values()])


def seek(session: Session, milliseconds: int) -> None:
    start = session._motion._run.index.start
    session.obey(Seek(milliseconds * 1e-3 - start * 1e-9), 1)


def test_any_moment_is_as_it_was(run: Run) -> None:
    session = played_session(str(run.path))
    root_from = None
    for at in (3000, 200, 2000, 1900, 1000, 2900, 100):
        seek(session, at)
        assert session.state().time == pytest.approx(at * 1e-3)
        poses, joints = shown(session), dict(zip(run.joints[at], session.state().positions, strict=True))
        # what is recorded is odometry's word of where the robot is, which rolling makes a little other
        assert np.abs(poses[:, :3, 3] - run.poses[at][:, :3, 3]).max() < 0.01
        assert np.abs(poses[:, :3, :3] - run.poses[at][:, :3, :3]).max() < 0.03
        assert joints == pytest.approx(run.joints[at], abs=1e-6)
        root_from = poses if root_from is None else root_from
    assert np.abs(shown(session) - root_from).max() > 0.1  # it did move


def test_it_plays_from_where_it_stands_and_stops_at_the_end(run: Run) -> None:
    session = played_session(str(run.path))
    seek(session, 1000)
    for _ in range(25):
        session.advance(0.02)
    assert session.state().time == pytest.approx(1.5)
    played = shown(session)
    seek(session, 1500)
    assert np.allclose(shown(session), played)
    session.obey(Pause(paused=True), 1)
    session.advance(0.5)
    assert session.state().time == pytest.approx(1.5)
    session.obey(Pause(paused=False), 1)
    while not session.paused:
        session.advance(0.1)
    assert session.state().time == pytest.approx(3.0)
    session.obey(Pause(paused=False), 1)
    assert session.timeline().at == 0.0
    session.obey(SetLoop(loop=True), 1)
    seek(session, 2990)
    session.advance(0.1)
    session.advance(0.1)
    assert session.timeline().at == pytest.approx(0.1)
    assert not session.paused
    session.obey(Reset(), 1)
    assert session.timeline().at == 0.0


def test_what_topics_said_is_said_again(run: Run) -> None:
    session = played_session(str(run.path))
    heard: list[LaserScan] = []
    session._motion.bus.subscribe("/scan", LaserScan, heard.append)
    seek(session, 1990)
    assert heard[-1].header.stamp == Time(1, 800_000_000)
    seek(session, 410)
    assert heard[-1].header.stamp == Time(0, 400_000_000)
    assert "/scan" not in session.timeline().silent
    session.advance(0.6)
    assert [scan.header.stamp.nanoseconds // 1_000_000 for scan in heard[-3:]] == [600, 800, 1000]
    session.obey(Seek(0.0), 1)
    assert "/scan" in session.timeline().silent


def test_rates_are_told_before_anybody_hears_a_topic_and_stay_wherever_one_goes(run: Run) -> None:
    """Three seconds: a scan five times a second, odometry fifty times."""
    session = played_session(str(run.path))

    def rates() -> dict[str, float | None]:
        return {topic.name: topic.rate for topic in session.topics.topics().topics}

    told = rates()
    assert told["/scan"] == pytest.approx(5.0, abs=0.2)
    assert told["/odom"] == pytest.approx(50.0, abs=0.5)
    assert told["/robot_description"] is None  # said once
    session.topics.subscribe("/scan", 1)
    for milliseconds in (300, 400, 2000):
        seek(session, milliseconds)
        assert rates() == told


def test_a_recording_goes_as_it_went(run: Run) -> None:
    session = played_session(str(run.path))
    with pytest.raises(KbotError, match="a recording is played"):
        session.obey(Drive(0.1, 0.0), 1)


def test_the_trail_is_the_way_of_the_whole_recording(run: Run) -> None:
    session = played_session(str(run.path))
    start = session._motion._run.index.start * 1e-9
    way = whole(session)
    times, places = zip(*((1e-3 * at, poses[0, :2, 3]) for at, poses in run.poses.items()), strict=True)
    at, *place = np.array(way)[:, :3].T
    known = at + start > times[0]
    for axis in range(2):
        truth = np.interp(at + start, times, np.array(places)[:, axis])
        assert np.allclose(place[axis][known], truth[known], atol=0.02)
    assert len(way) > 20
    assert np.hypot(*(np.array(way[-1][1:3]) - places[-1])) < 0.05
    assert whole(session) == way


def whole(session: Session) -> list[Point]:
    making = session.way(0.01) if session.way is not None else iter(())
    while True:
        try:
            next(making)
        except StopIteration as done:
            way: list[Point] = done.value
            return way


def finished(making: Making) -> Table:
    while True:
        try:
            next(making)
        except StopIteration as done:
            table: Table = done.value
            return table


def write(path: Path, *packets: tuple[str, float, object]) -> str:
    """An MCAP file as any program of ROS 2 would write it, with nothing of KBot's own in it."""
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


def test_a_recording_of_ros_needs_its_robot_and_tf(tmp_path: Path) -> None:
    """One frame was told of once, long before the others; joints are read from tf: 0.5 rad about the axis."""
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
    session.obey(Seek(30.2), 1)
    state = session.state()
    assert state.time == pytest.approx(1e9 + 30.2, abs=1e-3)
    assert state.positions == pytest.approx((0.5, 0.25), abs=1e-6)
    assert state.poses[:3] == pytest.approx((4.0, 2.0, 0.0))
    assert {name for name, _ in state.frames} == {"map", "odom"}
    session.obey(Seek(10.5), 1)
    assert session.state().poses[:3] == pytest.approx((2.0, 2.0, 0.0))


def test_joint_states_alone_will_do(tmp_path: Path) -> None:
    path = write(
        tmp_path / "joints.mcap",
        ("/arm/robot_description", 1.0, String(TILTED)),
        ("/arm/joint_states", 1.5, JointState(Header(), ("shoulder", "of another robot"), (0.75, 9.0))),
        ("/arm/joint_states", 1.6, JointState(Header(), ("rail",), (-0.5,))),
    )
    session = played_session(path)
    session.obey(Seek(0.6), 1)
    assert session.state().positions == (0.75, -0.5)


@pytest.mark.parametrize(
    ("own", "other"),
    [("", "/robot_2"), ("/robot1", "/robot2"), ("/robot2", "/robot1"), ("/robot2", "")],
)
def test_another_robot_s_joints_are_not_the_shown_one_s(tmp_path: Path, own: str, other: str) -> None:
    """The other has joints of the same names, and speaks just before and after each time."""
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
    session.obey(Seek(1.2), 1)
    assert session.state().positions == (0.25, -0.25)
    session.obey(Pause(paused=False), 1)
    session.advance(1.0)
    assert session.state().positions == (0.5, -0.5)
    making = session.series([Field.named("state positions.shoulder")], 0.0, 2.2)
    assert making is not None
    rows = {row for (row,) in finished(making).rows}
    assert rows == {None, 0.0, 0.25, 0.5}


def test_a_robot_is_shown_by_the_namespace_that_was_noted(tmp_path: Path) -> None:
    """KBot keeps the description at the root, wherever its robot speaks."""
    sim = Simulation(kbot.load("kbot"), naming=Naming(namespace="robot2"))
    path = str(tmp_path / "named.mcap")
    other = sim.bus.advertise("/robot1/joint_states", JointState)
    with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), path):
        sim.cmd_vel(0.3, 0.0)
        sim.run(0.5)
        other.publish(JointState(Header(), ("left_wheel_joint",), (99.0,)))
    session = played_session(path)
    session.obey(Seek(1.0), 1)
    joints = dict(zip(sim.joint_positions, session.state().positions, strict=False))
    assert joints["left_wheel_joint"] == pytest.approx(sim.joint_positions["left_wheel_joint"], abs=1e-6)


def test_what_is_missing_is_one_clear_sentence(tmp_path: Path) -> None:
    no_robot = write(tmp_path / "a.mcap", ("/tf", 0.0, moved(0.0, "odom", "base", (0, 0, 0))))
    with pytest.raises(KbotError, match="has no /robot_description, so there is no robot to show"):
        played_session(no_robot)
    with pytest.raises(KbotError, match="neither /tf nor /joint_states"):
        played_session(write(tmp_path / "b.mcap", ("/robot_description", 0.0, String(TILTED))))
    with pytest.raises(KbotError, match="does not exist"):
        played_session(str(tmp_path / "c.mcap"))
    (tmp_path / "d.mcap").write_bytes(b"not at all")
    with pytest.raises(KbotError, match="no MCAP file"):
        played_session(str(tmp_path / "d.mcap"))


def test_a_recording_that_broke_off_is_played_to_its_last_whole_chunk(tmp_path: Path) -> None:
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
    session.obey(Seek(end), 1)
    assert session.state().poses[0] == pytest.approx(end)


def test_only_what_is_looked_at_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A moment of a long recording is found by the index: opening it and going about reads few chunks."""
    path = write(
        tmp_path / "long.mcap",
        ("/robot_description", 0.0, String(TILTED)),
        *(("/tf", 0.02 * t, moved(0.02 * t, "odom", "base", (0.02 * t, 0, 0))) for t in range(20_000)),
    )
    read: list[object] = []
    monkeypatch.setattr(mcap_index, "breakup_chunk", lambda *a, **k: read.append(a) or breakup_chunk(*a, **k))
    session = played_session(path)
    for at in (380.0, 3.0, 200.0):
        session.obey(Seek(at), 1)
        assert session.state().poses[0] == pytest.approx(at, abs=0.021)
    assert 10 < len(read) < 200 < count_of_chunks(path) / 2


def count_of_chunks(path: str) -> int:
    with Path(path).open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    return len(summary.chunk_indexes)


def test_its_robot_is_not_changed(run: Run) -> None:
    session = played_session(str(run.path))
    (file, *_), text = session.shown.files, Path(session.shown.files[0]).read_text(encoding="utf-8")
    at = text.index('"0.0')
    line, column = text.count("\n", 0, at) + 1, at - text.rfind("\n", 0, at) + 1
    for change in (
        EditSource(file, line, column, "0.0", "1.0"),
        ApplyFix(session.findings().serial, 0),
        Undo(),
    ):
        with pytest.raises(KbotError, match="of a recording, which is not changed"):
            session.obey(change, 1)
    assert Path(file).read_text(encoding="utf-8") == text
