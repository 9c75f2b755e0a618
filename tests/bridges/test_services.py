"""Gazebo's services: their effects on the simulation, and calls over each protocol that has services."""

import json
import math
import socket
import struct
from collections.abc import Iterator

import pytest
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from kbot.messages import services as srv
from kbot.messages import types as msg
from kbot.record.encodings.serialization import decode_cdr, decode_ros1, encode_cdr, encode_ros1
from kbot.ros.bridges.foxglove.bridge import SUBPROTOCOLS, FoxgloveBridge
from kbot.ros.bridges.ros1.bridge import Ros1Bridge
from kbot.ros.bridges.ros1.rpc import call
from kbot.ros.bridges.ros1.tcpros import encode_header, read_block, read_exactly, read_header
from kbot.ros.bridges.rosbridge.bridge import RosbridgeBridge
from kbot.ros.bridges.service import Service
from kbot.ros.service_types import service_type
from kbot.text import KbotError

from .conftest import Running, wait_until

BOX = """<robot name="box"><link name="body">
<inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision></link></robot>"""

CRATE = """<sdf version="1.7"><model name="crate"><link name="l"><inertial><mass>2</mass></inertial>
<collision name="c"><geometry><box><size>0.2 0.2 0.2</size></box></geometry></collision></link></model>
</sdf>"""


def call_service(running: Running, service: str, request: object) -> object:
    return running.link.call(service, request).result(20)


def test_services_are_answered_while_paused(running: Running) -> None:
    call_service(running, "/gazebo/pause_physics", srv.EmptyRequest())
    before = running.simulation.time
    request = srv.GetModelStateRequest(running.simulation.robot.name)
    stamp = call_service(running, "/gazebo/get_model_state", request).header.stamp
    assert stamp.nanoseconds * 1e-9 == pytest.approx(before, abs=1e-9)
    assert running.simulation.time == before
    call_service(running, "/gazebo/unpause_physics", srv.EmptyRequest())
    assert running.is_stepping()


def test_a_urdf_model_is_spawned_and_deleted(running: Running) -> None:
    place = msg.Pose(msg.Point(2.0, 1.0, 0.0), msg.Quaternion(0.0, 0.0, math.sin(0.5), math.cos(0.5)))
    spawn = srv.SpawnModelRequest("crate", BOX, "", place)
    assert call_service(running, "/gazebo/spawn_urdf_model", spawn).success
    state = call_service(running, "/gazebo/get_model_state", srv.GetModelStateRequest("crate"))
    p = state.pose.position
    assert (p.x, p.y, p.z) == pytest.approx((2.0, 1.0, 0.1), abs=1e-3)  # on its lower face
    assert 2.0 * math.atan2(state.pose.orientation.z, state.pose.orientation.w) == pytest.approx(
        1.0, abs=1e-3
    )
    again = call_service(running, "/gazebo/spawn_urdf_model", spawn)
    assert not again.success
    assert "crate" in again.status_message
    assert call_service(running, "/gazebo/delete_model", srv.DeleteModelRequest("crate")).success
    deleted = call_service(running, "/gazebo/get_model_state", srv.GetModelStateRequest("crate"))
    assert not deleted.success
    assert "crate" in deleted.status_message


def test_an_sdf_model_is_spawned(running: Running) -> None:
    request = srv.SpawnModelRequest("box", CRATE, "", msg.Pose(msg.Point(1.0)), "")
    answer = call_service(running, "/gazebo/spawn_sdf_model", request)
    assert (answer.success, answer.status_message) == (True, "spawned box at 1.000, 0.000, 0.000")
    broken = srv.SpawnModelRequest("other", CRATE.replace("0.2 0.2 0.2", "0.2"))
    answer = call_service(running, "/gazebo/spawn_sdf_model", broken)
    assert not answer.success
    assert "other.sdf:2" in answer.status_message


