"""Check the unsaved texts of pages, one at a time on another thread."""

from __future__ import annotations

import asyncio

from kbot.text import KbotError
from kbot.text.complaints import Complaints
from kbot.workbench.protocol import CheckTexts, FromServer, Refused
from kbot.workbench.serving.daemon_thread import on_daemon_thread
from kbot.workbench.serving.hub import Client
from kbot.workbench.session.session import Session

MOST_WAITING = 16
"""Pages whose texts wait for a check, at up to 7 MiB each. Further requests replace the oldest."""


class Checking:
    """Answers each page's newest request, one at a time. Pages take turns."""

    def __init__(self, session: Session, complaints: Complaints) -> None:
        self._session, self._complaints = session, complaints
        self._waiting: dict[int, tuple[Client, CheckTexts]] = {}
        self._news = asyncio.Event()

    def request(self, client: Client, message: CheckTexts) -> None:
        """Check these texts. A newer request replaces one that waits."""
        self._waiting[client.number] = client, message
        if len(self._waiting) > MOST_WAITING:
            del self._waiting[next(iter(self._waiting))]
        self._news.set()

    def leave(self, client: Client) -> None:
        """Forget the request of a page that has disconnected."""
        self._waiting.pop(client.number, None)

    async def run(self) -> None:
        """Answer requests until cancelled."""
        while True:
            await self._news.wait()
            self._news.clear()
            while self._waiting:
                client, message = self._waiting.pop(next(iter(self._waiting)))
                client.put(await self._answer(message))

    async def _answer(self, message: CheckTexts) -> FromServer:
        try:
            return await on_daemon_thread(self._session.shown.check, message)
        except KbotError as error:
            return Refused(str(error))
        except Exception as error:  # noqa: BLE001 - a failing check does not end the server
            return Refused(self._complaints.fault(message.type, error))
