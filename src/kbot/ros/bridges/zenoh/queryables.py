"""Serves ROS 2 services over Zenoh, as queryables for rmw_zenoh's clients.

The library's thread only queues queries, and the simulation's thread only computes responses. Another thread
decodes and sends, because sending blocks while a peer does not read its response.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from queue import SimpleQueue
from typing import Any

import zenoh

from kbot.record.encodings.serialization import decode_cdr, encode_cdr
from kbot.ros.bridges.link import PeerLink
from kbot.ros.bridges.loop import FAULTS
from kbot.ros.bridges.service import Service
from kbot.ros.bridges.zenoh.names import ATTACHED, VOLATILE, topic_key, type_key
from kbot.ros.service_types import service_hash
from kbot.text import KbotError

MOST_QUERIES = 256
"""Queries that wait for a response. More get no response."""

LARGEST_REQUEST = 1 << 24
"""Bytes."""
LEAVE_SECONDS = 1.0
"""Seconds that `close` waits for a response that is being sent."""

OfZenoh = Any
"""An object of the Zenoh library, which has no type annotations."""

Token = Callable[[str, str, str], OfZenoh]
"""Declares a service's liveliness token from its name, `type_key` and QoS."""


@dataclass(frozen=True, slots=True)
class Served:
    """A service in CDR. `call` raises KbotError if the request is invalid, `encode` encodes the response."""

    name: str
    type_name: str
    type_hash: str
    call: Callable[[bytes], Future[Any]]
    encode: Callable[[Any], bytes]
    quality: str = VOLATILE


def served_of(link: PeerLink, service: Service) -> Served:
    """A service of the link, which every bridge offers."""
    kind = service.type

    def call(payload: bytes) -> Future[Any]:
        return link.call(service.name, decode_cdr(payload, kind.request, kind.request_name))

    def encode(response: object) -> bytes:
        return encode_cdr(response, kind.response_name)

    return Served(service.name, kind.ros2_name, service_hash(kind.ros2_name), call, encode)


class ServiceServer:
    """Serves the services of a session. `offer` and `close` must be called on the same thread."""

    def __init__(self, session: OfZenoh, domain: int, token: Token, report: Callable[[str], None]) -> None:
        self._session, self._domain, self._token, self._report = session, domain, token, report
        self._offered: dict[str, tuple[str, OfZenoh, OfZenoh]] = {}
        """By name: the type, the queryable and the token."""
        self._jobs: SimpleQueue[Callable[[], None] | None] = SimpleQueue()
        self._free = threading.BoundedSemaphore(MOST_QUERIES)
        self._thread = threading.Thread(target=self._run, daemon=True, name="kbot-zenoh-services")
        self._thread.start()

    def offer(self, services: Iterable[Served]) -> None:
        """Serve these services and no others. Those that are already served are not interrupted."""
        wanted = {service.name: service for service in services}
        for name, (kind, queryable, token) in tuple(self._offered.items()):
            if name not in wanted or wanted[name].type_name != kind:
                del self._offered[name]
                token.undeclare()
                queryable.undeclare()
        for name, service in wanted.items():
            if name not in self._offered:
                self._offered[name] = service.type_name, *self._declare(service)

    def close(self) -> None:
        """Stop answering. Closing the session removes the queryables."""
        self._jobs.put(None)
        self._thread.join(LEAVE_SECONDS)

    def _declare(self, service: Served) -> tuple[OfZenoh, OfZenoh]:
        kind = type_key(service.type_name, service.type_hash)
        key = topic_key(self._domain, service.name, kind)

        def on_query(query: OfZenoh) -> None:
            if self._free.acquire(blocking=False):
                self._jobs.put(partial(self._call, service, key, query))
            else:
                self._report(
                    f"Zenoh: {MOST_QUERIES} service calls are already waiting. More are not answered"
                )
                query.drop()

        # with `indirect`, the library would create a thread for each service
        handler = zenoh.handlers.Callback(on_query, indirect=False)
        queryable = self._session.declare_queryable(key, handler, complete=True)
        return queryable, self._token(service.name, kind, service.quality)

    def _run(self) -> None:
        while (job := self._jobs.get()) is not None:
            job()

    def _call(self, service: Served, key: str, query: OfZenoh) -> None:
        try:
            size = len(query.payload) if query.payload is not None else 0
            if size > LARGEST_REQUEST:
                raise KbotError(f"{service.name}: a request of {size} bytes is too large")
            future = service.call(query.payload.to_bytes() if size else b"")
        except Exception as error:  # noqa: BLE001 - one call must not end this thread
            self._refuse(query, error)
            return
        future.add_done_callback(
            lambda done: self._jobs.put(partial(self._answer, service, key, query, done))
        )

    def _answer(self, service: Served, key: str, query: OfZenoh, done: Future[Any]) -> None:
        try:
            data = service.encode(done.result())
        except Exception as error:  # noqa: BLE001 - one response must not end this thread
            self._refuse(query, error)
            return
        self._end(query, partial(query.reply, key, data, attachment=_attachment(query)))

    def _refuse(self, query: OfZenoh, error: Exception) -> None:
        reason = str(error) if isinstance(error, KbotError) else FAULTS.fault("Zenoh: a service call", error)
        self._end(query, partial(query.reply_err, reason.encode(errors="replace")))

    def _end(self, query: OfZenoh, reply: Callable[[], None]) -> None:
        with suppress(zenoh.ZError):  # the caller has disconnected, or the session is closed
            reply()
        query.drop()
        self._free.release()


def _attachment(query: OfZenoh) -> bytes | None:
    """The attachment of the response: that of the query with a new time. The caller identifies it by that."""
    if query.attachment is None:
        return None
    given: bytes = query.attachment.to_bytes()
    if len(given) != ATTACHED.size:  # rmw_zenoh before 0.2.4 had another layout
        return given
    number, _, length, gid = ATTACHED.unpack(given)
    return ATTACHED.pack(number, time.time_ns(), length, gid)
