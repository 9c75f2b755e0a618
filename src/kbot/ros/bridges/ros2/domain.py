"""The DDS domain of a node: its number, and which machines can reach it."""

from __future__ import annotations

import socket
from collections.abc import Mapping
from dataclasses import dataclass
from xml.sax.saxutils import quoteattr

import psutil

from kbot.text import KbotError

HIGHEST_DOMAIN = 232
"""The highest domain of DDS: the UDP ports of domain 233 are above 65535."""
DOMAIN, RANGE, LOCALHOST_ONLY = "ROS_DOMAIN_ID", "ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_LOCALHOST_ONLY"
"""The variables with which ROS 2 chooses a domain and its peers. rcl ignores the range if the deprecated
ROS_LOCALHOST_ONLY is 1."""
RANGES = "SUBNET", "LOCALHOST", "OFF", "SYSTEM_DEFAULT"

LOOPBACK_HOSTS = "127.0.0.1", "localhost"
_LOOPBACK = '<NetworkInterface address="127.0.0.1" multicast="true"/>'
"""Linux does not set the flag MULTICAST on the loopback interface, but delivers multicast there. Fast DDS,
the default of ROS 2, searches for peers by multicast, on all interfaces."""
_COMPATIBILITY = "<Compatibility><IgnoreTypeInformation>1.15</IgnoreTypeInformation></Compatibility>"
"""Cyclone rejects most type objects of Fast DDS 3 (vendor 1.15, in ROS 2 Kilted) as invalid, and then does
not match their topics. With this, it compares the names of types. It needs cyclonedds 11.0.1."""
CYCLONE_HINT = (
    f"Nodes that use Cyclone DDS find it only if you start them with {RANGE}=LOCALHOST "
    f"(Humble: {LOCALHOST_ONLY}=1), or KBot with --bridge-host ADDRESS"
)


@dataclass(frozen=True, slots=True)
class DiscoveryRange:
    """Which machines can reach a domain."""

    words: str
    """For the user, after "node NAME in domain NUMBER"."""
    config: str
    """Cyclone's configuration."""


def domain_number(environment: Mapping[str, str]) -> int:
    """ROS_DOMAIN_ID, else 0. Raises KbotError: it is invalid."""
    text = environment.get(DOMAIN) or "0"
    if not text.isdecimal() or int(text) > HIGHEST_DOMAIN:
        raise KbotError(f"{DOMAIN} must be a whole number from 0 to {HIGHEST_DOMAIN}, not '{text}'")
    return int(text)


def discovery_range(host: str | None, environment: Mapping[str, str]) -> DiscoveryRange:
    """Which machines can reach a node: those in the network of the address `host`. Without it, only this
    machine, unless ROS_AUTOMATIC_DISCOVERY_RANGE asks for more.

    Raises:
        KbotError: the variable has an unknown value, or switches discovery off.
    """
    if host in LOOPBACK_HOSTS:
        return DiscoveryRange("on this machine only", _config(_LOOPBACK))
    if host is not None:
        address = f'<NetworkInterface address={quoteattr(host)} multicast="true"/>'
        return DiscoveryRange(f"at {host}", _config(address + _LOOPBACK))
    wanted = environment.get(RANGE) or "LOCALHOST"
    if environment.get(LOCALHOST_ONLY) == "1":
        wanted = "LOCALHOST"
    if wanted not in RANGES:
        raise KbotError(f"{RANGE} must be {', '.join(RANGES[:-1])} or {RANGES[-1]}, not '{wanted}'")
    if wanted == "OFF":
        raise KbotError(f"ROS 2 nodes cannot find KBot if {RANGE} is OFF. Set it to LOCALHOST or SUBNET")
    if wanted == "SYSTEM_DEFAULT":
        own = environment.get("CYCLONEDDS_URI", "")
        return DiscoveryRange("as CYCLONEDDS_URI configures it", f"{own},{_domain_config(_COMPATIBILITY)}")
    if wanted == "SUBNET" and _has_network():
        network = '<NetworkInterface autodetermine="true"/>'
        return DiscoveryRange("in the network of this machine", _config(network + _LOOPBACK))
    return DiscoveryRange(f"on this machine only. {CYCLONE_HINT}", _config(_LOOPBACK))


def _has_network() -> bool:
    """Whether an interface other than loopback is up. Cyclone refuses to select the loopback twice."""
    up = {name for name, state in psutil.net_if_stats().items() if state.isup}
    return any(
        address.family == socket.AF_INET and not address.address.startswith("127.")
        for name, addresses in psutil.net_if_addrs().items()
        if name in up
        for address in addresses
    )


def _config(interfaces: str) -> str:
    """Cyclone's configuration with these interfaces.

    Some peers, such as those limited to this machine, find others by trying the ports of participants 0, 1,
    2 and so on, instead of by multicast. So KBot uses such a port, and tries those ports on this machine.
    """
    return _domain_config(
        f"<General><Interfaces>{interfaces}</Interfaces></General>{_COMPATIBILITY}"
        "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
        "<MaxAutoParticipantIndex>120</MaxAutoParticipantIndex>"
        '<Peers><Peer address="127.0.0.1"/></Peers></Discovery>'
    )


def _domain_config(contents: str) -> str:
    return f"<CycloneDDS><Domain>{contents}</Domain></CycloneDDS>"
