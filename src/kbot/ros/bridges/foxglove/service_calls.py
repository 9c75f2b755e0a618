"""Services over the Foxglove protocol: advertised with their definitions, called in CDR or JSON."""

from __future__ import annotations

import json
import struct
from concurrent.futures import Future
from typing import Any

from kbot.record.encodings.bytes import decode_cdr, encode_cdr
from kbot.record.encodings.plain import from_plain, to_plain
from kbot.record.encodings.types import ros2_definition
from kbot.ros.bridges.loop import later
from kbot.ros.bridges.service import Service
from kbot.ros.bridges.websocket.server import Wire
from kbot.ros.bridges.websocket.topic_server import TopicServer
from kbot.text import KbotError
from kbot.text.json_text import parse_json

SERVICE_REQUEST, SERVICE_RESPONSE = 2, 3
_HEAD = struct.Struct("<BIII")


class FoxgloveServices:
    """What one client is offered, and its calls."""

    def __init__(self, server: TopicServer, wire: Wire) -> None:
        """Advertises them at once."""
        self._server, self._wire = server, wire
        self._services = list(server.link.services.values())
        offered = [_advertised(number, service) for number, service in enumerate(self._services)]
        wire.put(json.dumps({"op": "advertiseServices", "services": offered}), keep=True)

    def call(self, data: bytes) -> None:
        """Raises KbotError: it is no call, or names a service that is not there."""
        if len(data) < _HEAD.size:
            raise KbotError("that is no call of a service")
        _, number, call, length = _HEAD.unpack_from(data)
        encoding = data[_HEAD.size : _HEAD.size + length].decode(errors="replace")
        body = data[_HEAD.size + length :]
        if number >= len(self._services):
            raise KbotError(f"there is no service {number}")
        kind = self._services[number].type

        def tell(done: Future[Any]) -> None:
            error = done.exception()
            if error is not None:
                later(lambda: self._fail(number, call, str(error)))
                return
            if encoding == "cdr":
                answer = encode_cdr(done.result(), kind.response_name)
            else:
                answer = json.dumps(to_plain(done.result())).encode()
            head = _HEAD.pack(SERVICE_RESPONSE, number, call, len(encoding)) + encoding.encode()
            later(lambda: self._wire.put(head + answer))

        try:
            if encoding == "cdr":
                request = decode_cdr(body, kind.request, kind.request_name)
            elif encoding == "json":
                request = from_plain(parse_json(body), kind.request)
            else:
                raise KbotError(f"services are called in cdr or json, not {encoding[:20]!r}")
            self._server.link.call(self._services[number].name, request).add_done_callback(tell)
        except (KbotError, ValueError, RecursionError) as error:
            self._fail(number, call, str(error))

    def _fail(self, number: int, call: int, why: str) -> None:
        said = {"op": "serviceCallFailure", "serviceId": number, "callId": call, "message": why}
        self._wire.put(json.dumps(said))


def _advertised(number: int, service: Service) -> dict[str, object]:
    def part(name: str) -> dict[str, str]:
        text = ros2_definition(name)[0]
        return {"encoding": "cdr", "schemaName": name, "schemaEncoding": "ros2msg", "schema": text}

    kind = service.type
    request, response = part(kind.request_name), part(kind.response_name)
    return {
        "id": number,
        "name": service.name,
        "type": kind.ros2_name,
        "request": request,
        "response": response,
        # as the older subprotocol has them
        "requestSchema": request["schema"],
        "responseSchema": response["schema"],
    }
