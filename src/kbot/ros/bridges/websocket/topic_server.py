"""Shared by the Foxglove and rosbridge servers: a server of a link's topics, and JSON messages of clients."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from kbot.ros.bridges.link import PeerLink
from kbot.ros.bridges.websocket.server import ClientSession, Data, WebSocketBridge, Wire
from kbot.text import KbotError
from kbot.text.json_text import parse_json

LOOPBACK = "127.0.0.1"
MOST_SUBSCRIPTIONS = 1000
"""Subscriptions of one client."""

Request = dict[str, Any]  # Any: JSON


class TopicServer:
    """Serves a link to clients, with a session for each."""

    def __init__(
        self,
        name: str,
        link: PeerLink,
        host: str | None,
        port: int,
        make_session: Callable[[Wire], ClientSession],
        *,
        subprotocols: Sequence[str] = (),
        origins: Sequence[str] = (),
        token: str = "",
    ) -> None:
        """Start the server; see `WebSocketBridge`.

        Raises:
            KbotError: no port is free, or the address is not this machine's.
        """
        self.link = link
        self._server = WebSocketBridge(
            name,
            host or LOOPBACK,
            port,
            make_session,
            subprotocols=subprotocols,
            origins=origins,
            token=token,
        )

    @property
    def address(self) -> str:
        return self._server.address

    def close(self) -> None:
        """Disconnect all clients."""
        self._server.close()


class JsonSession:
    """A client whose messages are JSON objects. The field `op` selects the operation."""

    operations: Mapping[str, Callable[[Any, Request], None]] = {}
    """The method for each `op`."""

    def receive(self, data: Data) -> None:
        """Process a message. Raises KbotError: it is not one of the protocol, or it fails."""
        try:
            request = parse_json(data)
        except ValueError:
            raise KbotError("the message is not JSON") from None
        if not isinstance(request, dict):
            raise KbotError("the message must be a JSON object with an 'op'")
        name = request.get("op")
        operation = self.operations.get(name) if isinstance(name, str) else None
        if operation is None:
            raise KbotError(f"there is no operation {str(name)[:50]!r}")
        try:
            operation(self, request)
        except (LookupError, TypeError, ValueError, AttributeError, ArithmeticError) as error:
            raise KbotError(f"{name}: {type(error).__name__} {error} in the request") from None
