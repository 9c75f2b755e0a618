"""ROS 1 subscribers that are killed are dropped without a message in the terminal."""

import asyncio
import logging
import socket
import struct
from types import SimpleNamespace

import pytest

from kbot.ros.bridges.ros1.publisher import _Subscriber


def test_nothing_is_sent_to_a_killed_subscriber(caplog: pytest.LogCaptureFixture) -> None:
    """asyncio logs a warning for each write to a lost connection after the fifth."""

    async def send_to_killed_peer() -> None:
        accepted: asyncio.Future[asyncio.StreamWriter] = asyncio.get_running_loop().create_future()
        server = await asyncio.start_server(lambda _, writer: accepted.set_result(writer), "127.0.0.1", 0)
        peer = socket.create_connection(server.sockets[0].getsockname())
        writer = await accepted
        subscriber = _Subscriber(writer, "/killed")
        # with this option `close` resets the connection, as if the process were killed with unread data
        peer.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        peer.close()
        for _ in range(20):
            subscriber.send(SimpleNamespace(ros1=b"0123456789" * 10_000))
        await asyncio.sleep(0.05)
        for _ in range(20):
            subscriber.send(SimpleNamespace(ros1=b"0123456789"))
        server.close()

    with caplog.at_level(logging.WARNING):
        asyncio.run(send_to_killed_peer())
    assert not caplog.records
