"""The page's address: bind it before anything is served, and open a browser there."""

from __future__ import annotations

import errno
import secrets
import socket
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from os import environ

from kbot.net.hosts import is_loopback
from kbot.text import KbotError
from kbot.workbench.serving.access import Access, bracketed

FIRST_PORT, LAST_PORT = 8300, 8399
"""The ports that are tried without --port."""
SEND_BUFFER = 64 * 1024
"""Bytes of the socket's send buffer. A small one keeps few messages in flight to a slow page."""


@dataclass(frozen=True, slots=True)
class Address:
    """A bound address. Clients that connect wait until it is served."""

    listening: socket.socket
    access: Access

    @property
    def url(self) -> str:
        """The URL, with the token if one is needed."""
        host, port, token = self.access.host, self.access.port, self.access.token
        return f"http://{bracketed(host)}:{port}/" + (f"?token={token}" if token else "")


@contextmanager
def bound(host: str, port: int | None, *, open_browser: bool = False) -> Iterator[Address]:
    """Bind an address until the end of the block.

    `port` None takes the first free port from 8300, 0 any free port. The browser starts while the rest of
    KBot is still loading, and waits for the server. If other machines can reach `host`, the address has a
    token that the page needs.

    Raises:
        KbotError: all requested ports are in use, or the address is not this machine's.
    """
    with _bind(host, port) as listening:
        token = None if is_loopback(host) else secrets.token_urlsafe(18)
        address = Address(listening, Access(host, listening.getsockname()[1], token))
        if open_browser and can_open_browser():
            threading.Thread(target=_open, args=(address.url,), daemon=True).start()
        yield address


def _bind(host: str, port: int | None) -> socket.socket:
    if port is not None and not 0 <= port <= 65535:
        raise KbotError(f"port {port} is not a port number. Use 0 to 65535, or omit it to use a free one")
    ports = range(FIRST_PORT, LAST_PORT + 1) if port is None else (port,)
    try:
        family = socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)[0][0]
    except (OSError, UnicodeError):
        raise KbotError(f"--host {host}: unknown address") from None
    for candidate in ports:
        try:
            listening = socket.create_server((host, candidate), family=family)
            # connections inherit it
            listening.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
            return listening
        except PermissionError:
            if port is None:
                continue  # Windows reserves some ports
            raise KbotError(f"--port {candidate}: permission denied. Choose another port") from None
        except OSError as error:
            if error.errno not in (errno.EADDRINUSE, errno.EACCES):
                raise KbotError(f"--host {host}: cannot listen on this address: {error.strerror}") from None
    if port is None:
        raise KbotError(
            f"the ports {FIRST_PORT} to {LAST_PORT} are all in use. Choose another one with --port"
        )
    raise KbotError(
        f"port {port} is in use. Choose another one with --port, or omit --port to use a free one"
    )


def _open(url: str) -> None:
    import webbrowser  # imported lazily: few runs open a browser

    webbrowser.open(url)


def can_open_browser() -> bool:
    """Return whether a browser could open a window. Otherwise `webbrowser` may take over the terminal."""
    if sys.platform.startswith("linux"):
        return bool(environ.get("DISPLAY") or environ.get("WAYLAND_DISPLAY"))
    return True
