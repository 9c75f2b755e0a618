"""Serves ROS 2 services over Zenoh, as queryables for rmw_zenoh's clients.

The library's thread only passes queries on, and the simulation's thread only answers. Decoding and sending
have a thread of their own, because sending waits for a peer that does not take its answer.
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
"""Queries that wait for their answers; more are left without one."""

LARGEST_REQUEST = 1 << 24
LEAVE_SECONDS = 1.0

OfZenoh = Any
"""What the library gives and takes, which is not typed."""

Token = Callable[[str, str, str], OfZenoh]
"""Says that a service is there, by its name, `type_key` and quality."""


@dataclass(frozen=True, slots=True)
class Served:
    """A service in CDR: `call` asks it, and raises KbotError where that cannot be; `encode` writes what it
    responds."""

    name: str
    type_name: str
    type_hash: str
    call: Callable[[bytes], Future[Any]]
    encode: Callable[[Any], bytes]
    quality: str = VOLATILE


def served_of(link: PeerLink, service: Service) -> Served:
    """One of those that every bridge offers."""
    kind = service.type

    def call(payload: bytes) -> Future[Any]:
        return link.call(service.name, decode_cdr(payload, kind.request, kind.request_name))

    def encode(response: object) -> bytes:
        return encode_cdr(response, kind.response_name)

    return Served(service.name, kind.ros2_name, service_hash(kind.ros2_name), call, encode)


class ServiceServer:
    """Answers for a session; `offer` and `close` are called by one thread."""

    def __init__(self, session: OfZenoh, domain: int, token: Token, tell: Callable[[str], None]) -> None:
        self._session, self._domain, self._token, self._tell = session, domain, token, tell
        self._offered: dict[str, tuple[str, OfZenoh, OfZenoh]] = {}
        """By name: the type, the queryable and the token."""
        self._jobs: SimpleQueue[Callable[[], None] | None] = SimpleQueue()
        self._free = threading.BoundedSemaphore(MOST_QUERIES)
        self._thread = threading.Thread(target=self._run, daemon=True, name="kbot-zenoh-services")
        self._thread.start()

    def offer(self, services: Iterable[Served]) -> None:
        """Serve these, and no others; what is served already goes on."""
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
        """Answer nobody any more; the session's end takes the rest away."""
        self._jobs.put(None)
        self._thread.join(LEAVE_SECONDS)

    def _declare(self, service: Served) -> tuple[OfZenoh, OfZenoh]:
        kind = type_key(service.type_name, service.type_hash)
        key = topic_key(self._domain, service.name, kind)

        def take(query: OfZenoh) -> None:
            if self._free.acquire(blocking=False):
                self._jobs.put(partial(self._ask, service, key, query))
            else:
                self._tell(f"Zenoh: {MOST_QUERIES} calls of services wait already; more are not answered")
                query.drop()

        # without a thread for each service, which is what the library would make
        taking = zenoh.handlers.Callback(take, indirect=False)
        queryable = self._session.declare_queryable(key, taking, complete=True)
        return queryable, self._token(service.name, kind, service.quality)

    def _run(self) -> None:
        while (job := self._jobs.get()) is not None:
            job()

    def _ask(self, service: Served, key: str, query: OfZenoh) -> None:
        try:
            size = len(query.payload) if query.payload is not None else 0
            if size > LARGEST_REQUEST:
                raise KbotError(f"{service.name}: a request of {size} bytes is too large")
            future = service.call(query.payload.to_bytes() if size else b"")
        except Exception as error:  # noqa: BLE001 - one fault does not end the answering of all
            self._refuse(query, error)
            return
        future.add_done_callback(
            lambda done: self._jobs.put(partial(self._answer, service, key, query, done))
        )

    def _answer(self, service: Served, key: str, query: OfZenoh, done: Future[Any]) -> None:
        try:
            data = service.encode(done.result())
        except Exception as error:  # noqa: BLE001 - nor does one answer that cannot be written
            self._refuse(query, error)
            return
        self._end(query, partial(query.reply, key, data, attachment=_attachment(query)))

    def _refuse(self, query: OfZenoh, error: Exception) -> None:
        reason = str(error) if isinstance(error, KbotError) else FAULTS.fault("Zenoh: a service call", error)
        self._end(query, partial(query.reply_err, reason.encode(errors="replace")))

    def _end(self, query: OfZenoh, reply: Callable[[], None]) -> None:
        with suppress(zenoh.ZError):  # the caller is gone, or the session
            reply()
        query.drop()
        self._free.release()


def _attachment(query: OfZenoh) -> bytes | None:
    """What the caller sent along, by which it knows its answer again, with the time of now."""
    if query.attachment is None:
        return None
    given: bytes = query.attachment.to_bytes()
    if len(given) != ATTACHED.size:  # another layout, as rmw_zenoh before 0.2.4 had one
        return given
    number, _, length, mark = ATTACHED.unpack(given)
    return ATTACHED.pack(number, time.time_ns(), length, mark)
