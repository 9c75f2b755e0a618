"""The link between a simulation's thread and the threads of bridges.

On the simulation's thread, a bridge only puts messages in a queue. No other thread touches the simulation:
messages of peers wait until `serve`, which the simulation's clock calls every control period, and their
service calls until `work`, between two steps.
"""

from __future__ import annotations

import threading
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
WAITING = 16
"""Messages of a topic that wait to be delivered; of more the newest are kept."""

MOST_CALLS = 256
"""Calls of services that wait; more are refused."""

Receiver = Callable[[Packet], None]


@dataclass(frozen=True, slots=True)
class Topic:
    """What a peer may hear, or say where it `is_input`."""

    name: str
    message_type: type
    is_input: bool
    is_latched: bool

    @property
    def type_name(self) -> str:
        return ros_name(self.message_type)


class PeerLink:
    """Thread-safe but for `attach`, `detach`, `serve` and `work`, which are the simulation's thread's."""

    def __init__(
        self,
        tell: Callable[[str], None],
        hidden: frozenset[str] = frozenset(),
        raises_errors: bool = False,
    ) -> None:
        """`tell` receives sentences for the user, each once; `hidden` topics stay within the process. With
        `raises_errors`, an error of a callback ends `serve`, as a program's own node expects; without it, the
        error is reported and the simulation runs on."""
        self._raises_errors = raises_errors
        self._hidden = hidden
        self.topics: dict[str, Topic] = {}
        """What there is now; replaced as a whole when it changes."""
        self.nanoseconds = 0
        """The simulation's time when it was last served."""
        self.parameters: dict[str, ParameterValue] = {}
        """By full name; replaced as a whole when one changes."""
        self.services: Mapping[str, Service] = {}
        """By name; replaced as a whole by `offer`."""
        self.fan_out = FanOut(self)
        """Where bridges get what is said."""
        self._tell, self._told = tell, set[str]()
        self._lock = threading.Lock()
        self._jobs: deque[tuple[bool, str, Receiver]] = deque()
        self._mail: dict[str, deque[tuple[object, Callable[[str], None]]]] = {}
        # Any: each service has its own type
        self._calls: deque[tuple[Service, object, Future[Any]]] = deque()
        self._wanted: list[tuple[str, Receiver]] = []
        self._watchers: list[Callable[[], None]] = []
        self._feed: Feed | None = None
        self._simulation: Live | None = None
        self._seen = -1
        self._gathers = self._waits = False
        self._stirred: dict[Callable[[], None], None] = {}

    def is_latched(self, topic: str) -> bool:
        """Whether a topic that there is keeps its last message for those who come late."""
        found = self.topics.get(topic)
        return found is not None and found.is_latched

    def open(self, topic: str, receiver: Receiver) -> None:
        """Hear a topic from the next period on, also over a change of simulation. `receiver` is called on
        the simulation's thread and must not wait."""
        with self._lock:
            self._jobs.append((True, topic, receiver))

    def close(self, topic: str, receiver: Receiver) -> None:
        """Hear it no more."""
        with self._lock:
            self._jobs.append((False, topic, receiver))

    def send(self, topic: str, message: object, told: Callable[[str], None] = lambda reason: None) -> None:
        """Say something on a topic that is an input, in the next period. Of a flood the newest counts. `told`
        is given the reason why it was refused, empty where it was taken or newer ones took its place."""
        with self._lock:
            waiting = self._mail.setdefault(topic, deque())
            waiting.append((message, told))
            displaced = waiting.popleft() if len(waiting) > WAITING else None
        if displaced is not None:
            displaced[1]("")

    def call(self, service: str, request: object) -> Future[Any]:
        """Ask a service; its response comes between two steps, or the KbotError that it raised.

        Raises:
            KbotError: there is no such service, or too many calls wait.
        """
        found = require_service(self.services, service)
        future: Future[Any] = Future()
        with self._lock:
            if len(self._calls) >= MOST_CALLS:
                raise KbotError(f"{service}: {MOST_CALLS} calls wait already")
            self._calls.append((found, request, future))
        return future

    def set_parameter(self, name: str, value: ParameterValue) -> None:
        """Set a parameter for all who ask; None takes it away."""
        self.set_parameters({name: value})

    def set_parameters(self, values: Mapping[str, ParameterValue]) -> None:
        """Set several, which everybody sees at once."""
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
        """Have these services called, and no others."""
        self.services = services
        for changed in tuple(self._watchers):
            changed()

    def watch(self, changed: Callable[[], None]) -> None:
        """Call back, on any thread, whenever `topics`, `parameters` or `services` changed."""
        self._watchers.append(changed)

    def tell(self, text: str) -> None:
        """Tell the user, once for each text."""
        with self._lock:
            if text in self._told or len(self._told) > 100:
                return
            self._told.add(text)
        self._tell(text)

    def stir(self, wake: Callable[[], None]) -> None:
        """For receivers: call `wake` once, when all messages of this moment have been received. Threads that
        wake for each of them would fight the simulation for Python's lock."""
        if not self._gathers or self._simulation is None:
            wake()
            return
        self._stirred[wake] = None
        if not self._waits:
            self._waits = True
            self._simulation.clock.after_timers(self._end_moment)

    def _end_moment(self) -> None:
        self._waits = False
        self._wake_all()

    def _wake_all(self) -> None:
        stirred, self._stirred = self._stirred, {}
        for wake in stirred:
            wake()

    def attach(self, simulation: Live, feed: Feed, *, gathers: bool = True) -> None:
        """Serve this simulation from now on, instead of the one before. It `gathers` messages of one moment
        where time moves on by itself after them."""
        self.detach()
        self._gathers, self._waits = gathers, False
        self._simulation, self._feed, self._seen = simulation, feed, -1
        for topic, receiver in self._wanted:
            self._try_open(topic, receiver)
        self._timer = simulation.clock.every(SERVE_RATE, self.serve)
        simulation.errands.append(self.work)
        self.serve()
        self._wake_all()

    def detach(self) -> None:
        """Leave the simulation."""
        self._wake_all()
        if self._feed is not None:
            self._timer.cancel()
            for topic, receiver in self._wanted:
                self._feed.close(topic, receiver)
        if self._simulation is not None:
            self._simulation.errands.remove(self.work)
        self._simulation = self._feed = None

    def end(self) -> None:
        """Nobody is served any more; whoever waits for a service is told."""
        self.detach()
        with self._lock:
            calls, self._calls = self._calls, deque()
        for _, _, future in calls:
            if future.set_running_or_notify_cancel():
                future.set_exception(KbotError("the simulation is gone"))

    def serve(self) -> None:
        """Do what peers asked for and deliver what they said since the last time."""
        simulation, feed = self._simulation, self._feed
        if simulation is None or feed is None:
            return
        self.nanoseconds = simulation.clock.nanoseconds
        if simulation.bus.changes != self._seen:
            self._look(simulation, feed)
        if not self._jobs and not self._mail:
            return
        with self._lock:
            jobs, self._jobs = self._jobs, deque()
            mail, self._mail = self._mail, {}
        for opens, topic, receiver in jobs:
            if opens:
                self._wanted.append((topic, receiver))
                self._try_open(topic, receiver)
            elif (topic, receiver) in self._wanted:
                self._wanted.remove((topic, receiver))
                feed.close(topic, receiver)
        for topic, messages in mail.items():
            for message, told in messages:
                if self._simulation is not simulation:  # what was delivered before ended it
                    return
                told(self._deliver(simulation, topic, message))

    def work(self) -> bool:
        """Answer what peers called, between two steps, and say whether they did; while the simulation is
        paused serve them too."""
        simulation = self._simulation
        self._wake_all()
        if simulation is None or not (simulation.paused or self._calls):
            return False
        if simulation.paused:
            self.serve()
        called = len(self._calls)
        for _ in range(called):
            with self._lock:
                service, request, future = self._calls.popleft()
            if not future.set_running_or_notify_cancel():
                continue
            try:
                # services are offered beside simulations only
                future.set_result(service.answer(cast("Simulation", simulation), request))
            except KbotError as error:
                future.set_exception(error)
            except Exception as error:  # noqa: BLE001 - no caller is to end the simulation, whatever it found
                future.set_exception(KbotError(FAULTS.fault(service.name, error)))
        self._wake_all()
        return called > 0

    def _look(self, simulation: Live, feed: Feed) -> None:
        bus = simulation.bus
        self._seen = bus.changes
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

    def _deliver(self, simulation: Live, topic: str, message: object) -> str:
        """The reason why it was refused, if it was."""
        known = self.topics.get(topic)
        if known is None or not known.is_input:
            return f"{topic} is not subscribed to any more"
        if isinstance(message, TwistStamped) and known.message_type is Twist:
            message = message.twist
        try:
            simulation.bus.publish(topic, message)
        except KbotError as error:
            self.tell(f"{topic}: a message from outside was refused: {error}")
            return f"{topic}: {error}"
        except Exception as error:  # a program's callback may raise anything
            if self._raises_errors:
                raise
            return f"{topic}: {FAULTS.fault(f'a message on {topic}', error)}"
        return ""
