"""The connected pages, each with the newest messages that it has not received yet."""

from __future__ import annotations

import asyncio
import itertools
from collections import deque
from collections.abc import Awaitable, Callable, Iterable, Iterator

from kbot.workbench.protocol import (
    Beat,
    FromPage,
    FromServer,
    Notice,
    Refused,
    RulePage,
    Scene,
    SourceConflict,
    SourceSaved,
    SourceText,
    State,
    Things,
    Timeline,
)
from kbot.workbench.protocol.codec import encode

MAX_PAGES = 500  # each page uses a file descriptor, and the limit of a process is often 1024

ROUNDS_IN_A_BEAT = 4
"""A beat is sent after this many rounds. A round is all messages that wait for a page at one time."""
_BEAT = encode(Beat())

_NOTICE = "notice:"
"""The start of the keys of notices and refusals."""

MAX_NOTICES = 50
"""Notices and refusals that wait for a page, each with another text: more than a user would read."""


class Client:
    """One page.

    Only the newest message of each kind waits for it, besides a few notices, and at most two unanswered beats
    are in flight. A slow page therefore drops frames, and no queue grows.
    """

    def __init__(self, number: int) -> None:
        self.number = number
        self.displayed_time: float | None = None
        """The earlier time that the page displays, or None for the present."""
        self.requested_time: float | None = None
        """The time that the page requested last."""
        self.scene: str | bytes = ""
        """The scene that the page received last while it displays an earlier time."""
        self.silent: tuple[str, ...] = ()
        """Topics without a message until that time."""
        self.timeline: Timeline | None = None
        """The timeline that was sent last."""
        self.orders: deque[FromPage] = deque()
        """Messages from the page that wait until a program lends the simulation."""
        self._waiting: dict[str, str | bytes] = {}
        self._news = asyncio.Event()
        self._beats = 0
        """The number of unanswered beats."""
        self._answers: asyncio.Event | None = None
        """Set when a beat is answered; None if the page never answers."""

    def put(self, message: FromServer, text: str | None = None) -> None:
        """Queue a message. It replaces an unsent one of the same kind, or a notice with the same text."""
        if isinstance(message, Notice | Refused):
            waiting = [key for key in self._waiting if key.startswith(_NOTICE)]
            if len(waiting) >= MAX_NOTICES:
                del self._waiting[waiting[0]]
        self._queue(_key(message), text if text is not None else encode(message))

    def put_timeline(self, timeline: Timeline) -> None:
        """Queue a timeline.

        Messages after it belong to the time in it. It therefore replaces an unsent timeline only if that
        shows the same time.
        """
        before, self.timeline = self.timeline, timeline
        key = _key(timeline)
        is_same = before is not None and (before.live, before.silent) == (timeline.live, timeline.silent)
        if is_same and key in self._waiting:
            self._waiting[key] = encode(timeline)
        else:
            self.put(timeline)

    def put_frame(self, key: str, frame: str | bytes) -> None:
        """Queue an encoded message. It replaces an unsent one with the same key."""
        self._queue(key, frame)

    def put_topic(self, topic: str, frame: str | bytes) -> None:
        """Queue a topic's newest message, encoded."""
        self._queue(f"topic:{topic}", frame)

    def _queue(self, key: str, frame: str | bytes) -> None:
        self._waiting.pop(key, None)
        self._waiting[key] = frame
        self._news.set()

    @property
    def is_behind(self) -> bool:
        """Whether messages wait to be sent."""
        return bool(self._waiting)

    async def pump(self, send: Callable[[str | bytes], Awaitable[None]]) -> None:
        """Send queued messages until cancelled."""
        for count in itertools.count(1):
            await self._news.wait()
            for _ in range(len(self._waiting)):
                key = next(iter(self._waiting))
                await send(self._waiting.pop(key))
            if not self._waiting:
                self._news.clear()
            if count % ROUNDS_IN_A_BEAT == 0:
                self._beats += 1
                await send(_BEAT)
                while self._answers is not None and self._beats > 1:
                    self._answers.clear()
                    await self._answers.wait()

    def count_answer(self) -> None:
        """Count the answer to a beat."""
        self._answers = self._answers or asyncio.Event()
        self._beats = max(0, self._beats - 1)
        self._answers.set()


def _key(message: FromServer) -> str:
    """Return the key of a message. A newer message with the same key replaces it."""
    match message:
        case SourceText(file=file) | SourceSaved(file=file) | SourceConflict(file=file):
            return f"{message.type}:{file}"
        case RulePage(code=code):
            return f"rule_page:{code}"
        case Notice(text=text) | Refused(reason=text):
            return f"{_NOTICE}{text}"
    return message.type


class Hub:
    """All connected pages."""

    def __init__(self) -> None:
        self._clients: dict[int, Client] = {}
        self._count = 0

    def __len__(self) -> int:
        return len(self._clients)

    def join(self) -> Client:
        self._count += 1
        client = self._clients[self._count] = Client(self._count)
        return client

    def leave(self, client: Client) -> None:
        self._clients.pop(client.number, None)

    def __iter__(self) -> Iterator[Client]:
        return iter(tuple(self._clients.values()))

    def publish(self, message: FromServer, text: str | None = None) -> None:
        """Queue a message for every page that should receive it. It is encoded once."""
        if not self._clients:
            return
        text = encode(message) if text is None else text
        is_of_now = isinstance(message, Scene | Things | State)
        for client in self._clients.values():
            if client.displayed_time is None or not is_of_now:
                client.put(message, text)

    def send_topic(self, topic: str, frame: str | bytes, pages: Iterable[int]) -> None:
        """Queue a topic's newest message for those of the `pages` that display the present."""
        for page in pages:
            client = self._clients.get(page)
            if client is not None and client.displayed_time is None:
                client.put_topic(topic, frame)
