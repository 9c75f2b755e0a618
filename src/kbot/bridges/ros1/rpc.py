"""XML-RPC as ROS 1 uses it: every answer is (code, text, value), and nobody is waited for for long."""

from __future__ import annotations

import http.client
import socketserver
import threading
import xmlrpc.client
from collections.abc import Callable
from typing import Any
from xml.parsers.expat import ExpatError
from xmlrpc.server import SimpleXMLRPCDispatcher, SimpleXMLRPCRequestHandler

LARGEST_REQUEST = 1 << 24
MOST_AT_ONCE = 64
SERVER_SECONDS = 10.0
CLIENT_SECONDS = 3.0
LOOK_SECONDS = 0.25
"""How long a server takes to notice that it is to end."""

Reply = tuple[int, str, Any]
Foreign = Any
"""What the library hands over, or ROS answers."""


class _Handler(SimpleXMLRPCRequestHandler):
    rpc_paths = ()
    timeout = SERVER_SECONDS

    def do_POST(self) -> None:
        length = self.headers.get("content-length", "")
        if not length.isdecimal() or int(length) > LARGEST_REQUEST:
            self.send_error(413 if length.isdecimal() else 411)
            return
        super().do_POST()

    def handle(self) -> None:
        try:
            super().handle()
        except OSError:
            self.close_connection = True

    def log_message(self, format: str, *args: object) -> None:
        """Nothing is written about requests."""


class RpcServer(socketserver.ThreadingMixIn, socketserver.TCPServer, SimpleXMLRPCDispatcher):
    """Answers on threads of its own from the moment it is made; more than a few at once are turned away."""

    allow_reuse_address = True
    daemon_threads = True
    block_on_close = False
    request_queue_size = 64
    logRequests = False
    _send_traceback_header = False

    def __init__(self, host: str, port: int, functions: dict[str, Callable[..., Reply]]) -> None:
        """Raises OSError: the address is taken, or not this machine's."""
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
    def make_connection(self, host: Foreign) -> http.client.HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = CLIENT_SECONDS
        return connection


class RpcFailed(Exception):
    """The other side does not answer, or answers that it cannot."""


def why_not_sent(value: Foreign) -> str:
    """Why XML-RPC cannot carry a value, as it can no number beyond 32 bits; empty where it can."""
    try:
        xmlrpc.client.loads(xmlrpc.client.dumps((value,)))
    except (OverflowError, TypeError, ValueError) as error:
        return str(error)
    except ExpatError:
        return "it has characters that XML has not"
    return ""


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
    except ExpatError as error:
        raise RpcFailed(f"{uri} answers {method} with no XML: {error}") from None
    if code != 1:
        raise RpcFailed(f"{uri} refuses {method}: {text}")
    return value
