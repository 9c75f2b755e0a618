"""The same program of a user's beside KBot alone, as a node of ROS 1 and of ROS 2."""

import json
import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

import kbot
from kbot.messages import Odometry, Twist, Vector3
from kbot.record.run_outputs import RunOutputs
from kbot.ros.client import wanted_transport
from kbot.ros.peer_options import PeerOptions
from kbot.sim import Simulation
from kbot.text import KbotError

PROGRAM = Path(__file__).with_name("drive.py")


@pytest.fixture
def environment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """No ROS and no other KBot; a port and a domain of our own."""
    for name in ("ROS_DISTRO", "ROS_VERSION", "ROS_MASTER_URI", "ROS_IP", "ROS_NAMESPACE"):
        monkeypatch.delenv(name, raising=False)
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setenv("ROS_DOMAIN_ID", str(1 + os.getpid() % 90))
    monkeypatch.setenv("ROS_MASTER_URI", f"http://127.0.0.1:{port}/")
    return dict(os.environ)


class Kbot:
    """A simulation that keeps to the wall's clock, connected to its peers."""

    def __init__(self, options: PeerOptions) -> None:
        self.told: list[str] = []
        self.simulation = Simulation("kbot")
        self.outputs = RunOutputs(self.told.append, peers=options.open(self.told.append))
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
    found = Kbot(PeerOptions(() if request.param == "local" else (request.param,)))
    try:
        yield request.param, found
    finally:
        found.close()


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
    found: dict[str, object] = json.loads(done.stdout)
    return found


def test_it_hears_says_keeps_time_and_has_parameters(
    environment: dict[str, str], live: tuple[str, Kbot]
) -> None:
    transport, running = live
    words = ("own", "go:=cmd_vel", "_distance:=0.3")
    if transport == "ros2":
        words = ("own", "--ros-args", "-r", "go:=cmd_vel", "-p", "distance:=0.3")
    found = run_program(environment, transport, *words)
    assert (found["name"], found["distance"], found["rest"]) == ("/driver", 0.3, ["own"])
    x, ticks = found["x"], found["ticks"]
    assert isinstance(x, float)
    assert isinstance(ticks, int)
    assert 0.3 <= x < 0.35
    # 0.3 m at 0.3 m/s take a second of simulated time, and starting some of it
    assert ticks >= 8
    assert found["sim_time"] is (transport != "ros2")
    assert running.simulation.odometry.pose.x >= 0.3


def test_a_namespace_and_a_name_of_its_own(environment: dict[str, str], live: tuple[str, Kbot]) -> None:
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


def test_where_nothing_runs_it_says_what_to_start(environment: dict[str, str]) -> None:
    with pytest.raises(KbotError, match="no KBot runs here; start one in another terminal: kbot sim kbot"):
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
def test_the_environment_chooses(environment_: dict[str, str], transport: str) -> None:
    assert wanted_transport(environment_) == transport


def test_a_transport_that_there_is_not() -> None:
    with pytest.raises(KbotError, match="KBOT_TRANSPORT is local, ros1 or ros2, not 'ros3'"):
        wanted_transport({"KBOT_TRANSPORT": "ros3"})


def test_the_example_ends_with_the_message_alone(environment: dict[str, str]) -> None:
    example = Path(__file__).parents[2] / "examples" / "own_node.py"
    environment |= {"KBOT_TRANSPORT": "local"}
    command = [sys.executable, str(example)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("error: no KBot runs here; start one")
    assert done.stderr.count("\n") == 1


@pytest.fixture
def node(environment: dict[str, str]) -> Iterator[kbot.Node]:
    running = Kbot(PeerOptions())
    try:
        with kbot.Node("n", ("_rate:=5", "_side:=left"), "local") as found:
            yield found
    finally:
        running.close()


def test_parameters_have_the_default_s_type(node: kbot.Node) -> None:
    assert (node.param("rate", 1), node.param("side", "right"), node.param("missing", 7)) == (5, "left", 7)
    rate = node.param("rate", 1.5)
    assert (rate, type(rate)) == (5.0, float)
    with pytest.raises(KbotError, match="the parameter 'side' is of type int, not str: 'left'"):
        node.param("side", 1)
    with pytest.raises(KbotError, match="the parameter 'missing' is not set"):
        node.param("missing")


def test_a_topic_is_heard_or_said(node: kbot.Node) -> None:
    node.subscribe("odom", Odometry, lambda message: None)
    with pytest.raises(KbotError, match="/odom is heard by this node"):
        node.publish("odom", Odometry())
    node.publish("cmd_vel", Twist(Vector3(0.1)))
    with pytest.raises(KbotError, match="/cmd_vel is published by this node"):
        node.subscribe("cmd_vel", Twist, lambda message: None)


def test_a_topic_that_is_not_there_is_told_with_the_nearest(
    node: kbot.Node, capsys: pytest.CaptureFixture[str]
) -> None:
    node.subscribe("odon", Odometry, lambda message: None)
    node.step()
    assert "there is no topic /odon: did you mean '/odom'" in capsys.readouterr().err


def test_what_a_callback_raises_is_the_program_s_own(node: kbot.Node) -> None:
    node.every(0.1, lambda: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        node.spin(60)


def test_a_kbot_that_ends_ends_the_node(environment: dict[str, str]) -> None:
    running = Kbot(PeerOptions())
    with kbot.Node("n", (), "local") as node:
        node.subscribe("odom", Odometry, lambda message: None)
        node.spin(0.2)
        running.close()
        with pytest.raises(KbotError, match="the KBot is gone"):
            node.spin(60)


def test_nothing_is_heard_after_closing(node: kbot.Node) -> None:
    heard: list[Odometry] = []

    def hear(message: Odometry) -> None:
        heard.append(message)
        node.close()

    node.subscribe("odom", Odometry, hear)
    node.step()
    end = time.monotonic() + 60
    while len(node._link._mail.get("/odom", ())) < 3:
        assert time.monotonic() < end, "nothing came"
        time.sleep(0.01)
    node.step()
    assert len(heard) == 1


def test_a_period_is_above_zero(node: kbot.Node) -> None:
    with pytest.raises(KbotError, match="above zero"):
        node.every(0.0, lambda: None)
