"""ROS 1's XML-RPC: every answer is (code, text, value), and every wait has a limit."""

from __future__ import annotations

import contextlib
import http.client
import socket
import socketserver
import threading
import xmlrpc.client
from collections.abc import Callable
from http import HTTPStatus
from typing import Any
from xml.parsers.expat import ExpatError, ParserCreate
from xmlrpc.server import SimpleXMLRPCDispatcher, SimpleXMLRPCRequestHandler

from kbot.net.hosts import accepts_host, only_host

LARGEST_BODY = 1 << 24
"""Bytes of a request or an answer: 16 MiB, more than robot descriptions have."""
DEEPEST = 300
"""XML elements within each other: a level of a parameter tree takes three, and Python's own writer of XML-RPC
recurses once for each level."""
XML_TYPES = ("text/xml", "application/xml")
READ_BYTES = 1 << 16
LINGER_SECONDS = 1.0
"""Seconds that a refused peer has to read the error."""
MOST_AT_ONCE = 64
SERVER_SECONDS = 10.0
CLIENT_SECONDS = 3.0
LOOK_SECONDS = 0.25
"""How long a server takes to notice that it is to end."""

Reply = tuple[int, str, Any]
Foreign = Any
"""What the library hands over, or ROS answers."""


def check_xml(body: bytes) -> None:
    """Raise ValueError for what is not XML, has a document type (whose entities can multiply a text), or is
    nested too deeply."""
    depth = 0

    def start(name: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > DEEPEST:
            raise ValueError(f"more than {DEEPEST} XML elements within each other")

    def end(name: str) -> None:
        nonlocal depth
        depth -= 1

    def refuse_doctype(*_: object) -> None:
        raise ValueError("a document type in XML-RPC")

    parser = ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.StartDoctypeDeclHandler = refuse_doctype
    try:
        parser.Parse(body, True)
    except ExpatError as error:
        raise ValueError(f"malformed XML: {error}") from None
    except LookupError:
        raise ValueError("malformed XML: its encoding is unknown") from None


def read_answer(body: bytes) -> tuple[Foreign, ...]:
    """The values of an answer, or of a call.

    Raises:
        ValueError: it is not XML-RPC.
        xmlrpc.client.Fault: it is a fault.
    """
    check_xml(body)
    try:
        return xmlrpc.client.loads(body)[0]
    except (ArithmeticError, AttributeError, LookupError, TypeError, xmlrpc.client.ResponseError) as error:
        raise ValueError(f"malformed XML-RPC: {type(error).__name__} {error}") from None


class _Handler(SimpleXMLRPCRequestHandler):
    server: RpcServer
    rpc_paths = ("/", "/RPC2")  # roscpp and rospy use the first, and a URI without a path means the second
    timeout = SERVER_SECONDS
    error_message_format = "%(code)d: %(message)s\n"
    error_content_type = "text/plain; charset=utf-8"

    def do_POST(self) -> None:
        refusal = self._refusal()
        if refusal is None:
            super().do_POST()
        else:
            self._refuse(*refusal)

    def decode_request_content(self, data: bytes) -> bytes | None:
        """The request's body, checked; None if the request is refused."""
        decoded: bytes | None = super().decode_request_content(data)
        if decoded is None:
            return None
        try:
            check_xml(decoded)
        except ValueError as error:
            self._refuse(HTTPStatus.BAD_REQUEST, str(error))
            return None
        return decoded

    def _refusal(self) -> tuple[HTTPStatus, str] | None:
        """Why a request is not from a ROS node, or cannot be read; None if it is accepted.

        Without asking the server first, a web page can send a POST to any server, but only with content types
        other than XML. Browsers add Origin to each POST.
        """
        headers = self.headers
        if "origin" in headers:
            return HTTPStatus.FORBIDDEN, "web pages cannot use the ROS 1 bridge (the request has an Origin)"
        if not accepts_host(only_host(headers.get_all("host", [])), self.server.host):
            return HTTPStatus.FORBIDDEN, "the Host header is not a name or address of this machine"
        if headers.get_content_type() not in XML_TYPES:
            return HTTPStatus.UNSUPPORTED_MEDIA_TYPE, f"the Content-Type is not {' or '.join(XML_TYPES)}"
        length = headers.get("content-length", "")
        if "transfer-encoding" in headers or not (length.isascii() and length.isdecimal()):
            return HTTPStatus.LENGTH_REQUIRED, "the request has no Content-Length"
        if len(length) > len(str(LARGEST_BODY)) or int(length) > LARGEST_BODY:
            return HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"the body has more than {LARGEST_BODY} bytes"
        return None

    def _refuse(self, status: HTTPStatus, reason: str) -> None:
        """Answer with an error that has no effect, and let the peer read it: closing a connection with unread
        bytes resets it, and the answer would be lost."""
        with contextlib.suppress(OSError):  # the peer may be gone
            self.send_error(status, reason)
            self.wfile.flush()
            self.connection.shutdown(socket.SHUT_WR)
            self.connection.settimeout(LINGER_SECONDS)
            left = LARGEST_BODY
            while left > 0 and (part := self.rfile.read1(READ_BYTES)):
                left -= len(part)

    def handle(self) -> None:
        try:
            super().handle()
        except OSError:
            self.close_connection = True

    def log_message(self, format: str, *args: object) -> None:
        """Nothing is written about requests."""


class RpcServer(socketserver.ThreadingMixIn, socketserver.TCPServer, SimpleXMLRPCDispatcher):
    """Answers on threads of its own from the moment it is made; more than a few requests at once are refused.

    Only ROS nodes are answered, not web pages: see `_Handler`.
    """

    allow_reuse_address = True
    daemon_threads = True
    block_on_close = False
    request_queue_size = 64
    logRequests = False
    _send_traceback_header = False

    def __init__(self, host: str, port: int, functions: dict[str, Callable[..., Reply]]) -> None:
        """Raises OSError: the address is taken, or not this machine's."""
        self.host = host
        SimpleXMLRPCDispatcher.__init__(self, allow_none=False, encoding="utf-8")
        socketserver.TCPServer.__init__(self, (host, port), _Handler)
        self.register_multicall_functions()
        for name, function in functions.items():
            self.register_function(function, name)
        self._free = threading.BoundedSemaphore(MOST_AT_ONCE)
        self._thread = threading.Thread(
            target=self.serve_forever, args=(LOOK_SECONDS,), daemon=True, name="kbot-ros1-rpc"
        )
        self._thread.start()

    @property
    def port(self) -> int:
        return int(self.server_address[1])

    def close(self) -> None:
        """Answer no more."""
        self.shutdown()
        self.server_close()
        self._thread.join()

    def process_request(self, request: Foreign, client_address: Foreign) -> None:
        if not self._free.acquire(blocking=False):
            self.shutdown_request(request)
            return
        super().process_request(request, client_address)

    def process_request_thread(self, request: Foreign, client_address: Foreign) -> None:
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._free.release()

    def handle_error(self, request: Foreign, client_address: Foreign) -> None:
        """What one peer does wrong is its own affair."""


class _Transport(xmlrpc.client.Transport):
    accept_gzip_encoding = False  # the size of an answer is checked as it comes

    def make_connection(self, host: Foreign) -> http.client.HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = CLIENT_SECONDS
        return connection

    def single_request(
        self, host: Foreign, handler: str, request_body: Foreign, verbose: bool = False
    ) -> tuple[Foreign, ...]:
        """Send a call. Raises ValueError: the answer cannot be read, or is too large."""
        response = self.send_request(host, handler, request_body, verbose).getresponse()
        if response.status != HTTPStatus.OK:
            headers = dict(response.getheaders())
            raise xmlrpc.client.ProtocolError(f"{host}{handler}", response.status, response.reason, headers)
        body = response.read(LARGEST_BODY + 1)
        if len(body) > LARGEST_BODY:
            raise ValueError(f"the answer has more than {LARGEST_BODY} bytes")
        return read_answer(body)


class RpcFailed(Exception):
    """The other side does not answer, or answers that it cannot."""


def why_not_sent(value: Foreign) -> str:
    """Why a value cannot be sent, such as a number of more than 32 bits; empty if it can."""
    try:
        body = xmlrpc.client.dumps((value,), "setParam").encode()
        read_answer(body)
    except (OverflowError, TypeError, ValueError, RecursionError) as error:
        return str(error)
    return f"it has more than {LARGEST_BODY} bytes" if len(body) > LARGEST_BODY else ""


def call(uri: str, method: str, *arguments: Foreign) -> Foreign:
    """Call a master or node; its answer's value.

    Raises:
        RpcFailed: it is not there, does not answer in time, or says no.
    """
    try:
        with xmlrpc.client.ServerProxy(uri, transport=_Transport()) as server:
            code, text, value = getattr(server, method)(*arguments)
    except (OSError, xmlrpc.client.Error, http.client.HTTPException, ValueError, TypeError) as error:
        raise RpcFailed(f"{uri} does not answer {method}: {error}") from None
    if code != 1:
        raise RpcFailed(f"{uri} refuses {method}: {text}")
    return value
