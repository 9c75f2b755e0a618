"""Tests identification from recordings of a simulated robot whose sizes differ from those of its file."""

import math
from pathlib import Path

import numpy as np
import pytest

import kbot
from kbot.identify.agreement import agreement
from kbot.identify.identification import identify
from kbot.identify.nominal import read_nominal
from kbot.identify.recording import read_recording
from kbot.messages.types import (
    Header,
    JointState,
    Odometry,
    Point,
    Pose,
    PoseWithCovariance,
    Quaternion,
    Time,
)
from kbot.record import Recorder
from kbot.record.copy import copy_recording
from kbot.record.feed import Feed, Packet
from kbot.record.writer import open_writer
from kbot.sensors.declared import mount_declared
from kbot.sim import Simulation
from kbot.text import KbotError

RADIUS, GAP = 0.0365, 0.012
SEPARATION = 0.16 + 2 * GAP  # the width of the base, and the gaps on both sides
NOMINAL = read_nominal("kbot", {"lidar": "true"}, {}, (), None)


def drive(sim: Simulation, seconds: float) -> None:
    rng = np.random.default_rng(3)
    moves = (
        (0.2, 0.8),
        (0.2, -0.8),
        (0.3, 0.0),
        (-0.2, -0.7),
        (-0.2, 0.9),
        (-0.3, 0.0),
        (0.0, 1.2),
        (0.1, -1.2),
    )
    while sim.time < seconds:
        for linear, angular in moves:
            share = rng.uniform(0.5, 1.0)
            sim.cmd_vel(linear * share, angular * share)
            sim.run(0.9)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = str(tmp_path_factory.mktemp("recorded") / "run.mcap")
    robot = kbot.load("kbot", lidar="true", wheel_radius=str(RADIUS), base_wheel_gap=str(GAP))
    sim = Simulation(robot, world="rooms")
    mount_declared(sim)
    with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), path):
        drive(sim, 21.0)
    return path


def identified(path: str, reference: str | None = None):
    log, link = read_recording(path, NOMINAL, reference)
    return identify(log, NOMINAL.with_sensor(link)), link


@pytest.mark.parametrize("target", ["run.mcap", "run.bag", "rosbag2"])
def test_a_recording_gives_the_changed_sizes_back(recorded, tmp_path, target):
    path = recorded
    if target != "run.mcap":
        path = str(tmp_path / target)
        copy_recording(recorded, path)
    found, link = identified(path)
    assert link == "base_footprint"
    values = {name: estimate.value for name, estimate in found.parameters.items()}
    assert values["left_wheel_radius"] == pytest.approx(RADIUS, abs=2e-5)
    assert values["right_wheel_radius"] == pytest.approx(RADIUS, abs=2e-5)
    assert values["wheel_separation"] == pytest.approx(SEPARATION, abs=2e-4)
    assert found.parameters["wheel_separation"].nominal == pytest.approx(0.174)
    assert found.residual.nominal_translation > 5.0 * found.residual.translation


def test_scans_give_the_changed_sizes_back(recorded):
    found, link = identified(recorded, "/scan")
    assert link == "lidar_link"
    values = {name: estimate.value for name, estimate in found.parameters.items()}
    assert values["left_wheel_radius"] == pytest.approx(RADIUS, abs=4e-4)
    assert values["right_wheel_radius"] == pytest.approx(RADIUS, abs=4e-4)
    assert values["wheel_separation"] == pytest.approx(SEPARATION, abs=2e-3)
    assert values["sensor_x"] == pytest.approx(0.0, abs=3e-3)
    assert values["sensor_yaw"] == pytest.approx(0.0, abs=0.02)


