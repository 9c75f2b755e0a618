"""NodePilot: a controller drives a robot through a node, with its odometry and scans."""

import math
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import kbot
from kbot.learn.policies.policy import Policy, PolicyController
from kbot.messages import Header, Odometry, Twist
from kbot.messages.sensing import LaserScan
from kbot.model.writer import to_urdf
from kbot.navigation import GoToPose, Observation, ObstacleGuard, outline, twist
from kbot.record.run_outputs import RunOutputs
from kbot.ros.client.pilot import NodePilot
from kbot.ros.peer_options import PeerOptions
from kbot.sensors.declared import mount_declared
from kbot.sim import Simulation


@pytest.fixture
def simulation(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Simulation]:
    """A robot with a lidar in a corridor, simulated on another thread."""
    for name in ("ROS_DISTRO", "ROS_VERSION", "ROS_MASTER_URI", "ROS_NAMESPACE"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    running = Simulation(kbot.load("kbot", lidar=True), world="corridor:length=1.6")
    mount_declared(running)
    outputs = RunOutputs(print, peers=PeerOptions().open(print))
    outputs.join(running, "", "corridor")
    stop = threading.Event()

    def run() -> None:
        while not stop.is_set():
            running.run_errands()
            running.step(4)  # slower than real time, so that the pilot keeps up on a busy machine
            time.sleep(0.01)

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield running
    finally:
        stop.set()
        thread.join()
        outputs.close()


class Recorded:
    """A node without peers. `periods` has the seconds between the calls of its timers."""

    def __init__(self) -> None:
        self.now, self.periods, self.description = 0.0, [], ""
        self.receive, self.published = {}, []

    def subscribe(self, topic: str, _: type, callback: object) -> None:
        self.receive[topic] = callback

    def advertise(self, _topic: str, _: type) -> SimpleNamespace:
        return SimpleNamespace(publish=self.published.append)

    def every(self, period: float, _: object) -> None:
        self.periods.append(period)

    def param(self, name: str, default: str) -> str:
        assert name == "robot_description"
        return self.description or default


def test_a_scan_that_does_not_show_what_is_behind_the_robot_ends_the_goal(straight_policy: Path) -> None:
    node = Recorded()
    controller = PolicyController(Policy.read(straight_policy), kbot.PlanarPose(2.0, 0.0))
    pilot = NodePilot(node, controller)
    node.receive["odom"](Odometry())
    ranges = np.full(270, 6.0, np.float32)
    scan = LaserScan(Header(), -math.pi, math.pi, math.tau / 269, 0.0, 0.1, 0.1, 8.0, ranges)
    node.receive["scan"](scan)
    pilot.tick()
    assert node.published[-1].linear.x == pytest.approx(0.3)
    three_quarters = replace(scan, angle_min=-3 * math.pi / 4, angle_max=3 * math.pi / 4)
    node.receive["scan"](three_quarters)
    pilot.tick()
    assert node.published[-1].linear.x == 0.0
    assert controller.status == "refused"
    assert controller.status.reason.endswith("but the lidar only from -135 to 135 degrees")


@pytest.mark.parametrize(("rate", "updates"), [(10.0, 20.0), (15.0, 30.0), (50.0, 50.0), (0.5, 20.0)])
def test_the_pilot_keeps_the_rate_of_a_policy(straight_policy: Path, rate: float, updates: float) -> None:
    node, policy = Recorded(), Policy.read(straight_policy)
    policy = replace(policy, interface=replace(policy.required_interface, rate=rate))
    controller = PolicyController(policy, kbot.PlanarPose(2.0, 0.0))
    NodePilot(node, controller)
    assert node.periods == pytest.approx([1.0 / updates])
    if rate > 20.0:
        with pytest.raises(kbot.KbotError, match="must be updated 50 times per second"):
            NodePilot(node, controller, rate=20.0)


def test_the_pilot_reports_a_policy_that_is_faster_than_the_described_robot(
    straight_policy: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    node, policy = Recorded(), Policy.read(straight_policy)
    policy = replace(policy, interface=replace(policy.required_interface, angular=(-20.0, 20.0)))
    controller = PolicyController(policy, kbot.PlanarPose(2.0, 0.0))
    guard = ObstacleGuard(controller, outline(kbot.load("kbot"), "base_footprint"))
    NodePilot(node, guard)
    assert not capsys.readouterr().err  # without a description
    node.description = "no robot"
    NodePilot(node, guard)
    assert not capsys.readouterr().err
    node.description = to_urdf(kbot.load("kbot", lidar=True))
    NodePilot(node, guard)
    # two wheels at 1 m/s, 0.174 m apart
    assert capsys.readouterr().err == (
        "info: the policy commands up to 20 rad/s, but robot 'kbot' only reaches 11.5 rad/s [W308]\n"
    )
    NodePilot(node, PolicyController(Policy.read(straight_policy), kbot.PlanarPose(2.0, 0.0)))
    assert not capsys.readouterr().err


def test_the_pilot_needs_no_description_for_a_controller_without_stated_speeds(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def refuse(*_: str) -> str:
        raise kbot.KbotError("the parameter 'robot_description' must be of type str, not int: 1")

    node = Recorded()
    monkeypatch.setattr(node, "param", refuse)
    NodePilot(node, GoToPose(kbot.PlanarPose(2.0, 0.0)))
    assert node.periods


def _until(node: kbot.Node, met: object, seconds: float = 60.0) -> bool:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        node.spin(0.05)
        if met():
            return True
    return False


def test_pilot_reaches_a_goal_by_odometry(simulation: Simulation) -> None:
    with kbot.Node("driver", ()) as node:
        controller = GoToPose(kbot.PlanarPose(0.4, 0.0, 0.3))
        pilot = NodePilot(node, controller)
        assert _until(node, lambda: controller.is_done)
        pilot.close()
        node.spin(0.2)
    pose = simulation.odometry.pose
    assert (pose.x, pose.y, pose.yaw) == pytest.approx((0.4, 0.0, 0.3), abs=0.06)


def test_guard_stops_the_robot_before_the_wall(simulation: Simulation) -> None:
    class Straight:
        def update(self, observation: Observation) -> Twist:
            return twist(0.3, 0.0)

    guard = ObstacleGuard(Straight(), outline(simulation.robot, "base_footprint"))
    with kbot.Node("driver", ()) as node:
        NodePilot(node, guard)
        assert _until(node, lambda: guard.blocked_since is not None)
        node.spin(0.5)
    # the end wall's face is at 1.09 m; the robot reaches 0.06 m ahead of its base
    front = simulation.ground_truth.pose.x + 0.06
    assert 0.8 < front < 1.09
    assert math.isfinite(front)


def test_own_controller_example_follows_a_wall_on_a_running_robot(simulation: Simulation) -> None:
    """The corridor is 0.8 m wide: the robot starts 0.39 m from the wall, and shall be 0.3 m from it."""
    example = Path(__file__).parents[2] / "examples" / "own_controller.py"
    command = [sys.executable, str(example), "_seconds:=4"]
    subprocess.run(command, env=os.environ | {"KBOT_TRANSPORT": "local"}, timeout=120, check=True)
    pose = simulation.ground_truth.pose
    assert pose.x > 0.3
    assert 0.39 - pose.y == pytest.approx(0.3, abs=0.03)


def test_a_policy_drives_the_robot_of_another_process(simulation: Simulation, straight_policy: Path) -> None:
    """Its node gets odometry and scans over the transport `local`, and publishes commands."""
    with kbot.Node("driver", ()) as node:
        controller = PolicyController(Policy.read(straight_policy), kbot.PlanarPose(0.6, 0.1))
        pilot = NodePilot(node, controller)
        assert _until(node, lambda: controller.is_done)
        pilot.close()
        node.spin(0.2)
    assert controller.status == "reached"
    pose = simulation.odometry.pose
    assert math.hypot(pose.x - 0.6, pose.y - 0.1) < 0.2
