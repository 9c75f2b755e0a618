"""`kbot.Node`: one user program, connected to KBot directly, by ROS 1 and by ROS 2."""

import json
import os
import socket
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kbot
from kbot.messages import JointState, Odometry, PoseWithCovariance, Twist, Vector3
from kbot.messages.sensing import Image, LaserScan
from kbot.record.run_outputs import RunOutputs
from kbot.ros.client import wanted_transport
from kbot.ros.peer_options import PeerOptions
from kbot.sim import Simulation
from kbot.text import KbotError

PROGRAM = Path(__file__).with_name("drive.py")
ROOT = Path(__file__).parents[2]


@pytest.fixture
def environment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """Without ROS and without other KBots, and with an unused master port and ROS domain."""
    for name in ("ROS_DISTRO", "ROS_VERSION", "ROS_MASTER_URI", "ROS_IP", "ROS_NAMESPACE"):
        monkeypatch.delenv(name, raising=False)
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setenv("ROS_DOMAIN_ID", str(1 + os.getpid() % 90))
    monkeypatch.setenv("ROS_MASTER_URI", f"http://127.0.0.1:{port}/")
    return dict(os.environ)


class Kbot:
    """A simulation that runs in real time, connected to its peers."""

    def __init__(self, options: PeerOptions) -> None:
        self.reported: list[str] = []
        self.simulation = Simulation("kbot")
        self.outputs = RunOutputs(self.reported.append, peers=options.open(self.reported.append))
        self.outputs.join(self.simulation, "", "empty")
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def close(self) -> None:
        self._stop.set()
        self._thread.join()
        self.outputs.close()

    def _run(self) -> None:
        while not self._stop.is_set():
            self.simulation.run_errands()
            self.simulation.step(10)
            time.sleep(0.01)


@pytest.fixture(params=["local", "ros1", "ros2"])
def live(request: pytest.FixtureRequest, environment: dict[str, str]) -> Iterator[tuple[str, Kbot]]:
    if request.param == "ros2":
        pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")
    running = Kbot(PeerOptions(() if request.param == "local" else (request.param,)))
    try:
        yield request.param, running
    finally:
        running.close()


