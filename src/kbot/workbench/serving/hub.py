"""The connected pages, each with the newest messages that it has not received yet."""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Awaitable, Callable, Iterable, Iterator

from kbot.workbench.protocol import Beat, FromServer, Scene, SourceText, State, Things, Timeline
from kbot.workbench.protocol.codec import encode

MAX_PAGES = 500  # each takes a file descriptor, of which a process often has 1024

ROUNDS_IN_A_BEAT = 4
"""A round is all that waits for a page at one time."""
_BEAT = encode(Beat())


class Client:
    """One page. What waits for it is one message of each kind, and no more than two beats are under way to
    it, wherever on the way they are kept: a slow page drops frames and never grows a queue."""

    def __init__(self, number: int) -> None:
        self.number = number
        self.looks_at: float | None = None
        """The moment that it is shown of what was, None where it is shown what is."""
        self.asked: float | None = None
        """The moment that it asked for last."""
        self.scene: str | bytes = ""
        """The scene it was shown last, while it looks back."""
        self.silent: tuple[str, ...] = ()
        """Topics that had said nothing until that moment."""
        self.timeline: Timeline | None = None
        """What it was told of time."""
        self._waiting: dict[str, str | bytes] = {}
        self._news = asyncio.Event()
        self._beats = 0
        """That are not answered."""
        self._answers: asyncio.Event | None = None
        """Set when one is; None where the page answers none."""

    def put(self, message: FromServer, text: str | None = None) -> None:
        """Queue a message; an older one of its kind that was not sent yet is dropped."""
        self._queue(_key(message), text if text is not None else encode(message))

    def put_time(self, timeline: Timeline) -> None:
        """Queue what there is to go back to. What is said after it is of the moment that it tells of, so one
        that tells of the same moment takes the place of the one that waits."""
        before, self.timeline = self.timeline, timeline
        key = _key(timeline)
        is_same = before is not None and (before.live, before.silent) == (timeline.live, timeline.silent)
        if is_same and key in self._waiting:
            self._waiting[key] = encode(timeline)
        else:
            self.put(timeline)

    def put_frame(self, key: str, frame: str | bytes) -> None:
        """Queue a message that is encoded, by what it is newer of."""
        self._queue(key, frame)

    def put_topic(self, topic: str, frame: str | bytes) -> None:
        """Queue a topic's newest message, encoded."""
        self._queue(f"topic:{topic}", frame)

    def _queue(self, key: str, frame: str | bytes) -> None:
        self._waiting.pop(key, None)
        self._waiting[key] = frame
        self._news.set()

    async def pump(self, send: Callable[[str | bytes], Awaitable[None]]) -> None:
        """Send what waits, for ever."""
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

    def heard(self) -> None:
        """The page has answered a beat."""
        self._answers = self._answers or asyncio.Event()
        self._beats = max(0, self._beats - 1)
        self._answers.set()


def _key(message: FromServer) -> str:
    """What a message is newer of."""
    match message:
        case SourceText(file=file):
            return f"source:{file}"
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
        """Queue a message for every page that it is for; it is encoded once."""
        if not self._clients:
            return
        text = encode(message) if text is None else text
        is_of_now = isinstance(message, Scene | Things | State)
        for client in self._clients.values():
            if client.looks_at is None or not is_of_now:
                client.put(message, text)

    def hand_out(self, topic: str, frame: str | bytes, pages: Iterable[int]) -> None:
        """Queue a topic's newest message for those pages that hear it and look at what is."""
        for page in pages:
            client = self._clients.get(page)
            if client is not None and client.looks_at is None:
                client.put_topic(topic, frame)
