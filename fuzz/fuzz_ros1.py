"""Fuzzes what ROS 1 peers send: answers and calls in XML-RPC, and connections in TCPROS.

For any bytes, the reader of XML-RPC returns values that are not nested too deeply, or raises ValueError or the
fault that the bytes describe. The master and the node answer every call. A connection in TCPROS is served or
refused with a ProtocolError. tests/bridges/test_ros1_access.py has the inputs that failed.
"""

import asyncio
import contextlib
import socket
import xmlrpc.client
from functools import cache
from types import SimpleNamespace
from typing import Any

from choices import Choices
from edits import edited
from simulated import LINK

from kbot.messages import Twist
from kbot.record.encodings.serialization import encode_ros1
from kbot.ros.bridges.loop import wait_for
from kbot.ros.bridges.ros1 import master, subscriber
from kbot.ros.bridges.ros1.bridge import Ros1Bridge
from kbot.ros.bridges.ros1.rpc import DEEPEST, RpcFailed, read_answer
from kbot.ros.bridges.ros1.tcpros import ProtocolError, decode_header, encode_header

TAGS = (
    *("params", "param", "fault", "methodName", "value", "array", "data", "struct", "member", "name"),
    *("nil", "boolean", "int", "i8", "double", "bigdecimal", "string", "base64", "dateTime.iso8601", "a:int"),
)


def depth(value: object) -> int:
    inner = value.values() if isinstance(value, dict) else value if isinstance(value, list | tuple) else ()
    return 1 + max(map(depth, inner), default=0)


def element(choices: Choices, level: int) -> bytes:
    """A random element with children, or text."""
    if level > 200 or choices.integer(0, 3) == 0:
        return choices.raw(12)
    tag = choices.pick(TAGS).encode()
    inside = b"".join(element(choices, level + 1) for _ in range(choices.integer(1, 3)))
    return b"<" + tag + b">" + inside + b"</" + tag + b">"


def document(choices: Choices) -> bytes:
    """The input itself, a valid answer after edits, or a response with random elements."""
    kind = choices.integer(0, 2)
    if kind == 0:
        return choices.raw(4_000)
    if kind == 1:
        return edited(choices, ANSWERS, TAG_TEXTS)
    return b"<methodResponse>" + element(choices, 0) + b"</methodResponse>"


TAG_TEXTS = [f"<{end}{tag}>".encode() for tag in TAGS for end in ("", "/")]
ANSWERS = [
    xmlrpc.client.dumps(([1, "", value],), methodresponse=True).encode()
    for value in (["TCPROS", "localhost", 1], {"a": {"b": [1.5, True, "c"]}}, "http://localhost:1/", b"a", -5)
]


def one_answer(choices: Choices) -> None:
    try:
        values = read_answer(document(choices))
    except (ValueError, xmlrpc.client.Fault):
        return
    assert depth(values) <= DEEPEST


def _refuse(uri: str, method: str, *arguments: object) -> None:
    """Replaces calls of nodes: the input names their addresses."""
    raise RpcFailed(f"{uri} is not called")


master.call = subscriber.call = _refuse


@cache
def bridge() -> Any:
    """KBot's node with its own master."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    return Ros1Bridge(LINK, master=f"http://127.0.0.1:{port}/")


NODE, URI = "/n", "http://localhost:1/"
CALLS = {
    "registerPublisher": (NODE, "/a", "std_msgs/String", URI),
    "registerSubscriber": (NODE, "/a", "*", URI),
    "registerService": (NODE, "/s", "rosrpc://localhost:1", URI),
    "unregisterPublisher": (NODE, "/a", URI),
    "unregisterSubscriber": (NODE, "/a", URI),
    "unregisterService": (NODE, "/s", "rosrpc://localhost:1"),
    "setParam": (NODE, "/p/q", {"a": [1, 2.5, {"b": True}]}),
    "getParam": (NODE, "p"),
    "deleteParam": (NODE, "/p"),
    "searchParam": (NODE, "q"),
    "subscribeParam": (NODE, URI, "/p"),
    "unsubscribeParam": (NODE, URI, "/p"),
    "getPublishedTopics": (NODE, ""),
    "lookupService": (NODE, "/s"),
    "getSystemState": (NODE,),
    "paramUpdate": (NODE, "/p", {"a": 1}),
    "publisherUpdate": (NODE, "/cmd_vel", [URI]),
    "requestTopic": (NODE, "/odom", [["TCPROS"], ["UDPROS", "a"]]),
    "getBusInfo": (NODE,),
    "system.multicall": ([{"methodName": "getPid", "params": [NODE]}],),
}
"""Calls of the master and of the node."""
CALL_TEXTS = [xmlrpc.client.dumps(arguments, method).encode() for method, arguments in CALLS.items()]


def one_call(choices: Choices) -> None:
    body = edited(choices, CALL_TEXTS, TAG_TEXTS)
    for server in (bridge()._server, bridge()._own_master._server):
        answer = server._marshaled_dispatch(body)
        with contextlib.suppress(xmlrpc.client.Fault):
            xmlrpc.client.loads(answer)


class Writer:
    """Accepts what the server sends to a peer."""

    transport = property(lambda self: self)

    def get_extra_info(self, name: str) -> Any:
        return SimpleNamespace(setsockopt=lambda *option: None)

    def write(self, data: bytes) -> None:
        assert isinstance(data, bytes)

    async def drain(self) -> None:
        """Nothing is queued."""

    def is_closing(self) -> bool:
        return False

    def get_write_buffer_size(self) -> int:
        return 0

    def set_write_buffer_limits(self, high: int) -> None:
        """Nothing is queued."""

    def abort(self) -> None:
        """Nothing is open."""


def block(data: bytes) -> bytes:
    return len(data).to_bytes(4, "little") + data


TWIST = encode_ros1(Twist())
CONNECTIONS = [
    encode_header(
        {"callerid": NODE, "topic": "/odom", "type": "nav_msgs/Odometry", "md5sum": "*", "tcp_nodelay": "1"}
    ),
    encode_header({"callerid": NODE, "topic": "/clock", "type": "*", "md5sum": "*"}) + bytes(20),
    encode_header({"callerid": NODE, "service": "/gazebo/get_world_properties", "md5sum": "*"}) + block(b""),
    encode_header({"callerid": NODE, "service": "/gazebo/pause_physics", "md5sum": "*", "persistent": "1"})
    + block(b"")
    + block(b"\1\0\0\0a"),
    encode_header({"service": "/gazebo/get_model_state", "md5sum": "*", "probe": "1"}),
    encode_header({"error": "no"}),
]
HEADER_WORDS = [
    block(b"error=no"),
    block(b"md5sum=*"),
    block(b"topic=/odom"),
    block(b"service=/a"),
    block(b"persistent=1"),
]


def one_connection(choices: Choices) -> None:
    """What a peer sends to the server, until it disconnects; and what a publisher sends to KBot."""
    data, server = edited(choices, CONNECTIONS, HEADER_WORDS), bridge()._tcpros

    async def serve() -> None:
        reader = asyncio.StreamReader()
        reader.feed_data(data)
        reader.feed_eof()
        with contextlib.suppress(OSError, EOFError, TimeoutError):
            served = asyncio.ensure_future(server._handle(reader, Writer()))
            while not served.done():
                LINK.answer_calls()
                await asyncio.sleep(0)
            await served

    wait_for(serve())
    with contextlib.suppress(ProtocolError):
        decode_header(data[4:])


TARGETS = {"xmlrpc-answers": one_answer, "xmlrpc-calls": one_call, "tcpros": one_connection}
