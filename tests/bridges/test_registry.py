"""Which bridges `--bridges auto` opens."""

import socket

import pytest

from kbot.ros.bridges import zenoh
from kbot.ros.bridges.registry import bridges_with_peers
from kbot.ros.bridges.ros1.allowed_nodes import AllowedNodes
from kbot.ros.bridges.ros1.master import Master


@pytest.fixture(autouse=True)
def no_peers(monkeypatch: pytest.MonkeyPatch) -> None:
    """No peer runs on this machine."""
    for name in ("ROS_VERSION", "ROS_DOMAIN_ID", "RMW_IMPLEMENTATION", "ZENOH_CONNECT"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("PATH", "")
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    monkeypatch.setenv("ROS_MASTER_URI", f"http://127.0.0.1:{port}/")
    monkeypatch.setattr(zenoh, "ROUTER_PORT", port)


def test_without_peers_only_the_servers_open() -> None:
    found, missing = bridges_with_peers()
    assert found == ("foxglove", "rosbridge")
    assert [why.partition(":")[0] for why in missing] == ["ros1", "ros2", "zenoh"]


def test_all_bridges_open_if_all_peers_run(monkeypatch: pytest.MonkeyPatch) -> None:
    master = Master("127.0.0.1", 0, AllowedNodes("127.0.0.1", print))
    monkeypatch.setenv("ROS_MASTER_URI", master.uri)
    monkeypatch.setenv("ROS_DOMAIN_ID", "5")
    with socket.create_server(("127.0.0.1", 0)) as router:
        monkeypatch.setattr(zenoh, "ROUTER_PORT", router.getsockname()[1])
        try:
            assert bridges_with_peers() == (("ros1", "ros2", "zenoh", "foxglove", "rosbridge"), ())
        finally:
            master.close()


def test_dds_is_not_used_if_ros_2_uses_zenoh(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "5")
    monkeypatch.setenv("RMW_IMPLEMENTATION", "rmw_zenoh_cpp")
    assert "ros2" not in bridges_with_peers()[0]
