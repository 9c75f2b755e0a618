"""The node class: publish, subscribe, timers and parameters, over the transport that is available."""

from __future__ import annotations

import atexit
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from typing import Any, TypeVar

from kbot.brief import Brief, brief
from kbot.messages import Bus, Clock, ClockMessage, Publisher, Subscription, Timer
from kbot.record.feed import Feed
from kbot.ros.bridges.link import PeerLink
from kbot.ros.client.arguments import read_arguments
from kbot.ros.client.transports import open_transport, wanted_transport
from kbot.ros.lockstep.channel import VARIABLE
from kbot.ros.lockstep.follower import Follower
from kbot.ros.lockstep.link import LockstepLink
from kbot.text import KbotError

M = TypeVar("M")

_POLL_SECONDS = 0.002
"""Seconds between two steps of `spin`: a message waits at most this long for its callback."""
_JUMP = 1_000_000_000
"""Nanoseconds that time may advance at once. After a longer jump, timers skip the calls in between."""


class _WallClockLive:
    """What the link serves: the node's own bus, in wall-clock time."""

    def __init__(self) -> None:
        self.bus, self.clock = Bus(), Clock()
        self.errands: list[Callable[[], bool]] = []
        self.paused = False


class Node(Brief):
    """A node of the ROS graph, for a user's program.

        node = kbot.Node("guard")
        node.subscribe("scan", LaserScan, lambda scan: ...)
        node.every(0.1, lambda: node.publish("cmd_vel", Twist(Vector3(0.2))))
        node.spin()

    It connects to the KBot that runs on this machine, to the master at ROS_MASTER_URI, or to ROS 2 if
    ROS_VERSION or ROS_DISTRO selects it. Callbacks run one after the other, in the thread that calls `spin`
    or `step`. Names are resolved and remapped as in ROS. A node can publish on a topic or subscribe to it,
    not both.

    In a trial, a node runs in step with simulated time: `step` runs everything until the next tick, and time
    waits for it.
    """

    def __init__(self, name: str, argv: Sequence[str] | None = None, transport: str | None = None) -> None:
        """Connect the node.

        Args:
            name: the node's name, unless the command line sets another.
            argv: the command line without the program; by default that of `sys.argv`.
            transport: `local`, `ros1` or `ros2`; by default the environment selects it.

        Raises:
            KbotError: nothing to connect to was found, or the command line cannot be parsed.
        """
        self._arguments = read_arguments(name, sys.argv[1:] if argv is None else argv, os.environ)
        self._wall = _WallClockLive()
        self._clock = Clock()
        self._publishers: dict[str, Publisher[Any]] = {}
        self._is_closed = False
        self._follower: Follower | None = None
        kind = transport or wanted_transport(os.environ)
        lockstep = os.environ.get(VARIABLE)
        if lockstep:
            link = LockstepLink(_print, raises_errors=True)
            self._link: PeerLink = link
            self._follower = Follower(lockstep, link, self._wall.bus)
        else:
            self._link = PeerLink(_print, raises_errors=True)
        self._transport = open_transport(kind, self._link, self._arguments, lossless=bool(lockstep))
        feed = Feed(self._wall.bus, lambda: self._clock.nanoseconds)
        self._link.attach(self._wall, feed, batches=False)
        if self._follower is not None:
            self._clock.set(self._follower.join(self.name, kind, self._transport))
            atexit.register(self.close)  # reports the last messages of a program that does not close its node
            return
        if self._transport.uses_sim_time:
            self._wall.bus.subscribe("/clock", ClockMessage, self._on_clock)
        self.step()

    @property
    def name(self) -> str:
        """The full name."""
        return self._arguments.full_name

    @property
    def arguments(self) -> tuple[str, ...]:
        """The arguments of the command line that ROS does not define: those of the program itself."""
        return self._arguments.rest

    @property
    def now(self) -> float:
        """The time in seconds: simulated time if a simulation publishes it, else wall-clock time."""
        return self._clock.seconds

    def subscribe(self, topic: str, message_type: type[M], callback: Callable[[M], None]) -> Subscription:
        """Call `callback` with each message of a topic.

        Raises:
            KbotError: this node publishes the topic, or the topic has another type.
        """
        name = self._arguments.resolve(topic)
        if name in self._publishers:
            raise KbotError(f"this node publishes {name}, so it cannot subscribe to it")

        def receive(message: M) -> None:
            if not self._is_closed:
                callback(message)

        subscription = self._wall.bus.subscribe(name, message_type, receive)
        if self._follower is not None:
            self._follower.connect(name, message_type, publishes=False)
        return subscription

    def advertise(self, topic: str, message_type: type[M], *, latched: bool = False) -> Publisher[M]:
        """A publisher of a topic. Others find the topic at once, before its first message.

        A latched publisher keeps its last message for late subscribers.

        Raises:
            KbotError: this node subscribes to the topic, or the topic has another type.
        """
        name = self._arguments.resolve(topic)
        if name in self._wall.bus.inputs:
            raise KbotError(f"this node subscribes to {name}, so it cannot publish on it")
        publisher = self._wall.bus.advertise(name, message_type, latched=latched)
        self._publishers[name] = publisher
        if self._follower is not None:
            self._follower.connect(name, message_type, publishes=True, latched=latched)
        return publisher

    def publish(self, topic: str, message: object) -> None:
        """Publish a message. The first one also advertises the topic.

        Scalars and arrays of numpy in its fields are converted.

        Raises:
            KbotError: this node subscribes to the topic, the topic has another type, or a field of the
                message has the wrong type or shape, or is out of range. The error names the field.
        """
        name = self._arguments.resolve(topic)
        if name not in self._publishers:
            self.advertise(topic, type(message))
            if self._follower is None:
                self.step()
        self._publishers[name].publish(message)

    def every(self, seconds: float, callback: Callable[[], None]) -> Timer:
        """Call `callback` every `seconds` of the node's time. Raises KbotError: `seconds` is not above 0."""
        if not seconds > 0.0:
            raise KbotError(f"the period must be above 0 s, not {seconds}")
        return self._clock.every(1.0 / seconds, callback)

    def param(self, name: str, default: Any = None) -> Any:  # noqa: ANN401 - parameters have many types
        """The value of a parameter: from the command line, else `~name`, else `name`, else the default.

        An integer is converted to float if the default is a float.

        Raises:
            KbotError: the value is not of the default's type, or it is not set and has no default.
        """
        value = self._arguments.parameters.get(name.lstrip("~"))
        for full in (self._arguments.resolve(f"~{name.lstrip('~/')}"), self._arguments.resolve(name)):
            value = self._transport.parameter(full) if value is None else value
        if value is None:
            if default is None:
                raise KbotError(f"the parameter '{name}' is not set. Set it with _{name.lstrip('~')}:=VALUE")
            return default
        if isinstance(default, float) and isinstance(value, int) and not isinstance(value, bool):
            return float(value)
        if default is not None and not isinstance(value, type(default)):
            wanted = type(default).__name__
            raise KbotError(
                f"the parameter '{name}' must be of type {wanted}, not {type(value).__name__}: {value!r}"
            )
        return value

    def step(self) -> None:
        """Run the callbacks of received messages and of due timers.

        In a trial, wait for the next tick, and run those until then.

        Raises:
            KbotError: KBot has closed the connection, or the trial has ended.
        """
        if self._follower is not None:
            self._follow(self._follower)
            return
        if self._transport.failure is not None:
            raise self._transport.failure
        now = time.time_ns()
        self._move(self._wall.clock, now)
        self._link.serve()
        if not self._transport.uses_sim_time:
            self._move(self._clock, now)

    def spin(self, seconds: float | None = None) -> None:
        """Run callbacks for `seconds` of wall-clock time, or until `close` or Ctrl-C, which closes the node.

        In a trial, `seconds` are simulated, and the end of the trial ends it too.

        Raises:
            KbotError: KBot has closed the connection.
        """
        follower = self._follower
        time_now = time.monotonic if follower is None else lambda: self.now
        end = None if seconds is None else time_now() + seconds
        try:
            while not self._is_closed and (end is None or time_now() < end):
                if follower is not None and follower.has_ended:
                    return
                self.step()
                if follower is None:
                    time.sleep(_POLL_SECONDS)
        except KeyboardInterrupt:
            self.close()

    def close(self) -> None:
        """Disconnect. No callback runs afterwards."""
        if not self._is_closed:
            self._is_closed = True
            if self._follower is not None:
                self._follower.close()
                atexit.unregister(self.close)
            self._transport.close()
            self._link.end()

    def __enter__(self) -> Node:
        return self

    def __exit__(self, *_: object) -> None:
        with suppress(KeyboardInterrupt):
            self.close()

    def _follow(self, follower: Follower) -> None:
        """Finish the current tick, and run the next one."""
        if self._is_closed:
            return
        if follower.has_ended:
            raise KbotError("the trial has ended")
        follower.finish_tick()
        tick = follower.next_tick()
        if tick is not None:
            follower.run_tick(tick, lambda now: self._move(self._clock, now), lambda: self._is_closed)

    def _on_clock(self, message: ClockMessage) -> None:
        self._move(self._clock, message.clock.nanoseconds)

    def _move(self, clock: Clock, now: int) -> None:
        """Advance a clock to `now`. If time jumped, back or far ahead, set it without calling timers."""
        if 0 <= now - clock.nanoseconds <= _JUMP:
            clock.advance_to(now)
        else:
            clock.set(now)

    def _shown(self) -> Iterator[str]:
        yield repr(self.name)
        yield f"publishes {brief(list(self._publishers))}"
        if self._is_closed:
            yield "closed"


def _print(text: str) -> None:
    sys.stderr.write(f"{text}\n")
