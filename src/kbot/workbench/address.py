"""The page's address: binds it before anything is served, and opens a browser at it."""

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
SEND_BUFFER = 64 * 1024


@dataclass(frozen=True, slots=True)
class Address:
    """A bound address: who asks there waits until it is served."""

    listening: socket.socket
    access: Access

    @property
    def url(self) -> str:
        """With the token, where one is needed."""
        host, port, token = self.access.host, self.access.port, self.access.token
        return f"http://{bracketed(host)}:{port}/" + (f"?token={token}" if token else "")


@contextmanager
def bound(host: str, port: int | None, *, open_browser: bool = False) -> Iterator[Address]:
    """An address until the end of the block. `port` None takes the first free one from 8300 on, 0 any. A
    browser starts beside what is still to be loaded, and waits.

    Where `host` is reached from other machines the address carries a token, which the page needs.

    Raises:
        KbotError: every port asked for is in use, or the address is not this machine's.
    """
    with _bind(host, port) as listening:
        token = None if is_loopback(host) else secrets.token_urlsafe(18)
        address = Address(listening, Access(host, listening.getsockname()[1], token))
        if open_browser and _has_display():
            threading.Thread(target=_open, args=(address.url,), daemon=True).start()
        yield address


def _bind(host: str, port: int | None) -> socket.socket:
    ports = range(FIRST_PORT, LAST_PORT + 1) if port is None else (port,)
    try:
        family = socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)[0][0]
    except (OSError, UnicodeError):
        raise KbotError(f"--host {host}: no such address") from None
    for candidate in ports:
        try:
            listening = socket.create_server((host, candidate), family=family)
            # inherited by each connection: little is under way to a page that reads slowly
            listening.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
            return listening
        except PermissionError:
            if port is None:
                continue  # Windows keeps some of them for itself
            raise KbotError(f"--port {candidate} may not be served on without more rights") from None
        except OSError as error:
            if error.errno not in (errno.EADDRINUSE, errno.EACCES):
                raise KbotError(f"--host {host} cannot be served on: {error.strerror}") from None
    if port is None:
        raise KbotError(f"the ports {FIRST_PORT} to {LAST_PORT} are all in use; name another with --port")
    raise KbotError(f"port {port} is in use; name another with --port, or leave it out to get a free one")


def _open(url: str) -> None:
    import webbrowser  # lazy in this module: few runs open a browser

    webbrowser.open(url)


def _has_display() -> bool:
    """Whether a browser could open a window; without one `webbrowser` may take over the terminal."""
    if sys.platform.startswith("linux"):
        return bool(environ.get("DISPLAY") or environ.get("WAYLAND_DISPLAY"))
    return True
