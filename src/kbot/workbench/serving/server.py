"""The page and its socket on one port: GET for files and meshes, `/ws` for messages."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import logging
import socket
import time
from collections.abc import Iterator

from websockets.asyncio.server import Server as SocketServer
from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed
from websockets.frames import CloseCode

from kbot.net.socket_log import socket_logger
from kbot.record.encodings.types import ros2_types
from kbot.text import KbotError
from kbot.text.complaints import Complaints
from kbot.workbench.protocol import (
    AskSeries,
    AskTrail,
    BeatReply,
    DrawPlot,
    Drive,
    FromPage,
    GoLive,
    Mark,
    NoteMark,
    OpenSource,
    Publish,
    Refused,
    RemoveMark,
    Resume,
    Seek,
    Subscribe,
    Topics,
    Unsubscribe,
)
from kbot.workbench.protocol.codec import MAX_MESSAGE, BadMessage, decode
from kbot.workbench.serving.access import Access
from kbot.workbench.serving.file_watcher import Watcher
from kbot.workbench.serving.hub import MAX_PAGES, Client, Hub
from kbot.workbench.serving.page_files import PageFiles
from kbot.workbench.serving.past import Past
from kbot.workbench.serving.plotting import Plotting
from kbot.workbench.session.session import Session

log = logging.getLogger(__name__)

FRAME_SECONDS = 1 / 60
STATE_SECONDS = 1 / 50
UNSEEN_SECONDS = 1 / 10
"""Between two states that are kept of what no page sees."""
TOPICS_SECONDS = 1.0
TIMELINE_SECONDS = 0.25
SIGNS_OF_LIFE = 4
"""Every so many times that time is looked at it is told of where nothing is new: pages know by it that the
server does not hang."""
CLOSING_SECONDS = 1.0
"""How long pages have to take leave."""
AFTER_FAULT_SECONDS = 1.0
"""Before what failed within is tried again."""
_CHANGE_NOTHING = (
    OpenSource
    | Drive
    | Subscribe
    | Unsubscribe
    | Publish
    | GoLive
    | AskSeries
    | AskTrail
    | DrawPlot
    | Mark
    | NoteMark
    | RemoveMark
    | BeatReply
)
"""What pages ask for that is answered, or seen when time passes."""


class Server:
    """Serves one session to any number of pages, until it is closed."""

    def __init__(self, session: Session, access: Access) -> None:
        self.session = session
        self.access = access
        self.hub = Hub()
        self.past = Past(session, self.hub)
        self._complaints = Complaints(log)
        self._plotting = Plotting(self.past, self._complaints)
        self._files = PageFiles(session, access, self._complaints)
        self._changed = True
        self._topics: Topics | None = None
        self._reading = asyncio.Lock()
        session.announce = self.hub.publish

    async def run(self, listening: socket.socket) -> None:
        """Serve on a bound socket until cancelled."""
        asyncio.get_running_loop().set_exception_handler(self._complaints.loop_fault)
        sockets = await serve(
            self._page_connected,
            sock=listening,
            process_request=self._files.answer,
            compression=None,
            close_timeout=CLOSING_SECONDS,  # of a page that does not answer
            max_size=MAX_MESSAGE,
            max_queue=8,
            server_header=None,
            logger=socket_logger(self._complaints),
        )
        try:
            async with asyncio.TaskGroup() as tasks:
                tasks.create_task(self._keep_time())
                tasks.create_task(self._tell_topics())
                tasks.create_task(self._tell_time())
                tasks.create_task(self._follow_files())
                tasks.create_task(self._follow_page())
                try:
                    await self._until_closed(sockets)
                finally:
                    self.session.recording.end()
        finally:
            sockets.close()
            with contextlib.suppress(TimeoutError):  # a browser may hold one open that asks for nothing
                async with asyncio.timeout(CLOSING_SECONDS):
                    await sockets.wait_closed()

    async def _until_closed(self, sockets: SocketServer) -> None:
        await sockets.wait_closed()

    async def _page_connected(self, connection: ServerConnection) -> None:
        if len(self.hub) >= MAX_PAGES:
            await connection.close(CloseCode.TRY_AGAIN_LATER, f"{MAX_PAGES} pages are open")
            return
        client = self.hub.join()
        session = self.session
        for message in session.greeting(client.number):
            client.put(message)
        if self._topics is not None:  # as they are now: while there was no page nobody looked
            client.put(session.topics.topics())
        pump = asyncio.create_task(client.pump(connection.send))
        try:
            async for data in connection:
                self._hear(client, data)
        except ConnectionClosed:
            pass
        finally:
            pump.cancel()
            with contextlib.suppress(asyncio.CancelledError, ConnectionClosed):
                await pump
            self.hub.leave(client)
            self._plotting.leave(client)
            session.leave(client.number)
            self._changed = True

    def _hear(self, client: Client, data: str | bytes) -> None:
        message: FromPage | None = None
        try:
            message = decode(data)
            if isinstance(message, Seek):
                client.asked = message.at
            match message:
                case BeatReply():
                    client.heard()
                case Subscribe(topic=topic):
                    self._subscribe(client, topic)
                case Unsubscribe(topic=topic):
                    self.session.topics.unsubscribe(topic, client.number)
                case Seek(at=at) if self.session.mode == "sim":
                    self.past.seek(client, at)
                case GoLive():
                    self.past.go_live(client)
                case Resume():
                    self.past.resume(client)
                case AskSeries() | AskTrail() | DrawPlot():
                    self._plotting.ask(client, message)
                case Mark() | NoteMark() | RemoveMark():
                    self.session.marks.obey(message)
                    self.hub.publish(self.session.marks.view)
                case _:
                    for answer in self.session.obey(message, client.number):
                        client.put(answer)
        except KbotError as error:
            if isinstance(error, BadMessage):
                self._complaints.add(f"page {client.number}: {error}")
            client.put(Refused(str(error)))
        except Exception as error:  # noqa: BLE001 - one fault does not end the server
            what = message.type if message is not None else "a message of a page"
            client.put(Refused(self._complaints.fault(what, error)))
        if not isinstance(message, _CHANGE_NOTHING):
            self._changed = True

    def _subscribe(self, client: Client, topic: str) -> None:
        frame = self.session.topics.subscribe(topic, client.number)
        if client.looks_at is not None:
            self.past.seek(client, client.looks_at)
        elif frame is not None:
            client.put_topic(topic, frame)

    async def _keep_time(self) -> None:
        """Let simulated time follow wall time, and tell of each new state at most fifty times a second, for
        later also where no page sees it."""
        before = sent = time.monotonic()
        while True:
            await asyncio.sleep(FRAME_SECONDS)
            now = time.monotonic()
            self._changed |= self._advance(min(now - before, 0.1))
            before = now
            with self._surviving("sending the state"):
                apart = STATE_SECONDS if len(self.hub) else UNSEEN_SECONDS
                if self._changed and now - sent >= apart - FRAME_SECONDS / 2:
                    self._changed, sent = False, now
                    self.past.tell_state(self.session.state())
                for topic, frame, pages in self.session.topics.news():
                    self.past.tell_topic(topic, frame, pages)

    async def _tell_topics(self) -> None:
        """Say once a second which topics there are, where that changed."""
        while True:
            await asyncio.sleep(TOPICS_SECONDS)
            with self._surviving("listing topics"):
                await asyncio.to_thread(ros2_types)  # takes a while the first time
                if len(self.hub) and (topics := self.session.topics.topics()) != self._topics:
                    self._topics = topics
                    self.hub.publish(topics)

    async def _tell_time(self) -> None:
        """Say to each page what there is to go back to, and how a recording grows."""
        for count in itertools.count(1):
            await asyncio.sleep(TIMELINE_SECONDS)
            with self._surviving("sending the timeline"):
                failure = self.session.recording.take_failure()
                if failure is not None:
                    self.hub.publish(Refused(str(failure)))
                for client in self.hub:
                    self.past.tell_time(client, again=count % SIGNS_OF_LIFE == 0)
                if (recorded := self.session.recording.take_ended()) is not None:
                    self.hub.publish(recorded)

    def _advance(self, wall_seconds: float) -> bool:
        with self._surviving("the run"):
            try:
                return self.session.advance(wall_seconds)
            except KbotError as error:
                log.error("%s", error)
                self.hub.publish(Refused(str(error)))
        self.session.paused = True
        return True

    @contextlib.contextmanager
    def _surviving(self, doing: str) -> Iterator[None]:
        """Report an unforeseen error to every page, and go on: it ends neither the server nor a recording."""
        try:
            yield
        except Exception as error:  # noqa: BLE001 - reported, and survived
            self.hub.publish(Refused(self._complaints.fault(doing, error)))

    async def _follow_files(self) -> None:
        """Show the description anew each time one of its files changes."""
        shown = self.session.shown
        watcher = Watcher(shown.watched, shown.began)
        while True:
            try:
                await watcher.changed()
            except Exception as error:  # noqa: BLE001 - logged, and the files are watched again
                self._complaints.fault("watching the files", error)
                await asyncio.sleep(AFTER_FAULT_SECONDS)
                continue
            await self._read_anew()
            watcher.watch(shown.watched, shown.began)

    async def _follow_page(self) -> None:
        """Show the description anew when a page changed it; of many changes at once the last is shown."""
        wanted = asyncio.Event()
        self.session.wants_reading = wanted.set
        while True:
            await wanted.wait()
            wanted.clear()
            await self._read_anew()

    async def _read_anew(self) -> None:
        async with self._reading:
            with self._surviving("reading the description anew"):
                await self._take_reading()

    async def _take_reading(self) -> None:
        try:
            reading = await asyncio.to_thread(self.session.read)
        except KbotError as error:  # the configuration of the checks, which is no part of the robot
            self.hub.publish(Refused(str(error)))
            return
        known = self.session.missing_meshes()
        for message in self.session.adopt(reading):
            self.hub.publish(message)
        for missing in self.session.missing_meshes():
            if missing not in known:
                log.warning("%s", missing)
