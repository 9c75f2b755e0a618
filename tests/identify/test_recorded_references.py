"""Tests identification from recordings of a robot with known sizes: commands, gyro, localisation, lidar."""

import contextlib
import io
import math
from pathlib import Path

import numpy as np
import pytest

import kbot
from kbot.cli.main import run
from kbot.identify.identification import identify
from kbot.identify.nominal import read_nominal
from kbot.identify.recording import read_recording
from kbot.kinematics.planar_pose import PlanarPose
from kbot.messages.sensing import Imu
from kbot.messages.types import (
    Header,
    JointState,
    Odometry,
    Point,
    Pose,
    PoseWithCovariance,
    Quaternion,
    TFMessage,
    Time,
    Transform,
    TransformStamped,
    Twist,
    Vector3,
)
from kbot.record import Recorder
from kbot.record.feed import Feed, Packet
from kbot.record.writer import open_writer
from kbot.sensors.declared import mount_declared
from kbot.sim import Simulation

from .test_recording import drive

NOMINAL = read_nominal("kbot", {}, {}, (), None)
LEFT, RIGHT, SEPARATION = 0.0355, 0.036, 0.18
SCALE, DELAY, TIME_CONSTANT = 0.9, 0.12, 0.2
GYRO_SCALE, GYRO_BIAS = 1.02, 0.01
SECONDS = 60.0


def header(seconds: float, frame: str) -> Header:
    return Header(Time.from_nanoseconds(round(seconds * 1e9)), frame)


def transform(seconds: float, parent: str, child: str, pose: PlanarPose) -> TFMessage:
    placed = Transform(Vector3(pose.x, pose.y, 0.0), Quaternion.about_z(pose.yaw))
    return TFMessage((TransformStamped(header(seconds, parent), child, placed),))


def packets():
    """60 s of a robot that follows commands with a delay and a time constant, in steps of 1 ms.

    The axle of KBot is ahead of its base: the base moves as a point behind the axle does.
    """
    rng = np.random.default_rng(2)
    axle = NOMINAL.with_sensor("base_footprint").axle_from_sensor
    step, state, angles = 0.001, np.zeros(2), np.zeros(2)
    place, odometry = PlanarPose(), PlanarPose()
    issued = [np.zeros(2)]
    rate = 0.0
    for index in range(round(SECONDS / step)):
        time = 1.0 + index * step
        if index % 1000 == 0:
            linear, angular = rng.uniform(-0.2, 0.4), rng.uniform(-1.2, 1.2)
            yield "/cmd_vel", time, Twist(Vector3(linear), Vector3(0.0, 0.0, angular))
            half = angular * 0.174 / 2.0  # with KBot's declared separation and radius
            issued.append(np.array([linear - half, linear + half]) / 0.035)
        else:
            issued.append(issued[-1])
        if index % 20 == 0:
            names = ("left_wheel_joint", "right_wheel_joint")
            yield "/joint_states", time, JointState(header(time, ""), names, tuple(angles.tolist()))
            gyro = GYRO_SCALE * rate + GYRO_BIAS
            turning = Vector3(0.0, 0.0, gyro)
            yield "/imu", time, Imu(header=header(time, "base_link"), angular_velocity=turning)
            own = odometry @ axle
            yield "/tf", time, transform(time, "odom", "base_footprint", own)
        if index % 500 == 0:
            noise = rng.normal(0.0, 1.0, 3) * (0.001, 0.001, 0.001)
            base = place @ axle @ PlanarPose(*noise)
            yield "/tf", time, transform(time, "map", "odom", base @ (odometry @ axle).inverse())
            pose = Pose(Point(base.x, base.y, 0.0), Quaternion.about_z(base.yaw))
            message = Odometry(header(time, "map"), "base_footprint", PoseWithCovariance(pose))
            yield "/motion_capture", time, message
        wanted = SCALE * issued[max(0, len(issued) - 1 - round(DELAY / step))]
        before = state
        state = wanted + (state - wanted) * math.exp(-step / TIME_CONSTANT)
        rolled = (before + state) / 2.0 * step
        angles = angles + rolled
        place, turn = rolling(place, rolled * (LEFT, RIGHT), SEPARATION)
        odometry, _ = rolling(odometry, rolled * 0.035, 0.174)
        rate = turn / step