def messages(*stamped):
    """Packets of wheel states and reference poses: ("joints", t, left, right) or ("pose", t, x, frame)."""
    for kind, time, *values in stamped:
        nanoseconds = round(time * 1e9)
        stamp = Time(nanoseconds // 10**9, nanoseconds % 10**9)
        if kind == "joints":
            names = ("left_wheel_joint", "right_wheel_joint")
            message = JointState(Header(stamp, ""), names, tuple(values), (), ())
            yield Packet("/joint_states", message, nanoseconds)
        else:
            x, frame, child = (*values, "base_footprint")[:3]
            pose = PoseWithCovariance(Pose(Point(x, 0.0, 0.0), Quaternion()))
            yield Packet("/pose", Odometry(Header(stamp, frame), child, pose), nanoseconds)


def written(path: Path, *stamped) -> str:
    writer = open_writer(str(path))
    for packet in messages(*stamped):
        writer.write(packet)
    writer.close()
    return str(path)


def rolling(times):
    return [("joints", t, t, t) for t in times]


def moving(times, frame="map"):
    return [("pose", t, 0.035 * t, frame) for t in times]


TIMES = [0.1 * index + 1.0 for index in range(50)]
BAD = {
    "no joints": (moving(TIMES), "has no joint states (sensor_msgs/JointState). It has /pose (Odometry)"),
    "no reference": (
        rolling(TIMES) + moving(TIMES, "odom"),
        "has no reference: it needs scans of a lidar, a transform from 'map', or poses",
    ),
    "no messages": ([], "has no messages"),
    "a clock that jumps back": (
        rolling([*TIMES[:20], *TIMES]) + moving(TIMES),
        "the clock jumps back on /joint_states: 2.900 s, then 1.000 s",
    ),
    "a clock that jumps ahead": (
        rolling([*TIMES, 1e6]) + moving(TIMES),
        "the clock jumps ahead by 999994 s on /joint_states at 5.900 s",
    ),
    "not a number": (
        [*rolling(TIMES), ("joints", 7.0, float("nan"), 1.0), *moving(TIMES)],
        "has a number that is not finite",
    ),
    "no motion": ([("joints", t, 1.0, 1.0) for t in TIMES] + moving(TIMES), "shows no motion"),
    "another time": (rolling(TIMES) + moving([t + 50 for t in TIMES]), "are not of the same time"),
}


@pytest.mark.parametrize("name", BAD)
def test_unusable_recordings_have_one_clear_error(tmp_path, name):
    stamped, expected = BAD[name]
    path = written(tmp_path / "run.mcap", *stamped)
    with pytest.raises(KbotError) as caught:
        identified(path)
    assert expected in str(caught.value)


@pytest.mark.parametrize(
    "wrapped", [lambda angle: angle % math.tau, lambda angle: math.remainder(angle, math.tau)]
)
def test_encoders_that_wrap(tmp_path, wrapped):
    joints = [("joints", t, wrapped(5.0 * t), wrapped(-5.0 * t)) for t in TIMES]
    log, _ = read_recording(written(tmp_path / "run.mcap", *joints, *moving(TIMES)), NOMINAL, None)
    np.testing.assert_allclose(log.wheel_speeds[1:], [[5.0, -5.0]] * (len(TIMES) - 1), rtol=1e-6)


def each_wheel(*names):
    """Joint states of wheels that have their own messages, 10 ms apart."""
    for time in TIMES:
        for index, name in enumerate(names):
            own = time + 0.01 * index
            stamp = Time.from_nanoseconds(round(own * 1e9))
            message = JointState(Header(stamp, ""), (name,), ((2.0 + index) * own,), (), ())
            yield Packet(f"/{name}", message, round(own * 1e9))


def test_wheels_in_separate_messages(tmp_path):
    writer = open_writer(str(tmp_path / "run.mcap"))
    for packet in [*each_wheel("left_wheel_joint", "right_wheel_joint"), *messages(*moving(TIMES))]:
        writer.write(packet)
    writer.close()
    log, _ = read_recording(str(tmp_path / "run.mcap"), NOMINAL, None)
    np.testing.assert_allclose(log.wheel_speeds[1:], [[2.0, 3.0]] * (len(log.durations) - 1), rtol=1e-6)
    assert log.sources["joint_states"] == "/left_wheel_joint, /right_wheel_joint"


def test_an_absent_wheel_is_named(tmp_path):
    writer = open_writer(str(tmp_path / "run.mcap"))
    for packet in [*each_wheel("left_wheel_joint"), *messages(*moving(TIMES))]:
        writer.write(packet)
    writer.close()
    with pytest.raises(
        KbotError, match=r"do not have the wheels 'right_wheel_joint'\. They have left_wheel_joint"
    ):
        read_recording(str(tmp_path / "run.mcap"), NOMINAL, None)


def test_the_topics_are_reported(recorded):
    found, _ = identified(recorded)
    assert found.sources == {
        "joint_states": "/joint_states",
        "reference": "/kbot/poses",
        "commands": "/kbot/commands",
        "sensor_link": "base_footprint",
    }
    assert found.to_text().splitlines()[-1] == (
        "sources: joint_states /joint_states, reference /kbot/poses, commands /kbot/commands, "
        "sensor_link base_footprint"
    )


def test_an_unknown_frame_of_poses_is_reported(tmp_path):
    moved = [(*pose, "marker") for pose in moving(TIMES)]
    path = written(tmp_path / "run.mcap", *rolling(TIMES), *moved)
    with pytest.warns(UserWarning, match="/pose has poses of 'marker', which is not a link of the robot"):
        _, link = read_recording(path, NOMINAL, None)
    assert link == NOMINAL.drive.base


def test_a_reference_that_is_not_in_the_recording(tmp_path):
    path = written(tmp_path / "run.mcap", *rolling(TIMES), *moving(TIMES))
    with pytest.raises(KbotError, match="has no topic /scan: choose from /joint_states, /pose"):
        identified(path, "scan")
    with pytest.raises(KbotError, match="/joint_states is not a reference"):
        identified(path, "/joint_states")


def test_a_recording_without_noise_is_compared_with_simulated_runs(tmp_path):
    """Errors of micrometres are outliers where most errors are smaller, but the robot does not slip."""
    path = str(tmp_path / "run.mcap")
    sim = Simulation(kbot.load("kbot", wheel_radius=str(RADIUS)))
    with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), path):
        for linear, angular in ((0.2, 0.0), (0.2, 0.8), (0.25, 0.0), (0.15, -0.8), (0.0, 1.5)) * 2:
            sim.cmd_vel(linear, angular)
            sim.run(3.0)
    log, link = read_recording(path, NOMINAL, None)
    nominal = NOMINAL.with_sensor(link)
    found = identify(log, nominal)
    assert found.residual.outliers > 0.3 * found.residual.intervals
    assert not found.is_disturbed.any()
    assert agreement(log, nominal, found.is_disturbed).drives >= 3


