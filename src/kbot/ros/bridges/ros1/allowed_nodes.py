"""Which ROS 1 nodes KBot may contact: those of this machine, or all with `--bridge-host`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from kbot.net.hosts import host_and_port_of_uri, is_served_at

_SHOWN = 80
"""Characters of a peer's text that are shown in a message to the user."""


@dataclass(frozen=True, slots=True)
class AllowedNodes:
    """Nodes of this machine, and of other machines if `other_machines` allows them.

    ROS 1 has no passwords: everybody who can reach a master can register a node at any address. Without this
    limit, KBot would connect to that address and accept its commands.
    """

    served_at: str
    """The name or address that this process serves ROS 1 at."""
    report: Callable[[str], None]
    other_machines: bool = False

    def refusal(self, host: str | None) -> str:
        """The reason why a host is not contacted, or empty. The reason is also reported to the user."""
        if self.other_machines or is_served_at(host, self.served_at):
            return ""
        named = (host or "(no host)")[:_SHOWN]
        reason = (
            f"{named!r} is not a name or address of this machine, and is not contacted. To allow nodes of "
            "other machines, start KBot with --bridge-host and this machine's address in their network"
        )
        self.report(f"ROS 1: {reason}")
        return reason

    def refusal_of_uri(self, uri: str) -> str:
        """Like `refusal`, for a node's URI such as `http://127.0.0.1:4711/`."""
        return self.refusal(host_and_port_of_uri(uri)[0])
