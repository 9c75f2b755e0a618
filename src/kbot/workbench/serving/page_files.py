"""Answer HTTP requests: the page's files, meshes by id, and downloads."""

from __future__ import annotations

import http
from collections.abc import Awaitable, Iterable
from urllib.parse import urlsplit

from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from kbot.net.hosts import only_host
from kbot.render.glb import glb
from kbot.text import KbotError
from kbot.text.complaints import Complaints
from kbot.workbench.built_page import load_page, takes_gzip, with_greeting
from kbot.workbench.driving.turns import GREETING_SECONDS
from kbot.workbench.protocol.codec import encode
from kbot.workbench.saved_page import saved_page
from kbot.workbench.serving.access import Access, is_used_by_another_site, security_headers
from kbot.workbench.serving.daemon_thread import on_daemon_thread
from kbot.workbench.session.deadman import NOBODY
from kbot.workbench.session.session import Session
from kbot.workbench.timeline.recording import ADDRESS as RECORDING

_TEXT = "text/plain; charset=utf-8"


def response(
    status: http.HTTPStatus,
    host: str,
    body: bytes,
    kind: str = _TEXT,
    kept: str = "no-store",
    scripts: Iterable[str] = (),
) -> Response:
    """Return a complete response.

    `kind` is its media type, `kept` how long a browser may cache it, and `scripts` are the digests of its
    inline scripts.
    """
    headers = Headers(
        {
            "Content-Type": kind,
            "Content-Length": str(len(body)),
            "Cache-Control": kept,
            "Connection": "close",
            **security_headers(host, scripts),
        }
    )
    return Response(status.value, status.phrase, headers, body)


EXPORTS = {"/export/robot.glb": "model/gltf-binary", "/export/robot.html": "application/octet-stream"}
"""Media types. The HTML is sent as a download, so that it is not opened in the page's origin."""


async def exported(session: Session, path: str, host: str) -> Response:
    """Return one of `EXPORTS`, made on another thread."""
    async with session.turns:
        robot, positions = session.standing()
    if path == "/export/robot.glb":
        body = await on_daemon_thread(glb, robot, positions)
    else:
        async with session.turns:
            body = (await on_daemon_thread(saved_page, session, robot)).encode()
    return response(http.HTTPStatus.OK, host, body, EXPORTS[path])


def export_headers(path: str, host: str) -> Response:
    """Return the headers of an export. The length is missing, because it is unknown before the file is
    made."""
    answer = response(http.HTTPStatus.OK, host, b"", EXPORTS[path])
    del answer.headers["Content-Length"]
    return answer


_FOR_EVER = "max-age=31536000, immutable"


class PageFiles:
    """Answers requests for the files of a session, if access is granted."""

    def __init__(self, session: Session, access: Access, complaints: Complaints) -> None:
        self._session, self._access, self._complaints = session, access, complaints
        self._page = load_page()

    async def answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """Answer a plain request, or return None to continue with a WebSocket handshake.

        A failing request does not affect others.
        """
        try:
            found = self._answer(request)
            return await found if isinstance(found, Awaitable) else found
        except KbotError as error:
            reason = str(error)
        except Exception as error:  # noqa: BLE001 - logged, and answered
            # a client can invent any number of paths, so only the kind of request is logged
            kind = request.path.partition("?")[0].lstrip("/").partition("/")[0][:20]
            reason = self._complaints.fault(f"GET /{kind}", error)
        return response(http.HTTPStatus.INTERNAL_SERVER_ERROR, "", f"500: {reason}\n".encode())

    def _answer(self, request: Request) -> Response | Awaitable[Response] | None:
        # older releases of websockets accept only GET, and their request has no method
        method = getattr(request, "method", "GET")
        if method not in ("GET", "HEAD"):
            answer = response(http.HTTPStatus.METHOD_NOT_ALLOWED, "", b"405: only GET and HEAD are allowed\n")
            answer.headers["Allow"] = "GET, HEAD"
            return answer
        try:
            path = urlsplit(request.path).path
        except ValueError:
            return response(http.HTTPStatus.BAD_REQUEST, "", b"400: malformed address\n")
        found = self._found(path, request, method == "HEAD")
        if method == "HEAD" and isinstance(found, Response):
            found.body = b""  # the headers keep its length
        return found

    def _found(
        self, path: str, request: Request, only_headers: bool
    ) -> Response | Awaitable[Response] | None:
        is_socket = path == "/ws"
        host = only_host(request.headers.get_all("Host"))
        secret = is_socket or path.startswith(("/mesh/", "/export/", RECORDING))
        reason = self._access.refuses(request.path, host, request.headers.get_all("Origin"), secret)
        if is_used_by_another_site(request.headers):
            reason = "a page of another site may not use this server"
        if reason is not None:
            self._complaints.add(f"refused {path[:80]}: {reason}")
            return response(http.HTTPStatus.FORBIDDEN, "", f"403: {reason}\n".encode())
        served = host or ""
        if is_socket:
            return None
        if path.startswith("/mesh/"):
            mesh = self._session.meshes.packed(path.removeprefix("/mesh/"))
            if mesh is not None:
                return response(http.HTTPStatus.OK, served, mesh, "application/octet-stream", _FOR_EVER)
        elif path.startswith(RECORDING):
            return self._recording(path.removeprefix(RECORDING), served, only_headers)
        elif path in EXPORTS:
            return export_headers(path, served) if only_headers else exported(self._session, path, served)
        elif path in self._page:
            is_greeted = path == "/" and not self._access.refuses(request.path, served, (), secret=True)
            if is_greeted:
                return self._greeting_page(served, only_headers)
            return self._page_file(path, request, served)
        return response(http.HTTPStatus.NOT_FOUND, served, b"404: page not found\n")

    async def _recording(self, name: str, host: str, only_headers: bool) -> Response:
        """Return a recording that a page made, read on another thread."""
        body = await on_daemon_thread(self._session.recording.content, name)
        if body is None:
            return response(http.HTTPStatus.NOT_FOUND, host, b"404: recording not found\n")
        answer = response(http.HTTPStatus.OK, host, body, "application/octet-stream")
        if only_headers:
            answer.body = b""
        return answer

    async def _greeting_page(self, host: str, only_headers: bool) -> Response:
        """Return the page with the first messages in it."""
        file, session = self._page["/"], self._session
        async with session.turns.within(GREETING_SECONDS) as is_lent:
            greeting = session.greeting(NOBODY, is_lent=is_lent)
        body = with_greeting(file.body, map(encode, greeting))
        answer = response(http.HTTPStatus.OK, host, body, file.kind, "no-cache", file.scripts)
        if only_headers:
            answer.body = b""
        return answer

    def _page_file(self, path: str, request: Request, host: str) -> Response:
        file = self._page[path]
        kept = _FOR_EVER if path.startswith("/assets/") else "no-cache"
        if file.packed is None or not takes_gzip(request.headers.get_all("Accept-Encoding")):
            return response(http.HTTPStatus.OK, host, file.body, file.kind, kept, file.scripts)
        answer = response(http.HTTPStatus.OK, host, file.packed, file.kind, kept)
        answer.headers["Content-Encoding"] = "gzip"
        return answer
