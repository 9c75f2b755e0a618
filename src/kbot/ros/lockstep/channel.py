"""The channel between a simulation and a program: JSON objects, one a line, over a loopback connection."""

from __future__ import annotations

import json
import socket
import time
from typing import Any

from kbot.text.json_text import parse_json

VARIABLE = "KBOT_LOCKSTEP"
"""The environment variable with the address of the channel, as `HOST:PORT/TOKEN`."""
CONNECT_SECONDS = 10.0
LARGEST = 1 << 24
"""Bytes of the longest line. A line has about 50 bytes for each message of a tick."""
_READ_BYTES = 1 << 16

Message = dict[str, Any]  # Any: JSON
"""A message. Its field `op` selects what it is:

open     node: the `token` of its address
hello    node: its `name`, `identity` and `transport`
welcome  simulation: the time `now` in ns, and the `simulation`'s identity, unless there is an `error`
connect  node: it subscribes to or publishes on (`publishes`) a `topic` of a `type`, perhaps `latched`
connecting  simulation: the topic is accepted, and will be connected
connected  simulation: it is connected to the `peers`, unless there is an `error`
check    simulation: wait until the `topics` are connected to these peers
checked  node: they are
tick     simulation: `now` in ns, and the `messages` as [ns, topic, source] in order
done     node: the `messages` that it has published since the last one, as topics in order. The first `done`
         reports that the node is ready
bye      node: `done`, and the node closes
end      simulation: the run is over, or the answer to `bye`
"""


class ChannelClosed(Exception):
    """The other side has closed the channel, or does not follow the protocol."""


class Channel:
    """One side of the channel."""

    def __init__(self, connection: socket.socket) -> None:
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._connection = connection
        self._read = bytearray()

    def send(self, op: str, **fields: object) -> None:
        """Raises ChannelClosed."""
        line = json.dumps({"op": op, **fields}).encode() + b"\n"
        try:
            self._connection.settimeout(None)
            self._connection.sendall(line)
        except OSError:
            raise ChannelClosed from None

    def receive(self, seconds: float | None = None) -> Message | None:
        """The next message, or None if there is none within some seconds. Raises ChannelClosed."""
        end = None if seconds is None else time.monotonic() + seconds
        while (length := self._read.find(b"\n")) < 0:
            left = None if end is None else end - time.monotonic()
            if left is not None and left <= 0.0:
                return None
            try:
                self._connection.settimeout(left)
                part = self._connection.recv(_READ_BYTES)
            except TimeoutError:
                return None
            except OSError:
                part = b""
            if not part or len(self._read) > LARGEST:
                raise ChannelClosed
            self._read += part
        try:
            message = parse_json(bytes(self._read[:length]))
        except ValueError:
            raise ChannelClosed from None
        if not (isinstance(message, dict) and isinstance(message.get("op"), str)):
            raise ChannelClosed
        del self._read[: length + 1]
        return message

    def close(self) -> None:
        self._connection.close()


def connect(address: str) -> tuple[Channel, str]:
    """Connect to an address of `VARIABLE`. Returns the channel and the token. Raises OSError."""
    place, _, token = address.partition("/")
    host, _, port = place.rpartition(":")
    return Channel(socket.create_connection((host, int(port)), CONNECT_SECONDS)), token
