"""A WebSocket server on the loop of the bridges. A slow client does not delay others."""

from __future__ import annotations

import asyncio
import contextlib
import secrets
from collections import deque
from collections.abc import Callable, Sequence
from http import HTTPStatus
from typing import Protocol

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response
from websockets.protocol import State
from websockets.typing import Subprotocol

from kbot.net.hosts import (
    accepts_host,
    host_and_port,
    host_and_port_of_uri,
    is_address,
    is_loopback,
    only_host,
)
from kbot.net.socket_log import socket_logger
from kbot.ros.bridges.loop import FAULTS, loop, wait_for
from kbot.text import KbotError

LARGEST_MESSAGE = 1 << 22
QUEUE = 512
"""Messages that wait for a slow client; of more the newest are kept."""
MOST_CLIENTS = 64
AT_ONCE = 1 << 16
"""Bytes that are given to the system at once; a larger message goes alone."""
TRIES = 20
"""Ports that are tried from the usual one on."""
CLOSING_SECONDS = 2.0
"""How long clients have to take leave."""

Data = str | bytes


class Talk(Protocol):
    """One client's conversation, on the server's loop."""

    def hear(self, data: Data) -> None:
        """Take a message. Raises KbotError: it cannot be done; the client is told."""
        ...

    def fault(self, text: str) -> None:
        """Tell the client what it did wrong."""
        ...

    def close(self) -> None:
        """The client is gone."""
        ...


class Wire:
    """Where one client's messages go out, at once while it takes them; a queue that forgets the oldest rather
    than wait."""

    def __init__(self, connection: ServerConnection) -> None:
        self._connection = connection
        self._is_due = False
        self._waiting: deque[Data] = deque(maxlen=QUEUE)
        self._kept: deque[Data] = deque()
        self._wake = asyncio.Event()

    def put(self, data: Data, *, keep: bool = False) -> None:
        """Send it when the client takes it; what is to be kept is sent even to a slow one."""
        (self._kept if keep else self._waiting).append(data)
        if not self._is_due:
            self._is_due = True
            loop().call_soon(self.send)

    def add(self, data: Data) -> None:
        """Send it with the next `send`."""
        self._waiting.append(data)

    def send(self) -> None:
        """Send what waits, as far as the client takes it at once."""
        self._is_due = False
        if not (self._kept or self._waiting):
            return
        connection = self._connection
        if connection.protocol.state is State.OPEN and not connection.transport.get_write_buffer_size():
            self._write()
        if self._kept or self._waiting:
            self._wake.set()

    async def pump(self) -> None:
        """Send what the client did not take at once, until it goes. Raises ConnectionClosed."""
        while True:
            await self._wake.wait()
            self._wake.clear()
            while self._kept or self._waiting:
                async with self._connection.send_context():
                    self._write()

    def _write(self) -> None:
        """Many small messages in one call of the system, which costs more than they do."""
        connection, size = self._connection, 0
        while (self._kept or self._waiting) and size < AT_ONCE:
            data = self._kept.popleft() if self._kept else self._waiting.popleft()
            if isinstance(data, str):
                connection.protocol.send_text(data.encode())
            else:
                connection.protocol.send_binary(data)
            size += len(data)
        connection.transport.write(b"".join(connection.protocol.data_to_send()))


class WebSocketBridge:
    """Serves `make_talk(wire)` to each client that may come in."""

    def __init__(
        self,
        name: str,
        host: str,
        port: int,
        make_talk: Callable[[Wire], Talk],
        *,
        subprotocols: Sequence[str] = (),
        origins: Sequence[str] = (),
        token: str = "",
    ) -> None:
        """`port` is where it is looked for; if that is taken one of the next is. `origins` are pages of the
        web that may connect; those of this machine always may. `token` is the path that clients have to
        know, any where it is empty.

        Raises:
            KbotError: no port is free, or the address is not this machine's.
        """
        self._name, self._host, self._make_talk = name, host, make_talk
        self._subprotocols = [Subprotocol(item) for item in subprotocols]
        self._origins, self._token = frozenset(origins), token
        self._clients = 0
        self._server: Server | None = None
        try:
            self.port = wait_for(self._listen(port))
        except OSError as error:
            raise KbotError(f"{name} cannot be served at {host}:{port}: {error.strerror or error}") from None

    @property
    def address(self) -> str:
        host = f"[{self._host}]" if ":" in self._host else self._host
        return f"ws://{host}:{self.port}" + (f"/{self._token}" if self._token else "")

    def close(self) -> None:
        """Take leave of all clients."""
        wait_for(self._shut())

    async def _listen(self, port: int) -> int:
        for candidate in range(port, port + TRIES) if port else (0,):
            try:
                self._server = await serve(
                    self._serve,
                    self._host,
                    candidate,
                    subprotocols=self._subprotocols or None,
                    process_request=self._admit,
                    max_size=LARGEST_MESSAGE,
                    max_queue=16,
                    open_timeout=5,
                    close_timeout=1,
                    compression=None,
                    server_header=None,
                    logger=socket_logger(FAULTS),
                )
            except OSError:
                if candidate in (0, port + TRIES - 1):
                    raise
                continue
            return int(next(iter(self._server.sockets)).getsockname()[1])
        raise OSError("no port is free")

    async def _shut(self) -> None:
        if self._server is not None:
            self._server.close()
            with contextlib.suppress(TimeoutError):  # a client may hold one open that asks for nothing
                async with asyncio.timeout(CLOSING_SECONDS):
                    await self._server.wait_closed()

    def _admit(self, connection: ServerConnection, request: Request) -> Response | None:
        """Refuse foreign web pages, and names that are not this machine's."""
        if self._clients >= MOST_CLIENTS:
            return connection.respond(HTTPStatus.SERVICE_UNAVAILABLE, "too many clients\n")
        for origin in request.headers.get_all("Origin"):
            if origin not in self._origins and not is_loopback(host_and_port_of_uri(origin)[0]):
                return connection.respond(HTTPStatus.FORBIDDEN, f"pages of {origin} may not connect\n")
        if not self._accepts_host(only_host(request.headers.get_all("Host"))):
            return connection.respond(
                HTTPStatus.FORBIDDEN, "the Host header is not a name or address of this machine\n"
            )
        if self._token and not secrets.compare_digest(request.path.encode(), f"/{self._token}".encode()):
            return connection.respond(HTTPStatus.FORBIDDEN, "this is for those who know the token\n")
        return None

    def _accepts_host(self, header: str | None) -> bool:
        # Behind address translation, as in a container, other machines use an address that is not this one's.
        # A page's name can be rebound to this machine, but an address cannot.
        by_address = header is not None and is_address(host_and_port(header)[0])
        return accepts_host(header, self._host) or (by_address and not is_loopback(self._host))

    async def _serve(self, connection: ServerConnection) -> None:
        wire = Wire(connection)
        talk = self._make_talk(wire)
        pump = asyncio.create_task(wire.pump())
        self._clients += 1
        try:
            async for data in connection:
                try:
                    talk.hear(data)
                except KbotError as error:
                    talk.fault(str(error))
                except Exception as error:  # noqa: BLE001 - one message that fails ends no connection
                    talk.fault(FAULTS.fault(f"{self._name}: a message", error))
        except ConnectionClosed:
            pass  # as clients do
        finally:
            self._clients -= 1
            talk.close()
            pump.cancel()
            with contextlib.suppress(asyncio.CancelledError, ConnectionClosed):
                await pump