def test_an_invalid_robot_is_refused_with_its_line(running: Running) -> None:
    broken = srv.SpawnModelRequest("bad", "<robot name='bad'>\n<joint name='j' type='fixed'/></robot>")
    found = call_service(running, "/gazebo/spawn_urdf_model", broken)
    assert not found.success
    assert "bad.urdf:2:" in found.status_message


def test_a_state_is_set_in_the_frame_of_another_model(running: Running) -> None:
    name = running.simulation.robot.name
    call_service(
        running, "/gazebo/spawn_urdf_model", srv.SpawnModelRequest("crate", BOX, "", msg.Pose(msg.Point(3.0)))
    )
    beside = srv.ModelState("crate", msg.Pose(msg.Point(0.0, 1.0, 0.5)), msg.Twist(), name)
    call_service(running, "/gazebo/pause_physics", srv.EmptyRequest())
    assert call_service(running, "/gazebo/set_model_state", srv.SetModelStateRequest(beside)).success
    root = running.simulation.models.get_model_state(name).pose.translation
    found = running.simulation.models.get_model_state("crate").pose.translation
    assert (found - root).tolist() == pytest.approx([0.0, 1.0, 0.5], abs=1e-6)


def test_a_wrench_accelerates_a_body(running: Running) -> None:
    """1 kg in the air, with a force of 2 N for 0.5 s, reaches 1 m/s."""
    call_service(
        running, "/gazebo/spawn_urdf_model", srv.SpawnModelRequest("crate", BOX, "", msg.Pose(msg.Point(3.0)))
    )
    call_service(running, "/gazebo/pause_physics", srv.EmptyRequest())
    high = srv.ModelState("crate", msg.Pose(msg.Point(3.0, 0.0, 10.0)))
    call_service(running, "/gazebo/set_model_state", srv.SetModelStateRequest(high))
    push = srv.ApplyBodyWrenchRequest(
        "crate::body", wrench=srv.Wrench(msg.Vector3(0.0, 2.0)), duration=srv.Duration(0, 500_000_000)
    )
    assert call_service(running, "/gazebo/apply_body_wrench", push).success
    running.simulation.run(0.5)
    crate = call_service(running, "/gazebo/get_model_state", srv.GetModelStateRequest("crate"))
    assert crate.twist.linear.y == pytest.approx(1.0, abs=0.01)
    assert crate.twist.linear.z == pytest.approx(-9.81 * 0.5, abs=0.05)


def test_reset_world_keeps_the_time_and_reset_simulation_does_not(running: Running) -> None:
    sim = running.simulation
    sim.cmd_vel(0.3, 0.0)
    wait_until(lambda: sim.ground_truth.pose.x > 0.2)
    call_service(running, "/gazebo/pause_physics", srv.EmptyRequest())
    time = sim.time
    call_service(running, "/gazebo/reset_world", srv.EmptyRequest())
    assert (sim.time, sim.ground_truth.pose.x) == (time, 0.0)
    call_service(running, "/gazebo/reset_simulation", srv.EmptyRequest())
    assert sim.time == 0.0


def test_states_of_models_and_links_are_topics(running: Running) -> None:
    received: dict[str, object] = {}
    for topic in ("/gazebo/model_states", "/gazebo/link_states"):
        running.link.open(topic, lambda packet: received.__setitem__(packet.topic, packet.message))
    wait_until(lambda: len(received) == 2)
    robot = running.simulation.robot
    models, links = received["/gazebo/model_states"], received["/gazebo/link_states"]
    assert models.name == (robot.name, "ground_plane")
    assert links.name == tuple(f"{robot.name}::{link}" for link in robot.links)
    running.link.send("/gazebo/set_model_state", srv.ModelState(robot.name, msg.Pose(msg.Point(1.5))))
    wait_until(lambda: abs(running.simulation.ground_truth.pose.x - 1.5) < 0.05)


