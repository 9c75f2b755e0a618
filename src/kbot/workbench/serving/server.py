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
from kbot.workbench.driving.program import Program
from kbot.workbench.driving.turns import GREETING_SECONDS, POLL_SECONDS
from kbot.workbench.protocol import (
    AskRule,
    AskSeries,
    AskTrail,
    BeatReply,
    CheckTexts,
    DrawPlot,
    Drive,
    FromPage,
    FromServer,
    GoLive,
    Mark,
    NoteMark,
    OpenSource,
    Publish,
    Refused,
    RemoveMark,
    Resume,
    Seek,
    Stop,
    Subscribe,
    Topics,
    Unsubscribe,
)
from kbot.workbench.protocol.codec import MAX_TEXT_MESSAGE, BadMessage, decode, encode
from kbot.workbench.serving.access import Access
from kbot.workbench.serving.checking import Checking
from kbot.workbench.serving.daemon_thread import on_daemon_thread
from kbot.workbench.serving.file_watcher import Watcher
from kbot.workbench.serving.hub import MAX_PAGES, Client, Hub
from kbot.workbench.serving.page_files import PageFiles
from kbot.workbench.serving.past import Past
from kbot.workbench.serving.plotting import Plotting
from kbot.workbench.session.session import Session
from kbot.workbench.source.description import DescriptionReading

log = logging.getLogger(__name__)

FRAME_SECONDS = 1 / 60
"""Seconds between two steps of the simulation."""
STATE_SECONDS = 1 / 50
"""Least seconds between two states that are sent."""
UNSEEN_SECONDS = 1 / 10
"""Seconds between two states that are kept while no page is open."""
TOPICS_SECONDS = 1.0
"""Seconds between two checks of the list of topics."""
PROGRAM_SECONDS = 0.1
"""Seconds between two looks at the user's program."""
IMPORTS_SECONDS = 1.0
"""Seconds between two looks at the modules that the user's program has imported."""
TIMELINE_SECONDS = 0.25
"""Seconds between two checks of the timeline."""
SIGNS_OF_LIFE = 4
"""The timeline is sent unchanged every so many checks, so that pages notice a hanging server."""
CLOSING_SECONDS = 1.0
"""Seconds that pages have to close their connection."""
WARM_UP_SECONDS = 2.0
"""Seconds until the worker reads the description once, so that the first change is shown as fast as later
ones. Before that, the first picture needs the processor."""
AFTER_FAULT_SECONDS = 1.0
"""Seconds before a failed task is tried again."""
MOST_ORDERS = 200
"""Messages of a page that wait while another thread uses the simulation: those of ten seconds of driving."""
_CHANGE_NOTHING = (
    OpenSource
    | CheckTexts
    | AskRule
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
)
"""Messages that change no state, or only as time passes."""


