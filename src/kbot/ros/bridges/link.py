"""PeerLink: the link between a simulation's thread and the threads of bridges.

On the simulation's thread, a bridge only puts messages in a queue. No other thread touches the simulation.
Messages of peers wait until `serve`, which the simulation's clock calls every control period. Service calls
wait until `answer_calls`, between two steps.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

from kbot.messages.live import Live
from kbot.messages.types import Twist, TwistStamped
from kbot.record.encodings.type_names import ros_name
from kbot.record.feed import Feed, Packet
from kbot.ros.bridges.fan_out import FanOut
from kbot.ros.bridges.loop import FAULTS
from kbot.ros.bridges.service import Service, require_service
from kbot.ros.parameter_values import ParameterValue
from kbot.text import KbotError

if TYPE_CHECKING:
    from kbot.sim import Simulation

SERVE_RATE = 50.0
"""Hz, the control rate of a robot: a command cannot take effect earlier."""
WAITING = 16
"""Messages per topic that wait to be delivered. If there are more, the oldest are dropped."""
MOST_CALLS = 256
"""Service calls that wait. More are refused."""
BUSY_SECONDS = 0.03
"""Seconds after which further calls wait for the next step. Spawning takes a second in a large world."""
_MOST_REPORTS = 100
"""Different texts that are reported to the user, so that a faulty peer cannot flood the terminal."""

Receiver = Callable[[Packet], None]


@dataclass(frozen=True, slots=True)
class Topic:
    """A topic that peers can subscribe to, or publish on if it `is_input`."""

    name: str
    message_type: type
    is_input: bool
    is_latched: bool

    @property
    def type_name(self) -> str:
        return ros_name(self.message_type)


def any_version(topic: str, type_name: str) -> None:
    """The `version_of` links of recordings and of users' nodes: peers of all ROS versions see every topic."""