def test_quaternions_are_normalized(running: Running) -> None:
    """A quaternion of any length turns the crate by half a turn about x."""
    call_service(
        running, "/gazebo/spawn_urdf_model", srv.SpawnModelRequest("crate", BOX, "", msg.Pose(msg.Point(3.0)))
    )
    call_service(running, "/gazebo/pause_physics", srv.EmptyRequest())
    for length in (1e-200, 1e308):
        turned = msg.Pose(msg.Point(3.0, 0.0, 0.1), msg.Quaternion(length, 0.0, 0.0, 0.0))
        assert call_service(
            running, "/gazebo/set_model_state", srv.SetModelStateRequest(srv.ModelState("crate", turned))
        ).success
        state = call_service(running, "/gazebo/get_model_state", srv.GetModelStateRequest("crate"))
        q = state.pose.orientation
        assert [abs(q.x), q.y, q.z, q.w] == pytest.approx([1.0, 0.0, 0.0, 0.0], abs=1e-9)
    call_service(running, "/gazebo/unpause_physics", srv.EmptyRequest())
    assert running.is_stepping()


def test_an_unforeseen_error_of_a_service_does_not_stop_the_simulation(
    running: Running, caplog: pytest.LogCaptureFixture
) -> None:
    """The caller gets an error, and a line is logged."""

    def fail(simulation: object, request: object) -> object:
        raise ZeroDivisionError("by zero")

    kind = service_type("std_srvs/Empty")
    running.link.offer({**running.link.services, "/failing": Service("/failing", kind, fail)})
    with pytest.raises(KbotError, match="KBot could not process this: ZeroDivisionError"):
        call_service(running, "/failing", srv.EmptyRequest())
    assert "/failing failed: internal error (ZeroDivisionError)" in caplog.text
    request = srv.GetModelStateRequest(running.simulation.robot.name)
    assert call_service(running, "/gazebo/get_model_state", request).success
    assert running.is_stepping()


def test_error_for_an_unknown_service_suggests_the_nearest(running: Running) -> None:
    with pytest.raises(KbotError, match="did you mean '/gazebo/pause_physics'"):
        running.link.call("/gazebo/pause_physic", srv.EmptyRequest())


# over rosbridge


@pytest.fixture
def rosbridge(running: Running) -> Iterator[ClientConnection]:
    bridge = RosbridgeBridge(running.link, port=0)
    try:
        with connect(bridge.address) as connection:
            yield connection
    finally:
        bridge.close()


def rosbridge_call(connection: ClientConnection, called: str, **arguments: object) -> dict:
    connection.send(json.dumps({"op": "call_service", "service": called, "args": arguments, "id": "1"}))
    return json.loads(connection.recv(60))


def test_rosbridge_calls(running: Running, rosbridge: ClientConnection) -> None:
    name = running.simulation.robot.name
    found = rosbridge_call(rosbridge, "/gazebo/get_model_state", model_name=name)
    assert found["result"]
    assert found["values"]["success"]
    assert found["values"]["header"]["frame_id"] == "world"
    wrong = rosbridge_call(rosbridge, "/gazebo/get_model_state", modle_name=name)
    assert not wrong["result"]
    assert "did you mean 'model_name'" in wrong["values"]["message"]
    kind = rosbridge_call(rosbridge, "/rosapi/service_type", service="/gazebo/spawn_urdf_model")
    assert kind["values"] == {"type": "gazebo_msgs/SpawnModel"}


def test_rosbridge_sets_parameters(running: Running, rosbridge: ClientConnection) -> None:
    assert rosbridge_call(rosbridge, "/rosapi/set_param", name="/speed", value="0.5")["result"]
    assert rosbridge_call(rosbridge, "/rosapi/get_param", name="/speed")["values"] == {"value": "0.5"}
    assert running.link.parameters["/speed"] == 0.5
    rosbridge_call(rosbridge, "/rosapi/delete_param", name="/speed")
    assert "/speed" not in running.link.parameters


# over the Foxglove protocol