def test_odometry_of_the_wheels_is_refused_as_a_reference(tmp_path):
    path = written(tmp_path / "run.mcap", *rolling(TIMES), *moving(TIMES, "odom"))
    with pytest.raises(KbotError) as caught:
        read_recording(path, NOMINAL, "/pose")
    assert str(caught.value) == (
        f"{path}: /pose in the frame odom is computed from the wheels and cannot show their size"
    )


def test_another_sensor_than_that_of_the_reference_is_refused(recorded):
    with pytest.raises(KbotError) as caught:
        read_recording(recorded, NOMINAL, None, "lidar_link")
    assert str(caught.value) == (
        f"{recorded}: /kbot/poses has the pose of base_footprint, not of lidar_link. "
        "For the lidar use --reference /scan"
    )
    assert read_recording(recorded, NOMINAL, "/scan", "lidar_link")[1] == "lidar_link"


def test_poses_without_the_name_of_a_link_are_those_of_the_named_sensor(tmp_path):
    unnamed = [(*pose, "") for pose in moving(TIMES)]
    path = written(tmp_path / "run.mcap", *rolling(TIMES), *unnamed)
    assert read_recording(path, NOMINAL, None)[1] == NOMINAL.drive.base
    assert read_recording(path, NOMINAL, None, "base_link")[1] == "base_link"
