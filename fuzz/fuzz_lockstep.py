"""Fuzzes the channel between a trial and its programs.

For any bytes, the reader returns JSON objects with an operation, or reports that the channel is closed.
"""

import contextlib
import socket

from choices import Choices
from edits import edited

from kbot.ros.lockstep.channel import Channel, ChannelClosed

LINES = [
    b'{"op": "open", "token": "abc"}\n{"op": "hello", "name": "/n", "identity": "", "transport": "local"}\n',
    b'{"op": "connect", "topic": "/odom", "type": "nav_msgs/msg/Odometry", "publishes": false}\n',
    b'{"op": "done", "messages": ["/cmd_vel", "/cmd_vel"]}\n{"op": "bye", "messages": []}\n',
]
WORDS = [b"\n", b'"op"', b"{", b"}", b"[", b"]", b"NaN", b"1e999", b"null"]


def one_channel(choices: Choices) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        theirs = socket.create_connection(server.getsockname())
        ours, _ = server.accept()
    with ours:
        theirs.sendall(edited(choices, LINES, WORDS)[:50_000])
        theirs.close()
        channel = Channel(ours)
        with contextlib.suppress(ChannelClosed):
            while True:
                message = channel.receive()
                assert message is not None
                assert isinstance(message["op"], str)


TARGETS = {"lockstep": one_channel}
