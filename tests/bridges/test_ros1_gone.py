"""Subscribers of ROS 1 that die say nothing: they are let go, and nothing is written on the terminal."""

import asyncio
import logging
import socket
import struct
from types import SimpleNamespace

import pytest

from kbot.ros.bridges.ros1.publisher import _Subscriber


def test_a_killed_subscriber_is_sent_nothing_more(caplog: pytest.LogCaptureFixture) -> None:
    """asyncio warns aloud of every write after the fifth to a connection that is lost."""

    async def die() -> None:
        met: asyncio.Future[asyncio.StreamWriter] = asyncio.get_running_loop().create_future()
        server = await asyncio.start_server(lambda _, writer: met.set_result(writer), "127.0.0.1", 0)
        peer = socket.create_connection(server.sockets[0].getsockname())
        writer = await met
        subscriber = _Subscriber(writer, "/dead")
        # as the system does for a process that is killed with unread data
        peer.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        peer.close()
        for _ in range(20):
            subscriber.send(SimpleNamespace(ros1=b"0123456789" * 10_000))
        await asyncio.sleep(0.05)
        for _ in range(20):
            subscriber.send(SimpleNamespace(ros1=b"0123456789"))
        server.close()

    with caplog.at_level(logging.WARNING):
        asyncio.run(die())
    assert not caplog.records
