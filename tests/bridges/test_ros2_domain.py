"""Which machines can reach a ROS 2 node, by its address and the variables of ROS 2."""

import re
from collections.abc import Mapping
from xml.etree import ElementTree

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from cyclonedds.domain import Domain, DomainParticipant

from kbot.ros.bridges import ros2
from kbot.ros.bridges.ros2 import domain
from kbot.ros.bridges.ros2.domain import discovery_range
from kbot.text import KbotError

RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
LOOPBACK, ADDRESS = ("127.0.0.1", "true"), ("10.0.0.7", "true")
NETWORK = ("autodetermine", None)


def interfaces(config: str) -> list[tuple[str, str | None]]:
    """The interfaces, with whether multicast is forced on."""
    found = ElementTree.fromstring(config).iterfind(".//NetworkInterface")
    return [(each.get("address") or "autodetermine", each.get("multicast")) for each in found]


@pytest.mark.parametrize(
    ("host", "environment", "expected", "words"),
    [
        (None, {}, [LOOPBACK], "on this machine only. Nodes that use Cyclone DDS find it only"),
        (None, {RANGE: "LOCALHOST"}, [LOOPBACK], "on this machine only"),
        (None, {RANGE: "SUBNET"}, [NETWORK, LOOPBACK], "in the network of this machine"),
        (None, {RANGE: "SUBNET", "ROS_LOCALHOST_ONLY": "1"}, [LOOPBACK], "on this machine only"),
        (None, {RANGE: "SUBNET", "ROS_LOCALHOST_ONLY": "0"}, [NETWORK, LOOPBACK], "in the network"),
        (None, {"ROS_STATIC_PEERS": "10.0.0.9"}, [LOOPBACK], "on this machine only"),
        ("10.0.0.7", {}, [ADDRESS, LOOPBACK], "at 10.0.0.7"),
        ("10.0.0.7", {RANGE: "OFF"}, [ADDRESS, LOOPBACK], "at 10.0.0.7"),
        ("127.0.0.1", {RANGE: "SUBNET"}, [LOOPBACK], "on this machine only"),
    ],
)
def test_only_this_machine_reaches_the_node_unless_the_user_asks_for_more(
    monkeypatch: pytest.MonkeyPatch,
    host: str | None,
    environment: Mapping[str, str],
    expected: list[tuple[str, str | None]],
    words: str,
) -> None:
    monkeypatch.setattr(domain, "_has_network", lambda: True)
    found = discovery_range(host, environment)
    assert interfaces(found.config) == expected
    assert found.words.startswith(words)
    assert "AllowMulticast" not in found.config  # Fast DDS finds peers by multicast only
    assert re.search(r"<IgnoreTypeInformation>1\.15<", found.config)


def test_without_a_network_only_this_machine_reaches_the_node(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(domain, "_has_network", lambda: False)
    assert interfaces(discovery_range(None, {RANGE: "SUBNET"}).config) == [LOOPBACK]


def test_the_own_configuration_of_cyclone_is_used_if_the_user_asks_for_it() -> None:
    general = "<General><Interfaces><NetworkInterface name='lo'/></Interfaces></General>"
    own = f"<CycloneDDS><Domain>{general}</Domain></CycloneDDS>"
    found = discovery_range(None, {RANGE: "SYSTEM_DEFAULT", "CYCLONEDDS_URI": own})
    assert found.config.startswith(own)
    assert found.words == "as CYCLONEDDS_URI configures it"
    assert Domain(231, found.config)  # Cyclone accepts two configurations
    assert DomainParticipant(231)


@pytest.mark.parametrize(
    ("value", "error"),
    [
        (
            "OFF",
            "ROS 2 nodes cannot find KBot if ROS_AUTOMATIC_DISCOVERY_RANGE is OFF. Set it to LOCALHOST or",
        ),
        ("localhost", "must be SUBNET, LOCALHOST, OFF or SYSTEM_DEFAULT, not 'localhost'"),
    ],
)
def test_error_for_a_range_in_which_nobody_finds_the_node(value: str, error: str) -> None:
    with pytest.raises(KbotError, match=re.escape(error)):
        discovery_range(None, {RANGE: value})


def test_bridges_auto_does_not_open_a_node_that_nobody_can_find(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "5")
    monkeypatch.delenv("RMW_IMPLEMENTATION", raising=False)
    monkeypatch.delenv(RANGE, raising=False)
    assert ros2.KIND.why_no_peer() == ""
    monkeypatch.setenv(RANGE, "OFF")
    assert ros2.KIND.why_no_peer() == "ROS_AUTOMATIC_DISCOVERY_RANGE is OFF"