class PeerLink:
    """Connects bridges to a simulation.

    All methods are thread-safe, except `attach`, `detach`, `serve` and `answer_calls`, which belong to the
    simulation's thread.
    """

    def __init__(
        self,
        report: Callable[[str], None],
        hidden: frozenset[str] = frozenset(),
        raises_errors: bool = False,
    ) -> None:
        """Create a link without a simulation.

        Args:
            report: receives sentences for the user, each once.
            hidden: topics that peers do not see.
            raises_errors: an error of a callback ends `serve`, as a user's own node needs it. Otherwise the
                error is reported, and the simulation continues.
        """
        self._raises_errors = raises_errors
        self._hidden = hidden
        self.topics: dict[str, Topic] = {}
        """The current topics by name. A change replaces the whole dictionary."""
        self.version_of: Callable[[str, str], int | None] = any_version
        """The only ROS version whose peers see a topic, by its name and type; see `topics_of`."""
        self.nanoseconds = 0
        """The simulation's time of the last `serve`."""
        self.parameters: dict[str, ParameterValue] = {}
        """By full name. A change replaces the whole dictionary."""
        self.services: Mapping[str, Service] = {}
        """By name. `offer` replaces the whole mapping."""
        self.fan_out = FanOut(self)
        """Where bridges subscribe to topics."""
        self._report, self._reported = report, set[str]()
        self._lock = threading.Lock()
        self._jobs: deque[tuple[bool, str, Receiver]] = deque()
        """Calls of `open` (True) and `close` (False) that wait for `serve`."""
        self._inbox: dict[str, deque[tuple[object, Callable[[str], None]]]] = {}
        """Messages of peers that wait for `serve`, by topic."""
        # Any: each service has its own type
        self._calls: deque[tuple[Service, object, Future[Any]]] = deque()
        self._preparing = 0
        """Calls that are prepared on other threads."""
        self._opened: list[tuple[str, Receiver]] = []
        self._watchers: list[Callable[[], None]] = []
        self._feed: Feed | None = None
        self._simulation: Live | None = None
        self._seen_changes = -1
        self._batches = self._has_open_batch = False
        self._scheduled: dict[Callable[[], None], None] = {}

    def topics_of(self, version: int) -> dict[str, Topic]:
        """The current topics that peers of this ROS version, 1 or 2, see."""
        other = 3 - version
        return {
            name: topic
            for name, topic in self.topics.items()
            if self.version_of(name, topic.type_name) != other
        }

    def is_latched(self, topic: str) -> bool:
        """Whether a topic exists and keeps its last message for late subscribers."""
        found = self.topics.get(topic)
        return found is not None and found.is_latched

    def open(self, topic: str, receiver: Receiver) -> None:
        """Call `receiver` with each packet of a topic, from the next period on.

        It continues when another simulation is attached. `receiver` is called on the simulation's thread and
        must not block.
        """
        with self._lock:
            self._jobs.append((True, topic, receiver))

    def close(self, topic: str, receiver: Receiver) -> None:
        """Undo `open`, from the next period on."""
        with self._lock:
            self._jobs.append((False, topic, receiver))

    def send(
        self,
        topic: str,
        message: object,
        on_result: Callable[[str], None] = lambda reason: None,
        source: str = "",
    ) -> None:
        """Publish on a topic of the simulation that is an input, in the next period.

        If messages come too fast, the oldest are dropped. `on_result` receives the reason if the message was
        refused, and otherwise, also if it was dropped, an empty text. `source` is the peer, if it is known.
        """
        with self._lock:
            waiting = self._inbox.setdefault(topic, deque())
            waiting.append((message, on_result))
            dropped = waiting.popleft() if len(waiting) > WAITING else None
        if dropped is not None:
            dropped[1]("")

    def call(self, service: str, request: object) -> Future[Any]:
        """Call a service. Between two steps, the future gets the response, or the KbotError of the service.

        Raises:
            KbotError: there is no such service, or too many calls wait.
        """
        found = require_service(self.services, service)
        future: Future[Any] = Future()
        with self._lock:
            if len(self._calls) + self._preparing >= MOST_CALLS:
                raise KbotError(f"{service}: {MOST_CALLS} calls are already waiting. Try again later")
            if found.prepare is None:
                self._calls.append((found, request, future))
                return future
            self._preparing += 1
        threading.Thread(target=self._prepare, args=(found, request, future), daemon=True).start()
        return future

    def _prepare(self, service: Service, request: object, future: Future[Any]) -> None:
        try:
            prepared = service.prepare(request) if service.prepare is not None else request
        except Exception as error:  # noqa: BLE001 - a service call must not end the simulation
            if future.set_running_or_notify_cancel():
                future.set_exception(KbotError(FAULTS.fault(service.name, error)))
            prepared = None
        with self._lock:
            self._preparing -= 1
            if not future.done():
                self._calls.append((service, prepared, future))

    def set_parameter(self, name: str, value: ParameterValue) -> None:
        """Set a parameter for all bridges; None deletes it."""
        self.set_parameters({name: value})

    def set_parameters(self, values: Mapping[str, ParameterValue]) -> None:
        """Set several parameters at once."""
        with self._lock:
            now: dict[str, ParameterValue] = {
                key: value for key, value in {**self.parameters, **values}.items() if value is not None
            }
            if now == self.parameters:
                return
            self.parameters = now
        for changed in tuple(self._watchers):
            changed()

    def offer(self, services: Mapping[str, Service]) -> None:
        """Offer these services to peers, and no others."""
        self.services = services
        for changed in tuple(self._watchers):
            changed()

    def watch(self, changed: Callable[[], None]) -> None:
        """Call `changed`, on any thread, whenever `topics`, `parameters` or `services` have changed."""
        self._watchers.append(changed)

    def report(self, text: str) -> None:
        """Report to the user, each text once."""
        with self._lock:
            if text in self._reported or len(self._reported) > _MOST_REPORTS:
                return
            self._reported.add(text)
        self._report(text)

    def schedule(self, wake: Callable[[], None]) -> None:
        """Call `wake` once, after all messages of the current time step have been received.

        A thread that wakes up for each message would compete with the simulation for Python's interpreter
        lock.
        """
        if not self._batches or self._simulation is None:
            wake()
            return
        self._scheduled[wake] = None
        if not self._has_open_batch:
            self._has_open_batch = True
            self._simulation.clock.after_timers(self._end_batch)

    def _end_batch(self) -> None:
        self._has_open_batch = False
        self.flush()

    def flush(self) -> None:
        """Pass all messages that were received so far to the bridges. Belongs to the simulation's thread."""
        scheduled, self._scheduled = self._scheduled, {}
        for wake in scheduled:
            wake()

    def attach(self, simulation: Live, feed: Feed, *, batches: bool = True) -> None:
        """Serve this simulation from now on, instead of the one before.

        With `batches`, bridges receive the messages of a time step together. This needs a clock that advances
        after the messages of each step.
        """
        self.detach()
        self._batches, self._has_open_batch = batches, False
        self._simulation, self._feed, self._seen_changes = simulation, feed, -1
        for topic, receiver in self._opened:
            self._try_open(topic, receiver)
        self._timer = simulation.clock.every(SERVE_RATE, self.serve_in_time)
        simulation.errands.append(self.answer_calls)
        self.serve()
        self.flush()

    def detach(self) -> None:
        """Disconnect from the simulation."""
        self.flush()
        if self._feed is not None:
            self._timer.cancel()
            for topic, receiver in self._opened:
                self._feed.close(topic, receiver)
        if self._simulation is not None:
            self._simulation.errands.remove(self.answer_calls)
        self._simulation = self._feed = None

    def end(self) -> None:
        """Disconnect from the simulation for good. Waiting service calls fail."""
        self.detach()
        with self._lock:
            calls, self._calls = self._calls, deque()
        for _, _, future in calls:
            if future.set_running_or_notify_cancel():
                future.set_exception(KbotError("the simulation has ended"))

    def serve_in_time(self) -> None:
        """Called by the simulation's clock every control period."""
        self.serve()

    def serve(self) -> None:
        """Open and close topics as peers requested, and deliver their messages."""
        simulation, feed = self._simulation, self._feed
        if simulation is None or feed is None:
            return
        self.nanoseconds = simulation.clock.nanoseconds
        if simulation.bus.changes != self._seen_changes:
            self._update_topics(simulation, feed)
        if not self._jobs and not self._inbox:
            return
        with self._lock:
            jobs, self._jobs = self._jobs, deque()
            inbox, self._inbox = self._inbox, {}
        for opens, topic, receiver in jobs:
            if opens:
                self._opened.append((topic, receiver))
                self._try_open(topic, receiver)
            elif (topic, receiver) in self._opened:
                self._opened.remove((topic, receiver))
                feed.close(topic, receiver)
        for topic, messages in inbox.items():
            for message, on_result in messages:
                if self._simulation is not simulation:  # a message has ended this simulation
                    return
                on_result(self.deliver(topic, message))

    def answer_calls(self) -> bool:
        """Answer waiting service calls, between two steps. Returns whether there were any.

        The clock does not call `serve` while the simulation is paused, so this does.
        """
        simulation = self._simulation
        self.flush()
        if simulation is None or not (simulation.paused or self._calls):
            return False
        if simulation.paused:
            self.serve()
        waiting, began = len(self._calls), time.monotonic()
        for answered in range(waiting):
            if answered and time.monotonic() - began > BUSY_SECONDS:
                break
            with self._lock:
                service, request, future = self._calls.popleft()
            if not future.set_running_or_notify_cancel():
                continue
            try:
                # a link has services only if it serves a simulation
                future.set_result(service.answer(cast("Simulation", simulation), request))
            except KbotError as error:
                future.set_exception(error)
            except Exception as error:  # noqa: BLE001 - a service call must not end the simulation
                future.set_exception(KbotError(FAULTS.fault(service.name, error)))
        self.flush()
        return waiting > 0

    def _update_topics(self, simulation: Live, feed: Feed) -> None:
        bus = simulation.bus
        self._seen_changes = bus.changes
        inputs = bus.inputs
        found = {
            name: Topic(name, kind, name in inputs, bus.is_latched(name))
            for name, kind in feed.offered().items()
            if name not in self._hidden
        }
        if found != self.topics:
            self.topics = found
            for changed in self._watchers:
                changed()

    def _try_open(self, topic: str, receiver: Receiver) -> None:
        if self._feed is not None and topic not in self._hidden and topic in self._feed.offered():
            self._feed.open(topic, receiver)

    def deliver(self, topic: str, message: object) -> str:
        """Publish a peer's message at once. Returns the reason if it is refused, else an empty text."""
        known, simulation = self.topics.get(topic), self._simulation
        if known is None or not known.is_input or simulation is None:
            return f"KBot does not subscribe to {topic} any more"
        if isinstance(message, TwistStamped) and known.message_type is Twist:
            message = message.twist
        try:
            simulation.bus.publish(topic, message)
        except KbotError as error:
            self.report(f"{topic}: rejected a message from a peer: {error}")
            return f"{topic}: {error}"
        except Exception as error:  # callbacks of a user's program may raise anything
            if self._raises_errors:
                raise
            return f"{topic}: {FAULTS.fault(f'a message on {topic}', error)}"
        return ""
