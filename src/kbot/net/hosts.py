"""Host names and addresses, and which of them belong to this machine."""

from __future__ import annotations

import ipaddress
import re
import socket
from collections.abc import Sequence
from functools import cache

# User information before the host is refused, because parsers of URIs disagree about where it ends.
_HOST_AND_PORT = re.compile(r"(?:\[([0-9A-Fa-f:.]+)\]|([\w.-]+))(?::([0-9]{1,5}))?", re.ASCII)


def host_and_port(text: str) -> tuple[str | None, int | None]:
    """Split `host:port` of a Host header or a URI. The host is None if the text is malformed, and the port is
    None if none is given."""
    match = _HOST_AND_PORT.fullmatch(text)
    if match is None:
        return None, None
    address, name, port = match.groups()
    return (address or name).lower(), int(port) if port else None


def host_and_port_of_uri(uri: str) -> tuple[str | None, int | None]:
    """The same for `scheme://host:port/path`."""
    return host_and_port(re.split("[/?#]", uri.partition("://")[2], maxsplit=1)[0])


def is_loopback(host: str | None) -> bool:
    """Whether a name or address is a loopback one, which can only be this machine's. None is not."""
    if host is None:
        return False
    if host.lower() == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def is_address(host: str | None) -> bool:
    """Whether a host is an IP address, and not a name; None is neither."""
    if host is None:
        return False
    try:
        ipaddress.ip_address(host)
    except ValueError:
        return False
    return True


def is_this_machine(host: str | None) -> bool:
    """Whether a host is loopback, or a name or address of this machine.

    Names are compared and not resolved, because the owner of a name decides what it resolves to.
    """
    if host is None:
        return False
    if is_loopback(host):
        return True
    return _is_own_address(host) if is_address(host) else _is_own_name(host)


def is_served_at(host: str | None, served_at: str) -> bool:
    """Whether a host is this machine, or the name that a server here was started with."""
    return host is not None and (host.lower() == served_at.lower() or is_this_machine(host))


def only_host(headers: Sequence[str]) -> str | None:
    """The Host header of a request, if it has exactly one. Servers disagree about which of several counts."""
    return headers[0] if len(headers) == 1 else None


def accepts_host(header: str | None, served_at: str) -> bool:
    """Whether a request's Host header names this machine, with any port.

    With DNS rebinding, the host name of a web page resolves to this machine. The browser then treats requests
    to this machine as requests to the page's own origin, and only the Host header shows the page's name."""
    return header is not None and is_served_at(host_and_port(header)[0], served_at)


def _is_own_address(text: str) -> bool:
    """Whether a socket can be bound to an address, which works only for addresses of this machine."""
    address = ipaddress.ip_address(text)
    if address.is_unspecified or address.is_multicast:
        return False  # a socket can be bound to these on every machine
    family = socket.AF_INET if address.version == 4 else socket.AF_INET6
    try:
        with socket.socket(family, socket.SOCK_DGRAM) as probe:
            probe.bind((text, 0))
    except OSError:
        return False
    return True


def _is_own_name(name: str) -> bool:
    name = name.lower()
    own = socket.gethostname().lower()
    short = own.partition(".")[0]
    # Avahi and Bonjour publish the short name in the domain "local", and ROS_MASTER_URI often has it.
    if name in (own, short, f"{short}.local"):
        return True
    # The resolver may take seconds, so only names that begin with this machine's name are resolved.
    return name.partition(".")[0] == short and name == _full_name(own)


@cache
def _full_name(name: str) -> str | None:
    """This machine's name with its domain, as `hostname -f` prints it."""
    try:
        return socket.getaddrinfo(name, None, flags=socket.AI_CANONNAME)[0][3].lower()
    except (OSError, UnicodeError):
        return None
