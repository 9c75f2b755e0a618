"""ROS 2 parameters over Zenoh, with zenoh-ros2-sdk as the peer."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from kbot.ros.bridges.link import PeerLink
from kbot.ros.bridges.zenoh.bridge import ZenohBridge
from kbot.ros.bridges.zenoh.names import topic_key, type_key
from kbot.ros.bridges.zenoh.parameters import parameter_services

from .conftest import Running
from .test_zenoh import free_port

PEER = Path(__file__).with_name("zenoh_parameter_peer.py")
HASHES = {
    "ListParameters": "RIHS01_3e6062bfbb27bfb8730d4cef2558221f51a11646d78e7bb30a1e83afac3aad9d",
    "GetParameters": "RIHS01_bf9803d5c74cf989a5de3e0c2e99444599a627c7ff75f97b8c05b01003675cbc",
    "GetParameterTypes": "RIHS01_da199c878688b3e530bdfe3ca8f74cb9fa0c303101e980a9e8f260e25e1c80ca",
    "DescribeParameters": "RIHS01_845b484d71eb0673dae682f2e3ba3c4851a65a3dcfb97bddd82c5b57e91e4cff",
    "SetParameters": "RIHS01_56eed9a67e169f9cb6c1f987bc88f868c14a8fc9f743a263bc734c154015d7e0",
    "SetParametersAtomically": "RIHS01_0e192ef259c07fc3c07a13191d27002222e65e00ccec653ca05e856f79285fcd",
}
"""The hashes that ROS 2 installs in share/rcl_interfaces, from Jazzy on."""

EVENT = "RIHS01_043e627780fcad87a22d225bc2a037361dba713fca6a6b9f4b869a5aa0393204"
ADD_TWO_INTS = "RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a"


def test_names_and_type_hashes_are_those_of_ros_2() -> None:
    offered = parameter_services(PeerLink(print), "/kbot")
    assert {served.type_name.rpartition("/")[2]: served.type_hash for served in offered} == HASHES
    assert {served.name for served in offered} == {
        f"/kbot/{name}"
        for name in (
            "list_parameters",
            "get_parameters",
            "get_parameter_types",
            "describe_parameters",
            "set_parameters",
            "set_parameters_atomically",
        )
    }


def test_keys_are_those_of_rmw_zenoh() -> None:
    """The example of the design document of rmw_zenoh."""
    kind = type_key("example_interfaces/srv/AddTwoInts", ADD_TWO_INTS)
    assert topic_key(2, "/add_two_ints", kind) == (
        f"2/add_two_ints/example_interfaces::srv::dds_::AddTwoInts_/{ADD_TWO_INTS}"
    )


def test_a_peer_lists_reads_and_sets_parameters(running: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    port = free_port()
    monkeypatch.setattr("kbot.ros.bridges.zenoh.bridge.ROUTER_PORT", port)
    running.link.set_parameters(
        {
            "/arm/gain": 1,
            "/texts": ["a", "b"],
            "/numbers": [1, 2.5],
            "/tree": {"a": 1},
            "/huge": 1 << 70,
            "/mixed": ["a", 1],
        }
    )
    bridge = ZenohBridge(running.link)
    try:
        done = subprocess.run(
            (sys.executable, str(PEER), str(port), json.dumps(HASHES | {"ParameterEvent": EVENT})),
            capture_output=True,
            text=True,
            timeout=180,
        )
    finally:
        bridge.close()
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout.splitlines()[-1])
    assert found["get"] == [True, "<robot/>", 1, None, ["a", "b"], [1.0, 2.5]]
    assert found["types"] == [1, 4, 2, 0, 9, 8]
    names = {"robot_description", "use_sim_time", "arm.gain", "texts", "numbers"}
    assert set(found["list"]) == names
    assert set(found["shallow"]) == names - {"arm.gain"}
    assert found["arm"] == ["arm.gain"]
    assert found["folders"] == ["arm"]
    assert found["describe"] == [["arm.gain", 2, True]]
    success = [True, ""]
    assert found["set"][:2] + found["set"][3:] == [success] * 3
    assert found["set"][2][0] is False
    assert "bytes: a value of type 5 is not supported" in found["set"][2][1]
    assert found["invalid together"] == [False, "the parameter has no name"]
    assert found["set together"] == success
    assert set(found["afterwards"]) == names - {"numbers"} | {"new.one", "first", "second"}
    now = running.link.parameters
    assert [now.get(f"/{name}") for name in ("arm/gain", "new/one", "first", "second", "numbers")] == [
        2.5,
        [1, -2],
        True,
        ["b"],
        None,
    ]
    assert {f"/kbot/{name}" for name in ("list_parameters", "set_parameters_atomically")} <= set(
        found["services"]
    )
    assert "/gazebo/pause_physics" in found["services"]
    assert found["info"] == ["rcl_interfaces/srv/ListParameters"]
    assert found["new"] == {"new.one": [1, -2], "first": True, "second": ["b"]}
    assert found["changed"] == {"arm.gain": 2.5}
    assert found["deleted"] == {"numbers": [1.0, 2.5]}
    assert found["nodes"] == ["/kbot"]
    assert running.reported == []
