"""BridgeKind: how the folder of a bridge describes it to the registry."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from kbot.ros.bridges.link import PeerLink


class Bridge(Protocol):
    """An open bridge. Work that never blocks runs on the loop of all bridges, other work on threads."""

    def describe(self) -> str:
        """Where peers find the bridge, in one sentence for the user."""
        ...

    def close(self) -> None: ...


@dataclass(frozen=True, slots=True)
class BridgeKind:
    """A protocol that KBot can serve."""

    name: str
    """The option's name without `--`."""
    title: str
    """The name for sentences."""
    help: str
    """The option's help."""
    open: Callable[[PeerLink, str | None], Bridge]
    """Opens the bridge at the address `host`, loopback if None, and imports the protocol's library. Raises
    KbotError: the extra is not installed, or the address cannot be served."""
    why_no_peer: Callable[[], str] = lambda: ""
    """For `--bridges auto`: the reason why no peer is reachable, or empty. The default is for servers: peers
    may connect to them at any time."""
