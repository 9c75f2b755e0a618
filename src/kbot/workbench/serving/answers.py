"""The parts of an answer to a plain request."""

from __future__ import annotations

import http
from collections.abc import Iterable

from websockets.datastructures import Headers
from websockets.http11 import Response

from kbot.workbench.serving.access import security_headers

_TEXT = "text/plain; charset=utf-8"


def response(
    status: http.HTTPStatus,
    host: str,
    body: bytes,
    kind: str = _TEXT,
    kept: str = "no-store",
    scripts: Iterable[str] = (),
) -> Response:
    """A whole answer; `kind` is its media type, `kept` how long a browser may keep it, `scripts` the digests
    of those within it."""
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
