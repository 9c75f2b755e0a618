"""Services over TCPROS: a header, then for each request one byte that says whether it went well, and the
response, or in words why not."""

from __future__ import annotations

import socket
import struct

from kbot.bridges.link import Link
from kbot.bridges.ros1.tcpros import ProtocolError, encode_header, read_block
from kbot.bridges.services import require_service
from kbot.text import KbotError
from kbot.wire import decode_ros1, encode_ros1

ANSWER_SECONDS = 30.0


def serve_service(link: Link, node: str, connection: socket.socket, header: dict[str, str]) -> None:
    """Answer one caller: one request, or as many as come where it wants a persistent connection.

    Raises:
        ProtocolError: there is no such service, or the caller means another definition of it.
        OSError: the caller is gone.
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
    connection.sendall(encode_header(answer))
    if header.get("probe") == "1":
        return
    connection.settimeout(None if header.get("persistent") == "1" else ANSWER_SECONDS)
    while True:
        data = read_block(connection)
        try:
            request = decode_ros1(data, kind.request, kind.request_name)
            response = link.call(header["service"], request).result(ANSWER_SECONDS)
            ok, body = 1, encode_ros1(response, kind.response_name)
        except KbotError as error:
            ok, body = 0, str(error).encode()
        except TimeoutError:
            ok, body = 0, b"the simulation does not answer"
        connection.sendall(struct.pack("<BI", ok, len(body)) + body)
        if header.get("persistent") != "1":
            return
