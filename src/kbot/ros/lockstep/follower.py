"""Follower: the node's side of lockstep. It waits for each tick, and answers it."""

from __future__ import annotations

import faulthandler
import signal
import time
from collections.abc import Callable
from functools import partial
from typing import Protocol

from kbot.messages import Bus
from kbot.record.encodings.type_names import ros_name
from kbot.ros.lockstep.channel import ChannelClosed, Message, connect
from kbot.ros.lockstep.link import Connections, LockstepLink
from kbot.text import KbotError

WAIT_SECONDS = 600.0
"""Seconds to wait for messages and connections. The simulation has a shorter limit, and ends the program."""
DUMP_SIGNAL: int | None = getattr(signal, "SIGUSR1", None)
"""Makes the node print which line runs, for the error about a node that does not answer. Windows has none."""
_addresses: list[str] = []
"""Those to which this process has connected."""


class Transport(Connections, Protocol):
    """The transport of the node."""

    @property
    def identity(self) -> str:
        """The `source` of this node's messages at the links of its peers."""
        ...


class Follower:
    """Follows the ticks of the simulation at an address of `channel.VARIABLE`."""

    def __init__(self, address: str, link: LockstepLink, bus: Bus) -> None:
        """Raises KbotError: no simulation answers at the address, or this program has another node."""
        if _addresses:
            raise KbotError("in a trial, a program can have one node only. Use one node, or two programs")
        _addresses.append(address)
        try:
            self._channel, token = connect(address)
            self._channel.send("open", token=token)
        except (OSError, ValueError, ChannelClosed):
            raise KbotError("the simulation that started this program has ended") from None
        self._link, self._bus = link, bus
        self._published: list[str] = []
        """The topics of the messages since the last answer, in order."""
        self._topics: dict[str, bool] = {}
        """The connected topics, and whether the node publishes on them."""
        self.has_ended = False
        """Whether the run is over."""
        if DUMP_SIGNAL is not None:
            faulthandler.register(DUMP_SIGNAL, all_threads=False)

    def join(self, name: str, kind: str, transport: Transport) -> int:
        """Introduce the node. Returns the simulated time in ns.

        Raises:
            KbotError: the simulation refuses it.
        """
        self._transport = transport
        self._send("hello", name=name, transport=kind, identity=transport.identity)
        welcome = self._receive()
        if "error" in welcome:
            self.has_ended = True
            raise KbotError(str(welcome["error"]))
        self._link.sources.add(str(welcome["simulation"]))
        now: int = welcome["now"]
        return now

    def connect(self, topic: str, kind: type, *, publishes: bool, latched: bool = False) -> None:
        """Wait until a topic is connected to its peers, so that no message of it is lost.

        Raises:
            KbotError: the topic does not exist, or has another type.
        """
        if topic in self._topics or self.has_ended:
            return
        self._topics[topic] = publishes
        type_name = ros_name(kind)
        self._send("connect", topic=topic, type=type_name, publishes=publishes, latched=latched)
        answer = self._receive()
        if answer["op"] == "connecting":
            # these keep the topic connected: a connection that comes and goes would not be in step
            if publishes:
                self._bus.advertise(topic, kind)
                self._bus.subscribe(topic, kind, lambda message: self._published.append(topic), passive=True)
            else:
                self._bus.subscribe(topic, kind, lambda message: None)
            self._link.serve()
            answer = self._receive()
        self._answer(answer)
        if "error" in answer:
            raise KbotError(str(answer["error"]))
        if not self.has_ended:
            self._wait_for_peers({topic: answer["peers"]})

    def finish_tick(self) -> None:
        """Report that everything for the current tick is done."""
        self._send("done", messages=self._take_published())

    def next_tick(self) -> Message | None:
        """Wait for the next tick. None if the run is over. Raises KbotError: the simulation has exited."""
        while not self.has_ended:
            message = self._receive()
            if message["op"] == "tick":
                return message
            self._answer(message)
        return None

    def run_tick(self, tick: Message, move_to: Callable[[int], None], is_over: Callable[[], bool]) -> None:
        """Deliver the messages of a tick in order. `move_to` sets the node's clock, before each and at last.

        Raises:
            KbotError: a message is missing.
        """
        for nanoseconds, topic, source in tick["messages"]:
            if is_over():
                return
            if self._link.deliver_next(topic, source, WAIT_SECONDS, partial(move_to, nanoseconds)) is None:
                raise KbotError(f"a message on {topic} did not arrive")
        if not is_over():
            self._link.serve()  # messages of others, which are not in lockstep
            move_to(tick["now"])

    def close(self) -> None:
        """Report the last messages, and wait until the simulation has them. The transport is still open."""
        if self.has_ended:
            self._channel.close()
            return
        try:
            self._channel.send("bye", messages=self._take_published())
            while not self.has_ended:
                self._answer(self._receive())
        except (ChannelClosed, KbotError):
            pass  # the simulation has exited
        finally:
            self.has_ended = True
            self._channel.close()

    def _take_published(self) -> list[str]:
        published, self._published = self._published, []
        return published

    def _answer(self, message: Message) -> None:
        if message["op"] == "check":
            self._wait_for_peers(message["topics"])
            self._send("checked")
        elif message["op"] == "end":
            self.has_ended = True

    def _wait_for_peers(self, peers: dict[str, list[str]]) -> None:
        wanted = [(topic, peer, self._topics[topic]) for topic, found in peers.items() for peer in found]
        self._link.sources.update(peer for _, peer, _ in wanted)
        end = time.monotonic() + WAIT_SECONDS

        def is_waiting() -> None:
            if time.monotonic() > end:
                raise KbotError("the topics of this node could not be connected")

        self._link.wait_for_peers(self._transport, wanted, is_waiting)

    def _send(self, op: str, **fields: object) -> None:
        try:
            self._channel.send(op, **fields)
        except ChannelClosed:
            raise KbotError("KBot has closed the connection") from None

    def _receive(self) -> Message:
        try:
            message = self._channel.receive()
        except ChannelClosed:
            raise KbotError("KBot has closed the connection") from None
        if message is None:
            raise KbotError("KBot has closed the connection")
        return message
