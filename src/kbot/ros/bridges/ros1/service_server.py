"""Serves a ROS 1 service over TCPROS: reads requests and sends a response or an error."""

from __future__ import annotations

import asyncio
import struct

from kbot.record.encodings.serialization import decode_ros1, encode_ros1
from kbot.ros.bridges.link import PeerLink
from kbot.ros.bridges.ros1.tcpros import ProtocolError, encode_header, receive_block
from kbot.ros.bridges.service import require_service
from kbot.text import KbotError

ANSWER_SECONDS = 30.0
"""Seconds to wait for a request, for its response, and for the caller to read it."""


async def serve_service(
    link: PeerLink,
    node: str,
    reader: asyncio.StreamReader,
    writer: asyncio.StreamWriter,
    header: dict[str, str],
) -> None:
    """Answer one request of a caller, or all of them on a persistent connection.

    Raises:
        ProtocolError: there is no such service, or the caller has another definition of it.
        OSError, EOFError: the caller has disconnected.
    """
    try:
        kind = require_service(link.services, header["service"]).type
    except KbotError as error:
        raise ProtocolError(str(error)) from None
    if header.get("md5sum") not in (kind.md5, "*"):
        raise ProtocolError(
            f"{header['service']} is {kind.name} with md5sum {kind.md5}, not '{header.get('md5sum')}'"
        )
    answer = {
        "callerid": node,
        "md5sum": kind.md5,
        "request_type": f"{kind.name}Request",
        "response_type": f"{kind.name}Response",
        "type": kind.name,
    }
    writer.write(encode_header(answer))
    if header.get("probe") == "1":
        return
    is_persistent = header.get("persistent") == "1"
    while True:
        async with asyncio.timeout(None if is_persistent else ANSWER_SECONDS):
            data = await receive_block(reader)
        try:
            request = decode_ros1(data, kind.request, kind.request_name)
            answered = asyncio.wrap_future(link.call(header["service"], request))
            response = await asyncio.wait_for(answered, ANSWER_SECONDS)
            ok, body = 1, encode_ros1(response, kind.response_name)
        except KbotError as error:
            ok, body = 0, str(error).encode()
        except TimeoutError:
            ok, body = 0, b"the simulation does not answer"
        writer.write(struct.pack("<BI", ok, len(body)) + body)
        async with asyncio.timeout(ANSWER_SECONDS):
            await writer.drain()
        if not is_persistent:
            return