def test_foxglove_calls(running: Running) -> None:
    bridge = FoxgloveBridge(running.link, port=0)
    try:
        with connect(bridge.address, subprotocols=[Subprotocol(SUBPROTOCOLS[0])]) as connection:
            advertised: dict = {}
            while advertised.get("op") != "advertiseServices":
                data = connection.recv(60)
                advertised = json.loads(data) if isinstance(data, str) else advertised
            services = {s["name"]: s for s in advertised["services"]}
            wanted = services["/gazebo/get_model_state"]
            assert wanted["type"] == "gazebo_msgs/srv/GetModelState"
            kind = service_type("gazebo_msgs/GetModelState")
            request = encode_cdr(srv.GetModelStateRequest(running.simulation.robot.name), kind.request_name)
            connection.send(struct.pack("<BIII", 2, wanted["id"], 7, 3) + b"cdr" + request)
            data = b""
            while data[:1] != b"\3":
                received = connection.recv(60)
                data = received if isinstance(received, bytes) else b""
            assert struct.unpack_from("<BIII", data) == (3, wanted["id"], 7, 3)
            found = decode_cdr(data[16:], kind.response, kind.response_name)
            assert (found.success, found.header.frame_id) == (True, "world")
            connection.send(struct.pack("<BIII", 2, 10_000, 8, 3) + b"cdr")
            error = "no service with the ID 10000"
            while not (isinstance(received := connection.recv(60), str) and error in received):
                continue
    finally:
        bridge.close()


# over TCPROS


@pytest.fixture
def ros1(running: Running) -> Iterator[Ros1Bridge]:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    bridge = Ros1Bridge(running.link, master=f"http://127.0.0.1:{port}/")
    try:
        wait_until(lambda: running.link.services.keys() <= set(services_of(bridge)))
        yield bridge
    finally:
        bridge.close()


def services_of(bridge: Ros1Bridge) -> list[str]:
    return [name for name, _ in call(bridge.master, "getSystemState", "/test")[2]]


def caller(bridge: Ros1Bridge, service: str, **fields: str) -> socket.socket:
    uri = call(bridge.master, "lookupService", "/test", service)
    host, _, port = uri.removeprefix("rosrpc://").rpartition(":")
    connection = socket.create_connection((host, int(port)), 60)
    connection.sendall(encode_header({"callerid": "/test", "service": service, "md5sum": "*", **fields}))
    return connection


def test_a_persistent_caller_over_tcpros(running: Running, ros1: Ros1Bridge) -> None:
    kind = service_type("gazebo_msgs/GetModelState")
    with caller(ros1, "/gazebo/get_model_state", md5sum=kind.md5, persistent="1") as connection:
        header = read_header(connection)
        assert header["type"] == "gazebo_msgs/GetModelState"
        for model, works in ((running.simulation.robot.name, True), ("ghost", False)):
            body = encode_ros1(srv.GetModelStateRequest(model), kind.request_name)
            connection.sendall(struct.pack("<I", len(body)) + body)
            assert read_exactly(connection, 1) == b"\1"
            found = decode_ros1(read_block(connection), kind.response, kind.response_name)
            assert found.success is works
        connection.sendall(struct.pack("<I", 3) + b"???")
        assert read_exactly(connection, 1) == b"\0"
        assert b"3 bytes are not a gazebo_msgs" in read_block(connection)


def test_a_caller_with_another_md5_sum_is_refused(running: Running, ros1: Ros1Bridge) -> None:
    with caller(ros1, "/gazebo/delete_model", md5sum="0" * 32) as connection:
        assert "gazebo_msgs/DeleteModel" in read_header(connection)["error"]
    assert running.is_stepping()


def test_parameters_of_the_master_and_of_kbot_are_synchronized(running: Running, ros1: Ros1Bridge) -> None:
    call(ros1.master, "setParam", "/test", "/arm", {"gain": 2, "names": ["a", "b"]})
    wait_until(lambda: running.link.parameters.get("/arm/gain") == 2)
    assert running.link.parameters["/arm/names"] == ["a", "b"]
    running.link.set_parameter("/speed", 0.25)
    wait_until(lambda: "/speed" in call(ros1.master, "getParamNames", "/test"))
    assert call(ros1.master, "getParam", "/test", "/speed") == 0.25
