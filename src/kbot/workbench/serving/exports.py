"""What can be taken out of the page: the robot as it stands, as a file."""

from __future__ import annotations

import asyncio
import http

from websockets.http11 import Response

from kbot.workbench.serving.answers import response
from kbot.workbench.session.session import Session

EXPORTS = {"/export/robot.glb": "model/gltf-binary", "/export/robot.html": "application/octet-stream"}
"""Media types; the page's HTML is to be saved, not opened beside the page."""


async def exported(session: Session, path: str, host: str) -> Response:
    """One of `EXPORTS`, made on another thread."""
    robot, positions = session.standing()
    if path == "/export/robot.glb":
        from kbot.render.glb import glb

        body = await asyncio.to_thread(glb, robot, positions)
    else:
        from kbot.workbench.saved_page import saved_page

        body = (await asyncio.to_thread(saved_page, session, robot)).encode()
    return response(http.HTTPStatus.OK, host, body, EXPORTS[path])


def described(path: str, host: str) -> Response:
    """The answer without the file, whose length is not known before it is made."""
    answer = response(http.HTTPStatus.OK, host, b"", EXPORTS[path])
    del answer.headers["Content-Length"]
    return answer
