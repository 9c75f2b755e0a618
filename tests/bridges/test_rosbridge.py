"""The rosbridge bridge, with roslibpy, and with a raw client for what roslibpy does not send."""

import json
import subprocess
import sys
import threading
from collections.abc import Iterator
from itertools import pairwise

import pytest
from websockets.sync.client import ClientConnection, connect

from kbot.ros.bridges.rosbridge.bridge import RosbridgeBridge

from .conftest import Running, wait_until


@pytest.fixture
def bridge(running: Running) -> Iterator[RosbridgeBridge]:
    bridge = RosbridgeBridge(running.link, port=0)
    try:
        yield bridge
    finally:
        bridge.close()


@pytest.fixture
def raw(bridge: RosbridgeBridge) -> Iterator[ClientConnection]:
    with connect(bridge.address, max_queue=None) as connection:
        yield connection


def receive(connection: ClientConnection, operation: str) -> dict:
    while True:
        found = json.loads(connection.recv(60))
        if found["op"] == operation:
            return found


def test_times_are_named_as_in_ros_1_or_ros_2(running: Running, raw: ClientConnection) -> None:
    raw.send(json.dumps({"op": "subscribe", "topic": "/odom", "type": "nav_msgs/Odometry", "id": "a"}))
    stamp = receive(raw, "publish")["msg"]["header"]["stamp"]
    assert set(stamp) == {"secs", "nsecs"}
    raw.send(json.dumps({"op": "unsubscribe", "topic": "/odom", "id": "a"}))
    raw.send(json.dumps({"op": "subscribe", "topic": "/clock", "type": "rosgraph_msgs/msg/Clock"}))
    while (found := receive(raw, "publish"))["topic"] != "/clock":
        continue
    assert set(found["msg"]["clock"]) == {"sec", "nanosec"}


def test_throttling_by_simulated_time(running: Running, raw: ClientConnection) -> None:
    raw.send(json.dumps({"op": "subscribe", "topic": "/clock", "throttle_rate": 100}))
    times = [receive(raw, "publish")["msg"]["clock"] for _ in range(4)]
    at = [t["secs"] * 10**9 + t["nsecs"] for t in times]
    assert [b - a for a, b in pairwise(at)] == [100_000_000] * 3


def test_a_twist_drives_the_robot_until_it_times_out(running: Running, raw: ClientConnection) -> None:
    raw.send(json.dumps({"op": "advertise", "topic": "/cmd_vel", "type": "geometry_msgs/Twist"}))
    raw.send(json.dumps({"op": "publish", "topic": "/cmd_vel", "msg": {"linear": {"x": 0.3}}}))
    wait_until(lambda: running.simulation.robots.first.twist.x > 0.1)
    wait_until(lambda: running.simulation.robots.first.twist.x == 0.0)


@pytest.mark.parametrize(
    ("request_", "error"),
    [
        ("{", "not JSON"),
        ("5", "object with an 'op'"),
        ('{"op": "fly"}', "no operation 'fly'"),
        ('{"op": "subscribe"}', "KeyError 'topic'"),
        ('{"op": "subscribe", "topic": "/odmo"}', "no topic /odmo: did you mean"),
        ('{"op": "subscribe", "topic": "/odom", "type": "std_msgs/String"}', "carries nav_msgs/msg/Odometry"),
        ('{"op": "subscribe", "topic": "/odom", "compression": "png"}', "without compression"),
        (
            '{"op": "publish", "topic": "/odom", "msg": {}}',
            "KBot publishes /odom and does not subscribe to it",
        ),
        ('{"op": "publish", "topic": "/cmd_vel", "msg": {"linaer": {}}}', "has no field 'linaer'"),
        ('{"op": "publish", "topic": "/cmd_vel", "msg": 5}', "needs fields by name"),
        ('{"op": "publish", "topic": "/cmd_vel"}', "KeyError 'msg'"),
    ],
)
def test_errors_are_reported_to_the_client(
    running: Running, raw: ClientConnection, request_: str, error: str
) -> None:
    wait_until(lambda: "/cmd_vel" in running.link.topics)
    raw.send(request_)
    assert error in receive(raw, "status")["msg"]
    raw.send('{"op": "subscribe", "topic": "/odom"}')
    receive(raw, "publish")


def test_roslibpy_is_a_peer(running: Running, bridge: RosbridgeBridge) -> None:
    """In its own process, because the reactor of roslibpy can be started only once."""
    roslibpy = pytest.importorskip("roslibpy", reason="roslibpy is not installed")
    assert roslibpy
    host, port = bridge.address.removeprefix("ws://").split(":")
    program = f"""
import json, threading, roslibpy
ros = roslibpy.Ros("{host}", {port})
ros.run(60)
found, moves = {{}}, threading.Event()
odom = roslibpy.Topic(ros, "/odom", "nav_msgs/Odometry")
def receive(message):
    found["speed"] = message["twist"]["twist"]["linear"]["x"]
    if found["speed"] > 0.1:
        moves.set()
odom.subscribe(receive)
drive = roslibpy.Topic(ros, "/cmd_vel", "geometry_msgs/Twist")
for _ in range(100):
    drive.publish(roslibpy.Message({{"linear": {{"x": 0.3, "y": 0.0, "z": 0.0}}}}))
    if moves.wait(0.1):
        break
found["topics"] = ros.get_topics()
found["type"] = ros.get_topic_type("/odom")
found["nodes"] = ros.get_nodes()
found["parameter"] = roslibpy.Param(ros, "/use_sim_time").get()
ros.close()
print(json.dumps(found), flush=True)
import os; os._exit(0)
"""
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=180, check=False
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout.splitlines()[-1])
    assert found["speed"] > 0.1
    assert {"/odom", "/cmd_vel", "/tf_static"} <= set(found["topics"])
    assert (found["type"], found["nodes"], found["parameter"]) == ("nav_msgs/Odometry", ["/kbot"], True)


def test_errors_of_rosapi(bridge: RosbridgeBridge, raw: ClientConnection) -> None:
    for service, arguments, error in (
        ("/rosapi/topic", {}, "did you mean"),
        ("/other", {}, "no service /other"),
        ("/rosapi/get_param", {"name": "/use_sim_tme"}, "did you mean"),
        ("/rosapi/topics", [1], "must be a JSON object"),
        ("/rosapi/set_param", {"name": "x", "value": "[" * 5_000}, "the value of x is not JSON"),
        ("/rosapi/set_param", {"name": "x", "value": "[" * 100_000}, "is nested too deeply"),
    ):
        raw.send(json.dumps({"op": "call_service", "service": service, "args": arguments, "id": "1"}))
        answer = receive(raw, "service_response")
        assert answer["result"] is False
        assert error in answer["values"]["message"]


def test_many_clients_at_once(running: Running, bridge: RosbridgeBridge) -> None:
    def subscribe() -> None:
        with connect(bridge.address) as connection:
            connection.send('{"op": "subscribe", "topic": "/odom"}')
            for _ in range(5):
                receive(connection, "publish")
            done.append(1)

    done: list[int] = []
    threads = [threading.Thread(target=subscribe) for _ in range(20)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(done) == 20
    assert running.is_stepping()
