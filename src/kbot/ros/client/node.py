"""The node class: publish, subscribe, timers and parameters, over the transport that is available."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any, TypeVar

from kbot.messages import Bus, Clock, ClockMessage, Publisher, Subscription, Timer
from kbot.record.feed import Feed
from kbot.ros.bridges.link import PeerLink
from kbot.ros.client.arguments import read_arguments
from kbot.ros.client.transports import open_transport, wanted_transport
from kbot.text import KbotError

M = TypeVar("M")

_LOOK_SECONDS = 0.002
"""How long a message may wait before it is heard."""
_JUMP = 1_000_000_000
"""Nanoseconds that time may leap ahead; what was due in a longer leap is left out."""


class _Wall:
    """What the link serves: the node's own bus, by the wall's clock."""

    def __init__(self) -> None:
        self.bus, self.clock = Bus(), Clock()
        self.errands: list[Callable[[], bool]] = []
        self.paused = False


class Node:
    """A program's place in the graph.

        node = kbot.Node("guard")
        node.subscribe("scan", LaserScan, lambda scan: ...)
        node.every(0.1, lambda: node.publish("cmd_vel", Twist(Vector3(0.2))))
        node.spin()

    It reaches the KBot that runs on this machine, the master at ROS_MASTER_URI, or ROS 2 where ROS_VERSION
    or ROS_DISTRO says so. Callbacks come one after the other, in the thread that spins. Names are resolved,
    and remapped, as in ROS. A name is heard or said, not both.
    """

    def __init__(self, name: str, argv: Sequence[str] | None = None, transport: str | None = None) -> None:
        """`argv` is the command line without the program (by default sys.argv's), `transport` is local, ros1
        or ros2.

        Raises:
            KbotError: there is nothing to reach, or a word of the command line is no good.
        """
        self._arguments = read_arguments(name, sys.argv[1:] if argv is None else argv, os.environ)
        self._wall = _Wall()
        self._clock = Clock()
        self._link = PeerLink(_say, raises_errors=True)
        self._publishers: dict[str, Publisher[Any]] = {}
        kind = transport or wanted_transport(os.environ)
        self._transport = open_transport(kind, self._link, self._arguments)
        feed = Feed(self._wall.bus, lambda: self._clock.nanoseconds)
        self._link.attach(self._wall, feed, gathers=False)
        self._has_time = not self._transport.uses_sim_time
        if self._transport.uses_sim_time:
            self._wall.bus.subscribe("/clock", ClockMessage, self._tick)
        self._is_closed = False
        self.step()

    @property
    def name(self) -> str:
        """Its full name."""
        return self._arguments.full_name

    @property
    def arguments(self) -> tuple[str, ...]:
        """Words of the command line that are the program's own."""
        return self._arguments.rest

    @property
    def now(self) -> float:
        """Seconds of the node's clock: simulated ones where a simulation tells them."""
        return self._clock.seconds

    def subscribe(self, topic: str, message_type: type[M], callback: Callable[[M], None]) -> Subscription:
        """Hear a topic. Raises KbotError: it is said here, or is of another type."""
        name = self._arguments.resolve(topic)
        if name in self._publishers:
            raise KbotError(f"{name} is published by this node, so it cannot be heard by it too")

        def hear(message: M) -> None:
            if not self._is_closed:
                callback(message)

        return self._wall.bus.subscribe(name, message_type, hear)

    def advertise(self, topic: str, message_type: type[M], *, latched: bool = False) -> Publisher[M]:
        """A publisher, so that others find the topic before anything is said; a latched one keeps its last
        message for those who come late. Raises KbotError: it is heard here, or is of another type."""
        name = self._arguments.resolve(topic)
        if name in self._wall.bus.inputs:
            raise KbotError(f"{name} is heard by this node, so it cannot be published by it too")
        publisher = self._wall.bus.advertise(name, message_type, latched=latched)
        self._publishers[name] = publisher
        return publisher

    def publish(self, topic: str, message: object) -> None:
        """Say something. Raises KbotError: the topic is heard here, or is of another type."""
        name = self._arguments.resolve(topic)
        if name not in self._publishers:
            self.advertise(topic, type(message))
            self.step()
        self._publishers[name].publish(message)

    def every(self, seconds: float, callback: Callable[[], None]) -> Timer:
        """Call back whenever so many seconds of the node's clock passed. Raises KbotError: not above 0."""
        if not seconds > 0.0:
            raise KbotError(f"a period is a number of seconds above zero, not {seconds}")
        return self._clock.every(1.0 / seconds, callback)

    def param(self, name: str, default: Any = None) -> Any:  # noqa: ANN401 - whatever a parameter can hold
        """A parameter: of the command line, else of the node (`~name`), else of that full name; a number is
        given as the default's type.

        Raises:
            KbotError: it is not of the default's type, or is nowhere and has no default.
        """
        value = self._arguments.parameters.get(name.lstrip("~"))
        for full in (self._arguments.resolve(f"~{name.lstrip('~/')}"), self._arguments.resolve(name)):
            value = self._transport.parameter(full) if value is None else value
        if value is None:
            if default is None:
                raise KbotError(f"the parameter '{name}' is not set: _{name.lstrip('~')}:=VALUE sets it")
            return default
        if isinstance(default, float) and isinstance(value, int) and not isinstance(value, bool):
            return float(value)
        if default is not None and not isinstance(value, type(default)):
            wanted = type(default).__name__
            raise KbotError(
                f"the parameter '{name}' is of type {wanted}, not {type(value).__name__}: {value!r}"
            )
        return value

    def step(self) -> None:
        """Hear what has come, and call the timers that are due. Raises KbotError: the KBot is gone."""
        if self._transport.failure is not None:
            raise self._transport.failure
        now = time.time_ns()
        self._leap(self._wall.clock, now)
        self._link.serve()
        if not self._transport.uses_sim_time:
            self._leap(self._clock, now)

    def spin(self, seconds: float | None = None) -> None:
        """Go on for so many seconds of the wall's clock, or until Ctrl-C or `close`; Ctrl-C also closes.

        Raises:
            KbotError: the KBot is gone.
        """
        end = None if seconds is None else time.monotonic() + seconds
        try:
            while not self._is_closed and (end is None or time.monotonic() < end):
                self.step()
                time.sleep(_LOOK_SECONDS)
        except KeyboardInterrupt:
            self.close()

    def close(self) -> None:
        """Take leave."""
        if not self._is_closed:
            self._is_closed = True
            self._transport.close()
            self._link.end()

    def __enter__(self) -> Node:
        return self

    def __exit__(self, *_: object) -> None:
        with suppress(KeyboardInterrupt):
            self.close()

    def _tick(self, message: ClockMessage) -> None:
        self._leap(self._clock, message.clock.nanoseconds)

    def _leap(self, clock: Clock, now: int) -> None:
        """Move a clock on; where time was set back or leapt, from there."""
        if 0 <= now - clock.nanoseconds <= _JUMP:
            clock.advance_to(now)
        else:
            clock.set(now)


def _say(text: str) -> None:
    sys.stderr.write(f"{text}\n")
