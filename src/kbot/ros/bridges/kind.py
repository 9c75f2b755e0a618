"""BridgeKind: what a bridge's folder gives the registry."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from kbot.ros.bridges.link import PeerLink


class Bridge(Protocol):
    """An open connection. Work that never waits runs on the loop of all bridges, the rest on threads."""

    def describe(self) -> str:
        """Where peers find it, in one sentence."""
        ...

    def close(self) -> None: ...


@dataclass(frozen=True, slots=True)
class BridgeKind:
    """A protocol that KBot can serve."""

    name: str
    """The option is `--name`."""
    title: str
    """The name in sentences."""
    help: str
    """The option's help."""
    open: Callable[[PeerLink, str | None], Bridge]
    """Open it at the address `host`, the loopback if None. Imports the protocol's library. Raises KbotError:
    the extra is not installed, or the address cannot be served."""
    why_no_peer: Callable[[], str] = lambda: ""
    """For `--bridges auto`: why no peer is reachable, or empty. Peers connect to a server at any time, so the
    default is empty."""