def run_program(environment: dict[str, str], transport: str, *words: str) -> dict[str, object]:
    done = subprocess.run(
        [sys.executable, str(PROGRAM), *words],
        env={**environment, "KBOT_TRANSPORT": transport},
        capture_output=True,
        text=True,
        timeout=180,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    printed: dict[str, object] = json.loads(done.stdout)
    return printed


def test_node_has_topics_timers_parameters_and_arguments(
    environment: dict[str, str], live: tuple[str, Kbot]
) -> None:
    transport, running = live
    words = ("own", "go:=cmd_vel", "_distance:=0.3")
    if transport == "ros2":
        words = ("own", "--ros-args", "-r", "go:=cmd_vel", "-p", "distance:=0.3")
    printed = run_program(environment, transport, *words)
    assert (printed["name"], printed["distance"], printed["rest"]) == ("/driver", 0.3, ["own"])
    x, ticks = printed["x"], printed["ticks"]
    assert isinstance(x, float)
    assert isinstance(ticks, int)
    assert 0.3 <= x < 0.35
    # 0.3 m at 0.3 m/s take one second, which is 10 ticks; the timer may start late
    assert ticks >= 8
    assert printed["sim_time"] is (transport != "ros2")
    assert running.simulation.odometry.pose.x >= 0.3


def test_every_transport_takes_the_values_of_numpy_and_refuses_others(
    environment: dict[str, str], live: tuple[str, Kbot]
) -> None:
    transport, running = live
    any_values: Any = {
        "scan": (LaserScan, {"angle_min": np.float64(-0.5), "ranges": np.array([0.5, np.inf])}),
        "image": (Image, {"height": np.int64(1), "data": np.arange(6, dtype=np.uint8)}),
        "joints": (JointState, {"name": ["a"], "position": np.array([0.25], np.float32)}),
        "go": (Twist, {"linear": wrong(Vector3, x=np.float32(0.5))}),
        "estimate": (Odometry, {"pose": wrong(PoseWithCovariance, covariance=np.full(36, 0.5))}),
    }
    received: dict[str, Any] = {}
    for topic, (kind, _) in any_values.items():
        running.simulation.bus.subscribe(f"/sent/{topic}", kind, partial(received.__setitem__, topic))
    with kbot.Node("n", (), transport) as node:

        def have_arrived() -> bool:
            for topic, (kind, values) in any_values.items():
                node.publish(f"/sent/{topic}", kind(**values))
            node.step()
            return received.keys() == any_values.keys()

        until(have_arrived)
        for topic, message, field in (
            ("go", wrong(Twist, linear=wrong(Vector3, x="fast")), "Twist.linear.x must be a number"),
            ("image", Image(height=-1), "Image.height must be from 0"),
            ("scan", wrong(LaserScan, ranges=np.zeros((2, 2))), "LaserScan.ranges must have one dimension"),
            ("estimate", wrong(Odometry, pose=PoseWithCovariance(covariance=())), "covariance must have 36"),
        ):
            with pytest.raises(KbotError, match=field):
                node.publish(f"/sent/{topic}", message)
    assert received["scan"].ranges.tolist() == [0.5, np.inf]
    assert (received["scan"].angle_min, received["image"].height) == (-0.5, 1)
    assert received["image"].data == bytes(range(6))
    assert (received["joints"].name, received["joints"].position) == (("a",), (0.25,))
    assert received["go"] == Twist(Vector3(0.5))
    assert received["estimate"].pose.covariance == (0.5,) * 36


def wrong(kind: Any, **values: Any) -> Any:
    """A message of this kind whose values need not have the types of its fields."""
    return kind(**values)


def test_name_and_namespace_from_the_command_line(
    environment: dict[str, str], live: tuple[str, Kbot]
) -> None:
    transport, _ = live
    words = ("go:=/cmd_vel", "odom:=/odom", "__ns:=/team", "__name:=left")
    if transport == "ros2":
        words = (
            "--ros-args",
            "-r",
            "go:=/cmd_vel",
            "-r",
            "odom:=/odom",
            "-r",
            "__ns:=/team",
            "-r",
            "__node:=left",
        )
    assert run_program(environment, transport, *words)["name"] == "/team/left"


def test_error_names_what_to_start(environment: dict[str, str]) -> None:
    with pytest.raises(KbotError, match=r"no KBot is running\. Start one in another terminal"):
        kbot.Node("n", (), "local")
    with pytest.raises(KbotError, match="start roscore, or kbot sim kbot --ros1"):
        kbot.Node("n", (), "ros1")


@pytest.mark.parametrize(
    ("environment_", "transport"),
    [
        ({}, "local"),
        ({"ROS_MASTER_URI": "http://robot:11311"}, "ros1"),
        ({"ROS_VERSION": "1", "ROS_DISTRO": "noetic"}, "ros1"),
        ({"ROS_VERSION": "2", "ROS_DISTRO": "jazzy", "ROS_MASTER_URI": "x"}, "ros2"),
        ({"ROS_DISTRO": "humble"}, "ros2"),
        ({"ROS_VERSION": "2", "KBOT_TRANSPORT": "local"}, "local"),
    ],
)
def test_environment_selects_the_transport(environment_: dict[str, str], transport: str) -> None:
    assert wanted_transport(environment_) == transport


def test_error_for_an_unknown_transport() -> None:
    with pytest.raises(KbotError, match="KBOT_TRANSPORT must be local, ros1 or ros2, not 'ros3'"):
        wanted_transport({"KBOT_TRANSPORT": "ros3"})


@pytest.mark.parametrize(
    "example", ["examples/own_controller.py", "examples/gamepad.py", "docs/tutorial/steps/metre.py"]
)
def test_example_prints_only_the_error_message(environment: dict[str, str], example: str) -> None:
    environment |= {"KBOT_TRANSPORT": "local"}
    command = [sys.executable, str(ROOT / example)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("error: no KBot is running. Start one")
    assert done.stderr.count("\n") == 1


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no named pipes in folders")
def test_gamepad_example_drives_as_the_stick_is_held(environment: dict[str, str], tmp_path: Path) -> None:
    """The stick is half forward, then half left, in the events of linux/joystick.h."""
    device = tmp_path / "js0"
    os.mkfifo(device)
    running = Kbot(PeerOptions())
    commands: list[Twist] = []
    running.simulation.bus.subscribe("/cmd_vel", Twist, commands.append)
    command = [sys.executable, str(ROOT / "examples" / "gamepad.py"), f"_device:={device}"]
    program = subprocess.Popen(command, env=environment | {"KBOT_TRANSPORT": "local"})
    try:
        with device.open("wb", buffering=0) as stick:  # waits until the program reads
            stick.write(struct.pack("IhBB", 0, -16384, 2, 1))  # axis 1: forward is negative
            until(lambda: any(c.linear.x == pytest.approx(0.25, abs=0.001) for c in commands))
            until(lambda: running.simulation.ground_truth.pose.x > 0.05)
            stick.write(struct.pack("IhBB", 0, 1, 1, 0) + struct.pack("IhBB", 0, -16384, 2, 0))  # a button
            until(lambda: any(c.angular.z == pytest.approx(1.0, abs=0.001) for c in commands))
            until(lambda: running.simulation.ground_truth.pose.yaw > 0.2)
    finally:
        program.kill()
        program.wait()
        running.close()


def until(met: Callable[[], bool]) -> None:
    end = time.monotonic() + 60.0
    while not met():
        assert time.monotonic() < end
        time.sleep(0.02)


@pytest.fixture
def node(environment: dict[str, str]) -> Iterator[kbot.Node]:
    running = Kbot(PeerOptions())
    try:
        with kbot.Node("n", ("_rate:=5", "_side:=left"), "local") as node:
            yield node
    finally:
        running.close()


def test_parameters_must_have_the_type_of_the_default(node: kbot.Node) -> None:
    assert (node.param("rate", 1), node.param("side", "right"), node.param("missing", 7)) == (5, "left", 7)
    rate = node.param("rate", 1.5)
    assert (rate, type(rate)) == (5.0, float)
    with pytest.raises(KbotError, match="the parameter 'side' must be of type int, not str: 'left'"):
        node.param("side", 1)
    with pytest.raises(KbotError, match="the parameter 'missing' is not set"):
        node.param("missing")


def test_the_repr_of_a_node_names_its_topics(node: kbot.Node) -> None:
    node.publish("go", Twist())
    assert repr(node) == f"Node({node.name!r}, publishes ['/go'])"
    assert not [name for name in dir(node) if name.startswith("_")]
    node.close()
    assert repr(node) == f"Node({node.name!r}, publishes ['/go'], closed)"


def test_node_cannot_publish_and_subscribe_to_one_topic(node: kbot.Node) -> None:
    node.subscribe("odom", Odometry, lambda message: None)
    with pytest.raises(KbotError, match="this node subscribes to /odom"):
        node.publish("odom", Odometry())
    node.publish("cmd_vel", Twist(Vector3(0.1)))
    with pytest.raises(KbotError, match="this node publishes /cmd_vel"):
        node.subscribe("cmd_vel", Twist, lambda message: None)


def test_unknown_topic_is_reported_with_the_nearest_name(
    node: kbot.Node, capsys: pytest.CaptureFixture[str]
) -> None:
    node.subscribe("odon", Odometry, lambda message: None)
    node.step()
    assert "there is no topic /odon: did you mean '/odom'" in capsys.readouterr().err


def test_exceptions_of_callbacks_reach_the_program(node: kbot.Node) -> None:
    node.every(0.1, lambda: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        node.spin(60)


def test_spin_raises_when_kbot_exits(environment: dict[str, str]) -> None:
    running = Kbot(PeerOptions())
    with kbot.Node("n", (), "local") as node:
        node.subscribe("odom", Odometry, lambda message: None)
        node.spin(0.2)
        running.close()
        with pytest.raises(KbotError, match="KBot has closed the connection"):
            node.spin(60)


def test_no_callback_runs_after_close(node: kbot.Node) -> None:
    received: list[Odometry] = []

    def receive(message: Odometry) -> None:
        received.append(message)
        node.close()

    node.subscribe("odom", Odometry, receive)
    node.step()
    end = time.monotonic() + 60
    while len(node._link._inbox.get("/odom", ())) < 3:
        assert time.monotonic() < end, "no message arrived"
        time.sleep(0.01)
    node.step()
    assert len(received) == 1


def test_a_period_must_be_above_zero(node: kbot.Node) -> None:
    with pytest.raises(KbotError, match="must be above 0 s"):
        node.every(0.0, lambda: None)
