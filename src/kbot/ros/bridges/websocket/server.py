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
"""Bytes of the largest message of a client."""
QUEUE = 512
"""Messages that wait for a slow client. If there are more, the oldest are dropped."""
MOST_CLIENTS = 64
BATCH_BYTES = 1 << 16
"""Bytes after which no further message is added to a write. A larger message is written alone."""
TRIES = 20
"""Ports that are tried, from the default port on."""
CLOSING_SECONDS = 2.0
"""Seconds that `close` waits for clients."""

Data = str | bytes


class ClientSession(Protocol):
    """The state of one client. Its methods are called on the server's loop."""

    def receive(self, data: Data) -> None:
        """Process a message. Raises KbotError: it cannot be processed. The server sends the error."""
        ...

    def send_error(self, text: str) -> None:
        """Report an error to the client."""
        ...

    def close(self) -> None:
        """The client has disconnected."""
        ...


class Wire:
    """Sends messages to one client. If the client is slow, messages wait, and the oldest are dropped."""

    def __init__(self, connection: ServerConnection) -> None:
        self._connection = connection
        self._is_due = False
        self._waiting: deque[Data] = deque(maxlen=QUEUE)
        self._kept: deque[Data] = deque()
        self._wake = asyncio.Event()

    def put(self, data: Data, *, keep: bool = False) -> None:
        """Send a message soon. With `keep`, it is never dropped."""
        (self._kept if keep else self._waiting).append(data)
        if not self._is_due:
            self._is_due = True
            loop().call_soon(self.send)

    def add(self, data: Data) -> None:
        """Queue a message for the next `send`."""
        self._waiting.append(data)

    def send(self) -> None:
        """Send the queued messages, as far as the client accepts them without waiting."""
        self._is_due = False
        if not (self._kept or self._waiting):
            return
        connection = self._connection
        if connection.protocol.state is State.OPEN and not connection.transport.get_write_buffer_size():
            self._write()
        if self._kept or self._waiting:
            self._wake.set()

    async def pump(self) -> None:
        """Send what `send` left, until the client disconnects. Raises ConnectionClosed."""
        while True:
            await self._wake.wait()
            self._wake.clear()
            while self._kept or self._waiting:
                async with self._connection.send_context():
                    self._write()

    def _write(self) -> None:
        """Write many small messages in one system call: the call costs more than they do."""
        connection, size = self._connection, 0
        while (self._kept or self._waiting) and size < BATCH_BYTES:
            data = self._kept.popleft() if self._kept else self._waiting.popleft()
            if isinstance(data, str):
                connection.protocol.send_text(data.encode())
            else:
                connection.protocol.send_binary(data)
            size += len(data)
        connection.transport.write(b"".join(connection.protocol.data_to_send()))


class WebSocketBridge:
    """A WebSocket server with a `make_session(wire)` for each accepted client."""

    def __init__(
        self,
        name: str,
        host: str,
        port: int,
        make_session: Callable[[Wire], ClientSession],
        *,
        subprotocols: Sequence[str] = (),
        origins: Sequence[str] = (),
        token: str = "",
    ) -> None:
        """Start the server.

        Args:
            name: the protocol, for errors.
            host: the address to serve at.
            port: the port. If it is in use, the next free one; if it is 0, any free port.
            make_session: creates the session of a client.
            subprotocols: the WebSocket subprotocols.
            origins: web pages that may connect, besides those of this machine.
            token: the path that clients must use; any if it is empty.

        Raises:
            KbotError: no port is free, or the address is not one of this machine.
        """
        self._name, self._host, self._make_session = name, host, make_session
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
        """Disconnect all clients."""
        wait_for(self._shut_down())

    async def _listen(self, port: int) -> int:
        for candidate in range(port, port + TRIES) if port else (0,):
            try:
                self._server = await serve(
                    self._serve,
                    self._host,
                    candidate,
                    subprotocols=self._subprotocols or None,
                    process_request=self._refusal,
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

    async def _shut_down(self) -> None:
        if self._server is not None:
            self._server.close()
            with contextlib.suppress(TimeoutError):  # a client may keep a connection open without a request
                async with asyncio.timeout(CLOSING_SECONDS):
                    await self._server.wait_closed()

    def _refusal(self, connection: ServerConnection, request: Request) -> Response | None:
        """The response to a request of a foreign web page or for a foreign host name; None to accept it."""
        if self._clients >= MOST_CLIENTS:
            return connection.respond(HTTPStatus.SERVICE_UNAVAILABLE, "too many clients\n")
        for origin in request.headers.get_all("Origin"):
            if origin not in self._origins and not is_loopback(host_and_port_of_uri(origin)[0]):
                return connection.respond(HTTPStatus.FORBIDDEN, f"web pages of {origin} may not connect\n")
        if not self._accepts_host(only_host(request.headers.get_all("Host"))):
            return connection.respond(
                HTTPStatus.FORBIDDEN, "the Host header is not a name or address of this machine\n"
            )
        if self._token and not secrets.compare_digest(request.path.encode(), f"/{self._token}".encode()):
            return connection.respond(HTTPStatus.FORBIDDEN, "the token in the address is wrong\n")
        return None

    def _accepts_host(self, header: str | None) -> bool:
        # Behind address translation, such as in a container, other machines use an address that is not one of
        # this machine. DNS rebinding needs a name, so any address is safe.
        by_address = header is not None and is_address(host_and_port(header)[0])
        return accepts_host(header, self._host) or (by_address and not is_loopback(self._host))

    async def _serve(self, connection: ServerConnection) -> None:
        wire = Wire(connection)
        session = self._make_session(wire)
        pump = asyncio.create_task(wire.pump())
        self._clients += 1
        try:
            async for data in connection:
                try:
                    session.receive(data)
                except KbotError as error:
                    session.send_error(str(error))
                except Exception as error:  # noqa: BLE001 - one message must not end the connection
                    session.send_error(FAULTS.fault(f"{self._name}: a message", error))
        except ConnectionClosed:
            pass  # the client disconnected without a closing handshake
        finally:
            self._clients -= 1
            session.close()
            pump.cancel()
            with contextlib.suppress(asyncio.CancelledError, ConnectionClosed):
                await pump
