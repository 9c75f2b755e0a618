"""Playback in the workbench: it displays what was recorded, at any time, by any program."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

import kbot
from kbot.messages.sensing import LaserScan
from kbot.messages.types import Time
from kbot.record import Recorder
from kbot.record.feed import Feed
from kbot.sensors import Lidar
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.tf.robot_state_publisher import RobotStatePublisher
from kbot.workbench.protocol import ApplyFix, Drive, EditSource, Pause, Reset, Seek, SetLoop, Undo
from kbot.workbench.session.played_session import played_session
from kbot.workbench.session.session import Session
from kbot.workbench.timeline.driven_paths import TrailPoint
from kbot.workbench.timeline.series import Making, SeriesTable

pytestmark = pytest.mark.usefixtures("keeps_up")


@dataclass
class Run:
    """A recorded run and its true course: link poses by time in ms."""

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
    session.handle(Seek(milliseconds * 1e-3 - start * 1e-9), 1)


def test_every_time_is_displayed_as_recorded(run: Run) -> None:
    session = played_session(str(run.path))
    root_from = None
    for at in (3000, 200, 2000, 1900, 1000, 2900, 100):
        seek(session, at)
        assert session.state().time == pytest.approx(at * 1e-3)
        poses, joints = shown(session), dict(zip(run.joints[at], session.state().positions, strict=True))
        # the recording has the pose of odometry, which differs slightly from the true one
        assert np.abs(poses[:, :3, 3] - run.poses[at][:, :3, 3]).max() < 0.01
        assert np.abs(poses[:, :3, :3] - run.poses[at][:, :3, :3]).max() < 0.03
        assert joints == pytest.approx(run.joints[at], abs=1e-6)
        root_from = poses if root_from is None else root_from
    assert np.abs(shown(session) - root_from).max() > 0.1  # the robot moved


def test_playback_starts_at_the_current_time_and_stops_at_the_end(run: Run) -> None:
    session = played_session(str(run.path))
    seek(session, 1000)
    for _ in range(25):
        session.advance(0.02)
    assert session.state().time == pytest.approx(1.5)
    played = shown(session)
    seek(session, 1500)
    assert np.allclose(shown(session), played)
    session.handle(Pause(paused=True), 1)
    session.advance(0.5)
    assert session.state().time == pytest.approx(1.5)
    session.handle(Pause(paused=False), 1)
    while not session.paused:
        session.advance(0.1)
    assert session.state().time == pytest.approx(3.0)
    session.handle(Pause(paused=False), 1)
    assert session.timeline().at == 0.0
    session.handle(SetLoop(loop=True), 1)
    seek(session, 2990)
    session.advance(0.1)
    session.advance(0.1)
    assert session.timeline().at == pytest.approx(0.1)
    assert not session.paused
    session.handle(Reset(), 1)
    assert session.timeline().at == 0.0


def test_topics_are_republished(run: Run) -> None:
    session = played_session(str(run.path))
    received: list[LaserScan] = []
    session._motion.bus.subscribe("/scan", LaserScan, received.append)
    seek(session, 1990)
    assert received[-1].header.stamp == Time(1, 800_000_000)
    seek(session, 410)
    assert received[-1].header.stamp == Time(0, 400_000_000)
    assert "/scan" not in session.timeline().silent
    session.advance(0.6)
    assert [scan.header.stamp.nanoseconds // 1_000_000 for scan in received[-3:]] == [600, 800, 1000]
    session.handle(Seek(0.0), 1)
    assert "/scan" in session.timeline().silent


def test_rates_are_known_without_subscribers_and_do_not_change_by_seeking(run: Run) -> None:
    """Three seconds: a scan five times a second, odometry fifty times."""
    session = played_session(str(run.path))

    def rates() -> dict[str, float | None]:
        return {topic.name: topic.rate for topic in session.topics.topics().topics}

    reported = rates()
    assert reported["/scan"] == pytest.approx(5.0, abs=0.2)
    assert reported["/odom"] == pytest.approx(50.0, abs=0.5)
    assert reported["/robot_description"] is None  # published once
    session.topics.subscribe("/scan", 1)
    for milliseconds in (300, 400, 2000):
        seek(session, milliseconds)
        assert rates() == reported


def test_a_recording_cannot_be_driven(run: Run) -> None:
    session = played_session(str(run.path))
    with pytest.raises(KbotError, match="a recording is being played back"):
        session.handle(Drive(0.1, 0.0), 1)


def test_the_trail_is_the_path_of_the_whole_recording(run: Run) -> None:
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


def whole(session: Session) -> list[TrailPoint]:
    making = session.recorded_path(0.01) if session.recorded_path is not None else iter(())
    while True:
        try:
            next(making)
        except StopIteration as done:
            way: list[TrailPoint] = done.value
            return way


def finished(making: Making) -> SeriesTable:
    while True:
        try:
            next(making)
        except StopIteration as done:
            table: SeriesTable = done.value
            return table


def test_the_robot_of_a_recording_cannot_be_changed(run: Run) -> None:
    session = played_session(str(run.path))
    (file, *_), text = session.shown.files, Path(session.shown.files[0]).read_text(encoding="utf-8")
    at = text.index('"0.0')
    line, column = text.count("\n", 0, at) + 1, at - text.rfind("\n", 0, at) + 1
    for change in (
        EditSource(file, line, column, "0.0", "1.0"),
        ApplyFix(session.findings().serial, 0),
        Undo(),
    ):
        with pytest.raises(KbotError, match="part of a recording and cannot be changed"):
            session.handle(change, 1)
    assert Path(file).read_text(encoding="utf-8") == text
