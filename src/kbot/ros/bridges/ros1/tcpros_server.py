"""Accepts TCPROS connections of other ROS 1 nodes, to topics and services."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import Mapping

from kbot.ros.bridges.link import PeerLink
from kbot.ros.bridges.loop import wait_for
from kbot.ros.bridges.ros1.publisher import Outgoing
from kbot.ros.bridges.ros1.service_server import serve_service
from kbot.ros.bridges.ros1.tcpros import HANDSHAKE_SECONDS, ProtocolError, encode_header, receive_header

MOST = 200
"""Who is there at once; more are turned away."""


class TcprosServer:
    """Served on the loop of the bridges."""

    def __init__(self, host: str, link: PeerLink, node: str, topics: Mapping[str, Outgoing]) -> None:
        """`topics` may change while it is open. Raises OSError: the address is not this machine's."""
        self._link, self._node, self._topics = link, node, topics
        self._writers: set[asyncio.StreamWriter] = set()
        self._server = wait_for(asyncio.start_server(self._serve, host, 0, backlog=64))
        self.port = int(self._server.sockets[0].getsockname()[1])

    def close(self) -> None:
        """Nobody comes in any more, and who is there goes."""
        wait_for(self._close())

    async def _close(self) -> None:
        self._server.close()
        for writer in self._writers:
            writer.transport.abort()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if len(self._writers) >= MOST:
            writer.transport.abort()
            return
        self._writers.add(writer)
        try:
            await self._talk(reader, writer)
        except (OSError, EOFError, TimeoutError):
            pass  # it went; others are not concerned
        finally:
            self._writers.remove(writer)
            writer.close()

    async def _talk(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        connection: socket.socket = writer.get_extra_info("socket")
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        try:
            async with asyncio.timeout(HANDSHAKE_SECONDS):
                header = await receive_header(reader)
            if "service" in header:
                await serve_service(self._link, self._node, reader, writer, header)
                return
            outgoing = self._topics.get(header.get("topic", ""))
            if outgoing is None:
                raise ProtocolError(f"there is no topic '{header.get('topic', '')}' here")
            await outgoing.serve(reader, writer, header)
        except ProtocolError as error:
            self._link.tell(f"ROS 1: a peer was turned away: {error}")
            writer.write(encode_header({"error": str(error)}))
            with contextlib.suppress(OSError):
                await writer.drain()
