"""What the Foxglove and rosbridge servers share: topics of the link, and JSON conversations with clients."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from kbot.ros.bridges.link import PeerLink
from kbot.ros.bridges.websocket.server import Data, Talk, WebSocketBridge, Wire
from kbot.text import KbotError
from kbot.text.json_text import parse_json

LOOPBACK = "127.0.0.1"
MOST_SUBSCRIPTIONS = 1000
"""Of one client."""

Request = dict[str, Any]  # Any: JSON


class TopicServer:
    """Serves a link to clients, each by a talk of its own."""

    def __init__(
        self,
        name: str,
        link: PeerLink,
        host: str | None,
        port: int,
        make_talk: Callable[[Wire], Talk],
        *,
        subprotocols: Sequence[str] = (),
        origins: Sequence[str] = (),
        token: str = "",
    ) -> None:
        """As for `WebSocketBridge`.

        Raises:
            KbotError: no port is free, or the address is not this machine's.
        """
        self.link = link
        self._server = WebSocketBridge(
            name, host or LOOPBACK, port, make_talk, subprotocols=subprotocols, origins=origins, token=token
        )

    @property
    def address(self) -> str:
        return self._server.address

    def close(self) -> None:
        """Take leave of all clients."""
        self._server.close()


class JsonTalk:
    """One client's conversation of JSON objects, each with an `op` that says what is wanted."""

    operations: Mapping[str, Callable[[Any, Request], None]] = {}
    """The methods by the names of what they do."""

    def hear(self, data: Data) -> None:
        """Raises KbotError: it is not of the protocol, or cannot be done."""
        try:
            request = parse_json(data)
        except ValueError:
            raise KbotError("that is no JSON") from None
        if not isinstance(request, dict):
            raise KbotError("a request is an object with an 'op'")
        name = request.get("op")
        operation = self.operations.get(name) if isinstance(name, str) else None
        if operation is None:
            raise KbotError(f"there is no operation {str(name)[:50]!r} here")
        try:
            operation(self, request)
        except (LookupError, TypeError, ValueError, AttributeError, ArithmeticError) as error:
            raise KbotError(f"{name}: {type(error).__name__} {error} in the request") from None
