"""XML-RPC of ROS 1: client and server. Every answer is (code, text, value), and every wait is limited."""

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
"""Bytes of a request or an answer: 16 MiB, more than any robot description."""
DEEPEST = 300
"""Nesting levels of XML elements. A level of a parameter tree takes three of them, and Python's XML-RPC
writer recurses once for each level of the tree."""
XML_TYPES = ("text/xml", "application/xml")
READ_BYTES = 1 << 16
LINGER_SECONDS = 1.0
"""Seconds that a refused peer has to read the error."""
MOST_AT_ONCE = 64
"""Requests that are answered at the same time. More are refused."""
SERVER_SECONDS = 10.0
"""Seconds without data after which a request is aborted."""
CLIENT_SECONDS = 3.0
"""Seconds to wait for an answer."""
POLL_SECONDS = 0.25
"""Seconds that a server may take to notice that it must stop."""

Reply = tuple[int, str, Any]
Foreign = Any
"""A value from Python's XML-RPC library, or from a ROS node."""


def check_xml(body: bytes) -> None:
    """Raise ValueError if a body is not XML, is nested too deeply, or has a document type.

    A document type can define entities that expand to a huge text.
    """
    depth = 0

    def start(name: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > DEEPEST:
            raise ValueError(f"XML elements are nested more than {DEEPEST} levels deep")

    def end(name: str) -> None:
        nonlocal depth
        depth -= 1

    def refuse_doctype(*_: object) -> None:
        raise ValueError("XML-RPC must not have a document type")

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
    """Parse an answer, or a call, and return its values.

    Raises:
        ValueError: the body is not XML-RPC.
        xmlrpc.client.Fault: the answer is a fault.
    """
    check_xml(body)
    try:
        return xmlrpc.client.loads(body)[0]
    except (ArithmeticError, AttributeError, LookupError, TypeError, xmlrpc.client.ResponseError) as error:
        raise ValueError(f"malformed XML-RPC: {type(error).__name__} {error}") from None


class _Handler(SimpleXMLRPCRequestHandler):
    server: RpcServer
    rpc_paths = ("/", "/RPC2")  # roscpp and rospy use "/"; Python's client uses "/RPC2" without a path
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
        """The decoded body of the request; None if the request has been refused."""
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

        A web page can send a POST to any server without a preflight request, but not as XML.
        Browsers add an Origin header to each POST.
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
        """Answer with an error, and read the rest of the request.

        If a connection is closed with unread bytes, it is reset, and the peer does not get the error.
        """
        with contextlib.suppress(OSError):  # the peer may have disconnected
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
        """Do not log requests."""


class RpcServer(socketserver.ThreadingMixIn, socketserver.TCPServer, SimpleXMLRPCDispatcher):
    """Answers each request on its own thread, from its creation on. It refuses web pages, see `_Handler`."""

    allow_reuse_address = True
    daemon_threads = True
    block_on_close = False
    request_queue_size = 64
    logRequests = False
    _send_traceback_header = False

    def __init__(self, host: str, port: int, functions: dict[str, Callable[..., Reply]]) -> None:
        """Raises OSError: the address is in use, or not one of this machine."""
        self.host = host
        SimpleXMLRPCDispatcher.__init__(self, allow_none=False, encoding="utf-8")
        socketserver.TCPServer.__init__(self, (host, port), _Handler)
        self.register_multicall_functions()
        for name, function in functions.items():
            self.register_function(function, name)
        self._free = threading.BoundedSemaphore(MOST_AT_ONCE)
        self._thread = threading.Thread(
            target=self.serve_forever, args=(POLL_SECONDS,), daemon=True, name="kbot-ros1-rpc"
        )
        self._thread.start()

    @property
    def port(self) -> int:
        return int(self.server_address[1])

    def close(self) -> None:
        """Stop the server."""
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
        """Ignore errors of a connection, because they are errors of the peer."""


class _Transport(xmlrpc.client.Transport):
    accept_gzip_encoding = False  # the size limit applies to the bytes as received

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
    """The other side does not answer, or reports a failure."""


def why_not_sent(value: Foreign) -> str:
    """Why XML-RPC cannot transmit a value, such as an integer of more than 32 bits; empty if it can."""
    try:
        body = xmlrpc.client.dumps((value,), "setParam").encode()
        read_answer(body)
    except (OverflowError, TypeError, ValueError, RecursionError) as error:
        return str(error)
    return f"it has more than {LARGEST_BODY} bytes" if len(body) > LARGEST_BODY else ""


def call(uri: str, method: str, *arguments: Foreign) -> Foreign:
    """Call a master or node, and return the value of its answer.

    Raises:
        RpcFailed: it does not answer in time, or reports a failure.
    """
    try:
        with xmlrpc.client.ServerProxy(uri, transport=_Transport()) as server:
            code, text, value = getattr(server, method)(*arguments)
    except (OSError, xmlrpc.client.Error, http.client.HTTPException, ValueError, TypeError) as error:
        raise RpcFailed(f"{uri} does not answer {method}: {error}") from None
    if code != 1:
        raise RpcFailed(f"{uri} refuses {method}: {text}")
    return value
