"""Accepts TCPROS connections of other ROS 1 nodes to topics and services."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import Mapping

from kbot.ros.bridges.link import PeerLink
from kbot.ros.bridges.loop import wait_for
from kbot.ros.bridges.ros1.publisher import PublishedTopic
from kbot.ros.bridges.ros1.service_server import serve_service
from kbot.ros.bridges.ros1.tcpros import HANDSHAKE_SECONDS, ProtocolError, encode_header, receive_header

MOST_CONNECTIONS = 200
"""Connections at the same time. More are refused."""


class TcprosServer:
    """A server on the loop of the bridges."""

    def __init__(self, host: str, link: PeerLink, node: str, topics: Mapping[str, PublishedTopic]) -> None:
        """`topics` may change later. Raises OSError: the address is not one of this machine."""
        self._link, self._node, self._topics = link, node, topics
        self._writers: set[asyncio.StreamWriter] = set()
        self._server = wait_for(asyncio.start_server(self._serve, host, 0, backlog=64))
        self.port = int(self._server.sockets[0].getsockname()[1])

    def close(self) -> None:
        """Stop the server and disconnect all peers."""
        wait_for(self._close())

    async def _close(self) -> None:
        self._server.close()
        for writer in self._writers:
            writer.transport.abort()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if len(self._writers) >= MOST_CONNECTIONS:
            writer.transport.abort()
            return
        self._writers.add(writer)
        try:
            await self._handle(reader, writer)
        except (OSError, EOFError, TimeoutError):
            pass  # the peer has disconnected, or does not answer
        finally:
            self._writers.remove(writer)
            writer.close()

    async def _handle(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        connection: socket.socket = writer.get_extra_info("socket")
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        try:
            async with asyncio.timeout(HANDSHAKE_SECONDS):
                header = await receive_header(reader)
            if "service" in header:
                await serve_service(self._link, self._node, reader, writer, header)
                return
            topic = self._topics.get(header.get("topic", ""))
            if topic is None:
                raise ProtocolError(f"this node does not publish '{header.get('topic', '')}'")
            await topic.serve(reader, writer, header)
        except ProtocolError as error:
            self._link.report(f"ROS 1: refused a connection from a peer: {error}")
            writer.write(encode_header({"error": str(error)}))
            with contextlib.suppress(OSError):
                await writer.drain()