def rolling(pose, distances, separation):
    ahead, turn = distances.sum() / 2.0, (distances[1] - distances[0]) / separation
    heading = pose.yaw + turn / 2.0
    moved = PlanarPose(
        pose.x + ahead * math.cos(heading), pose.y + ahead * math.sin(heading), pose.yaw + turn
    )
    return moved, turn


@pytest.fixture(scope="module")
def messages():
    return [Packet(topic, message, round(time * 1e9)) for topic, time, message in packets()]


def written(path: Path, messages) -> str:
    writer = open_writer(str(path))
    for packet in messages:
        writer.write(packet)
    writer.close()
    return str(path)


def identified(path, reference, nominal=NOMINAL):
    log, link = read_recording(path, nominal, reference)
    return identify(log, nominal.with_sensor(link)), link


TRUTH = {
    "left_wheel_radius": LEFT,
    "right_wheel_radius": RIGHT,
    "wheel_separation": SEPARATION,
    "gyro_scale": GYRO_SCALE,
}


@pytest.mark.parametrize("name", ["run.mcap", "run.bag", "rosbag2"])
@pytest.mark.parametrize("reference", ["/tf", "/motion_capture"])
def test_a_localisation_gives_the_robot_back(messages, tmp_path, name, reference):
    found, link = identified(written(tmp_path / name, messages), reference)
    assert link == "base_footprint"
    for parameter, truth in TRUTH.items():
        estimate = found.parameters[parameter]
        half = (estimate.high - estimate.low) / 2.0
        assert abs(estimate.value - truth) < 2.0 * half, parameter
        assert half < 0.02 * truth, parameter
    assert found.parameters["encoder_scale"].value == pytest.approx(SCALE, abs=2e-3)
    assert found.parameters["delay"].value == pytest.approx(DELAY, abs=2e-3)
    assert found.parameters["motor_time_constant"].value == pytest.approx(TIME_CONSTANT, abs=2e-3)


def test_swapped_and_repeated_messages_change_nothing(messages, tmp_path):
    joints = [index for index, packet in enumerate(messages) if packet.topic == "/joint_states"]
    disturbed = list(messages)
    for first, second in zip(joints[100::50], joints[101::50], strict=False):
        disturbed[first], disturbed[second] = disturbed[second], disturbed[first]
    disturbed.insert(joints[40], messages[joints[40]])
    found, _ = identified(written(tmp_path / "disturbed.mcap", disturbed), "/motion_capture")
    expected, _ = identified(written(tmp_path / "run.mcap", messages), "/motion_capture")
    for name in TRUTH:
        assert found.parameters[name].value == pytest.approx(expected.parameters[name].value, rel=1e-9)


@pytest.mark.filterwarnings("ignore:.* of /scan are not used")  # some at the end of the drive do not match
def test_scans_give_the_pose_of_a_moved_lidar(tmp_path):
    """The robot has its lidar 30 mm ahead of that of the file, 20 mm to the left, and turned by 0.3 rad."""
    text = io.StringIO()
    with contextlib.redirect_stdout(text):
        assert run(["expand", "kbot", "lidar:=true"]) == 0
    before, joint, after = text.getvalue().partition('<joint name="lidar_joint"')
    start, end = after.index("<origin"), after.index("/>")
    moved = after[:start] + '<origin xyz="0.05 0.02 0.055" rpy="0 0 0.3"' + after[end:]
    file = tmp_path / "moved.urdf"
    file.write_text(before + joint + moved)
    path = str(tmp_path / "run.mcap")
    sim = Simulation(kbot.load(str(file)), world="rooms")
    mount_declared(sim)
    with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), path):
        drive(sim, 40.0)
    found, link = identified(path, "/scan", read_nominal("kbot", {"lidar": "true"}, {}, (), None))
    assert link == "lidar_link"
    parameters = found.parameters
    # a lidar with noise of 5 mm, in a drive of 40 s
    assert parameters["sensor_x"].value == pytest.approx(0.03, abs=3e-3)
    assert parameters["sensor_y"].value == pytest.approx(0.02, abs=3e-3)
    assert parameters["sensor_yaw"].value == pytest.approx(0.3, abs=0.02)
    assert parameters["sensor_x"].nominal == pytest.approx(0.0)