class Server:
    """Serves one session to any number of pages, until it is closed."""

    def __init__(self, session: Session, access: Access) -> None:
        self.session = session
        self.access = access
        self.hub = Hub()
        self.past = Past(session, self.hub)
        self._complaints = Complaints(log)
        self._plotting = Plotting(self.past, self._complaints)
        self._checking = Checking(session, self._complaints)
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
            close_timeout=CLOSING_SECONDS,  # for a page that does not answer
            max_size=MAX_TEXT_MESSAGE,
            max_queue=8,
            server_header=None,
            logger=socket_logger(self._complaints),
        )
        try:
            async with asyncio.TaskGroup() as tasks:
                tasks.create_task(self._keep_time())
                tasks.create_task(self._send_topics())
                tasks.create_task(self._send_timeline())
                tasks.create_task(self._send_program())
                tasks.create_task(self._follow_program())
                tasks.create_task(self._follow_files())
                tasks.create_task(self._follow_page())
                tasks.create_task(self._warm_up())
                tasks.create_task(self._checking.run())
                try:
                    await self._until_closed(sockets)
                finally:
                    self.session.recording.end()
        finally:
            await self._send_last()
            sockets.close()
            with contextlib.suppress(TimeoutError):  # a browser may keep an idle connection open
                async with asyncio.timeout(CLOSING_SECONDS):
                    await sockets.wait_closed()

    async def _until_closed(self, sockets: SocketServer) -> None:
        await sockets.wait_closed()

    async def _send_last(self) -> None:
        """Send how the user's program ended, and its last state, before the connections are closed."""
        if self.session.program is None:
            return
        self.hub.publish(self.session.program.view())
        async with self.session.turns.within(CLOSING_SECONDS) as is_lent:
            if is_lent:
                with self._surviving("sending the state"):
                    self._send_state()
                    self._send_topic_news(is_last=True)
        with contextlib.suppress(TimeoutError):  # of a page that does not answer
            async with asyncio.timeout(CLOSING_SECONDS):
                while any(client.is_behind for client in self.hub):
                    await asyncio.sleep(POLL_SECONDS)

    async def _page_connected(self, connection: ServerConnection) -> None:
        if len(self.hub) >= MAX_PAGES:
            await connection.close(CloseCode.TRY_AGAIN_LATER, f"{MAX_PAGES} pages are open")
            return
        session = self.session
        async with session.turns.within(GREETING_SECONDS) as is_lent:
            client = self.hub.join()
            for message in session.greeting(client.number, is_lent=is_lent):
                client.put(message)
            if self._topics is not None and is_lent:
                # the current list: it is not updated while no page is open
                client.put(session.topics.topics())
        pump = asyncio.create_task(client.pump(connection.send))
        try:
            async for data in connection:
                self._take(client, data)
        except ConnectionClosed:
            pass
        finally:
            pump.cancel()
            with contextlib.suppress(asyncio.CancelledError, ConnectionClosed):
                await pump
            self.hub.leave(client)
            self._plotting.leave(client)
            self._checking.leave(client)
            async with session.turns:
                session.leave(client.number)
            self._changed = True

    def _take(self, client: Client, data: str | bytes) -> None:
        """Carry out a page's message at once, or when the program next lends the simulation."""
        try:
            message = decode(data)
        except BadMessage as error:
            self._complaints.add(f"page {client.number}: {error}")
            client.put(Refused(str(error)))
            self._changed = True
            return
        if isinstance(message, BeatReply):
            client.count_answer()
            return
        program, turns = self.session.program, self.session.turns
        if isinstance(message, Stop) and program is not None:
            program.stop()
        if not client.orders and not isinstance(message, OpenSource) and turns.try_take():
            try:
                self._receive(client, message)
            finally:
                turns.give_back()
        elif len(client.orders) < MOST_ORDERS:
            client.orders.append(message)
        else:
            client.put(Refused(self._why_busy(program)))

    @staticmethod
    def _why_busy(program: Program | None) -> str:
        if program is None or not program.is_running:
            return "KBot is still busy with earlier messages of this page. Try again"
        return f"{program.name} computes and does not call sim.run. Press Space to stop it"

    def _receive(self, client: Client, message: FromPage) -> None:
        with self._answering(client, message):
            if isinstance(message, Seek):
                client.requested_time = message.at
            match message:
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
                    self._plotting.request_plot(client, message)
                case CheckTexts():
                    self._checking.request(client, message)
                case Mark() | NoteMark() | RemoveMark():
                    self.session.marks.handle(message)
                    self.hub.publish(self.session.marks.view)
                case _:
                    for answer in self.session.handle(message, client.number):
                        client.put(answer)
        if not isinstance(message, _CHANGE_NOTHING):
            self._changed = True

    async def _open_source(self, client: Client, message: OpenSource) -> None:
        """Send a file's text. On another thread: it takes seconds for the first file of a large robot."""
        with self._answering(client, message):
            for answer, text in await on_daemon_thread(self._encoded, message, client.number):
                client.put(answer, text)

    def _encoded(self, message: FromPage, client: int) -> list[tuple[FromServer, str]]:
        return [(answer, encode(answer)) for answer in self.session.handle(message, client)]

    @contextlib.contextmanager
    def _answering(self, client: Client, message: FromPage) -> Iterator[None]:
        """Answer a message that cannot be handled with the reason. A fault does not end the server."""
        try:
            yield
        except KbotError as error:
            client.put(Refused(str(error)))
        except Exception as error:  # noqa: BLE001 - logged, and answered
            client.put(Refused(self._complaints.fault(message.type, error)))

    def _subscribe(self, client: Client, topic: str) -> None:
        frame = self.session.topics.subscribe(topic, client.number)
        if client.displayed_time is not None:
            self.past.seek(client, client.displayed_time)
        elif frame is not None:
            client.put_topic(topic, frame)

    async def _keep_time(self) -> None:
        """Advance simulated time with wall-clock time, and send new states at most fifty times a second.

        While no page is open, states are only kept for later.
        """
        before = sent = time.monotonic()
        while True:
            await asyncio.sleep(FRAME_SECONDS)
            async with self.session.turns:
                now = time.monotonic()
                for client in self.hub:
                    while client.orders:
                        message = client.orders.popleft()
                        if isinstance(message, OpenSource):
                            await self._open_source(client, message)
                            break  # so that a page that sends many does not stop the simulation
                        self._receive(client, message)
                self._changed |= self._advance(min(now - before, 0.1))
                before = now
                with self._surviving("sending the state"):
                    apart = STATE_SECONDS if len(self.hub) else UNSEEN_SECONDS
                    if self._changed and now - sent >= apart - FRAME_SECONDS / 2:
                        self._changed, sent = False, now
                        self._send_state()
                    self._send_topic_news()

    def _send_state(self) -> None:
        self.past.send_state(self.session.state())

    def _send_topic_news(self, *, is_last: bool = False) -> None:
        for topic, frame, pages in self.session.topics.news(is_last=is_last):
            self.past.send_topic(topic, frame, pages)

    async def _send_topics(self) -> None:
        """Send the list of topics if it has changed, once a second."""
        while True:
            await asyncio.sleep(TOPICS_SECONDS)
            with self._surviving("listing topics"):
                await asyncio.to_thread(ros2_types)  # takes a while the first time
                async with self.session.turns:
                    topics = self.session.topics.topics() if len(self.hub) else self._topics
                if topics is not None and topics != self._topics:
                    self._topics = topics
                    self.hub.publish(topics)

    async def _send_timeline(self) -> None:
        """Send the timeline to each page, with the size of a running recording."""
        for count in itertools.count(1):
            await asyncio.sleep(TIMELINE_SECONDS)
            with self._surviving("sending the timeline"):
                failure = self.session.recording.take_failure()
                if failure is not None:
                    self.hub.publish(Refused(str(failure)))
                for client in self.hub:
                    self.past.send_timeline(client, again=count % SIGNS_OF_LIFE == 0)
                if (recorded := self.session.recording.take_ended()) is not None:
                    self.hub.publish(recorded)

    async def _send_program(self) -> None:
        """Send what the user's program does, also while it computes."""
        program, sent = self.session.program, None
        while program is not None:
            if (view := program.view()) != sent:
                sent = view
                self.hub.publish(view)
            await asyncio.sleep(PROGRAM_SECONDS)

    async def _follow_program(self) -> None:
        """Start the user's program again when one of its files changes."""
        program = self.session.program
        if program is None:
            return
        watcher = Watcher(program.files(), program.began)
        while True:
            try:
                with contextlib.suppress(TimeoutError):
                    async with asyncio.timeout(IMPORTS_SECONDS):
                        await watcher.changed()
                        program.restart()
                watcher.watch(program.files(), program.began)
            except Exception as error:  # noqa: BLE001 - logged, then watched again
                self._complaints.fault("watching the program", error)
                await asyncio.sleep(AFTER_FAULT_SECONDS)

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
        """Report an unexpected error to every page and continue. It ends neither the server nor a
        recording."""
        try:
            yield
        except Exception as error:  # noqa: BLE001 - reported to the pages
            self.hub.publish(Refused(self._complaints.fault(doing, error)))

    async def _follow_files(self) -> None:
        """Display the description again when one of its files changes."""
        shown = self.session.shown
        watcher = Watcher(shown.watched, shown.began)
        while True:
            try:
                await watcher.changed()
            except Exception as error:  # noqa: BLE001 - logged, then watched again
                self._complaints.fault("watching the files", error)
                await asyncio.sleep(AFTER_FAULT_SECONDS)
                continue
            await self._read_again()
            watcher.watch(shown.watched, shown.began)

    async def _warm_up(self) -> None:
        await asyncio.sleep(WARM_UP_SECONDS)
        if self.session.shown.watched:
            # an error in the configuration of the checks is reported with the next reading
            with self._surviving("starting the worker"), contextlib.suppress(KbotError):
                await on_daemon_thread(self.session.read)

    async def _follow_page(self) -> None:
        """Display the description again when a page changes it. After many changes only the last is read."""
        wanted = asyncio.Event()
        self.session.wants_reading = wanted.set
        while True:
            await wanted.wait()
            wanted.clear()
            await self._read_again()

    async def _read_again(self) -> None:
        async with self._reading:
            with self._surviving("reading the description again"):
                await self._take_reading()

    async def _take_reading(self) -> None:
        try:
            reading = await on_daemon_thread(self.session.read)
        except KbotError as error:  # an error in the configuration of the checks, not in the robot
            self.hub.publish(Refused(str(error)))
            return
        known = self.session.missing_meshes()
        async with self.session.turns:
            messages = await on_daemon_thread(self._adopted, reading)
        for message, text in messages:
            self.hub.publish(message, text)
        for missing in self.session.missing_meshes():
            if missing not in known:
                log.warning("%s", missing)

    def _adopted(self, reading: DescriptionReading) -> list[tuple[FromServer, str]]:
        """Use a new reading, and return the messages about it, encoded. On another thread: the scene and the
        physics of a large robot take seconds, in which pages get answers."""
        return [(message, encode(message)) for message in self.session.adopt(reading)]
