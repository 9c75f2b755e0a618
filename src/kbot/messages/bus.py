"""The bus: typed topics within one process. Subscribers are called at once and in order."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, TypeVar

from kbot.text import KbotError
from kbot.text.suggest import did_you_mean

M = TypeVar("M")


class Subscription:
    """A callback that hears a topic until it is closed."""

    # Any: each topic has its own type
    def __init__(self, bus: Bus, topic: _Topic, callback: Callable[[Any], None], looks_on: bool) -> None:
        self._bus = bus
        self._topic = topic
        self.callback = callback
        self.looks_on = looks_on

    def close(self) -> None:
        if self in self._topic.subscriptions:
            self._topic.subscriptions.remove(self)
            self._bus.changes += 1


class _Topic:
    def __init__(self, name: str, message_type: type, is_input: bool) -> None:
        self.name = name
        self.message_type = message_type
        self.is_input = is_input
        self.subscriptions: list[Subscription] = []
        self.publishers: list[Publisher[Any]] = []
        self.latched = False
        self.muted = False
        self.last: Any = None
        self.wanted: Callable[[], None] | None = None

    @property
    def is_there(self) -> bool:
        """Whether anyone speaks on it, or is meant to hear it."""
        return bool(self.publishers) or any(not one.looks_on for one in self.subscriptions)


class Publisher(Generic[M]):
    """Where messages of one type go out on one topic, until it is closed."""

    def __init__(self, bus: Bus, topic: _Topic, rate: float = 0.0) -> None:
        self._bus = bus
        self._topic = topic
        self.rate = rate
        """Messages a second of its clock while anyone hears them; 0 where they come as it happens."""
        topic.publishers.append(self)
        bus.changes += 1

    def close(self) -> None:
        """Speak no more; with the last who speaks on a topic, what it said last goes."""
        if self not in self._topic.publishers:
            return
        self._topic.publishers.remove(self)
        if not self._topic.publishers:
            self._topic.last = self._topic.wanted = None
        self._bus.changes += 1

    @property
    def topic(self) -> str:
        return self._topic.name

    @property
    def is_heard(self) -> bool:
        """Whether anyone would get a message, now or, on a latched topic, later."""
        topic = self._topic
        return bool(topic.subscriptions or topic.latched) and not topic.muted

    def publish(self, message: M) -> None:
        """Hand the message to every subscriber, in the order they came.

        Raises:
            KbotError: the message is not of the topic's type.
        """
        _publish(self._topic, message)


def _publish(topic: _Topic, message: object) -> None:
    if not isinstance(message, topic.message_type):
        raise KbotError(
            f"topic {topic.name} carries {topic.message_type.__name__}, not {type(message).__name__}"
        )
    if topic.muted:
        return
    if topic.latched:
        topic.last = message
    for subscription in tuple(topic.subscriptions):
        subscription.callback(message)


class Bus:
    """The topics of one simulation. A name has one type, said by who comes first; it is there while anyone
    speaks on it or hears it, but for those who merely look on."""

    def __init__(self) -> None:
        self._topics: dict[str, _Topic] = {}
        self.changes = 0
        """Grows whenever a topic begins or ends to be heard or spoken on."""

    def advertise(
        self,
        topic: str,
        message_type: type[M],
        *,
        latched: bool = False,
        wanted: Callable[[], None] | None = None,
        rate: float = 0.0,
    ) -> Publisher[M]:
        """A publisher; a latched topic hands its last message to those who subscribe later. `wanted` is
        called when somebody subscribes before there is one: what is costly is made then. `rate` is as
        `Publisher.rate`.

        Raises:
            KbotError: the topic's name is not one, or it carries another type.
        """
        entry = self._topic(topic, message_type)
        entry.latched = entry.latched or latched
        entry.wanted = wanted or entry.wanted
        return Publisher(self, entry, rate)

    def subscribe(
        self, topic: str, message_type: type[M], callback: Callable[[M], None], *, looks_on: bool = False
    ) -> Subscription:
        """Hear a topic, whether or not anyone publishes on it yet. Who `looks_on` shows or records what
        others say: for him alone the topic is not there.

        Raises:
            KbotError: the topic's name is not one, or it carries another type.
        """
        entry = self._topic(topic, message_type, is_input=True)
        subscription = Subscription(self, entry, callback, looks_on)
        self.changes += 1
        entry.subscriptions.append(subscription)
        if entry.last is not None:
            callback(entry.last)
        elif entry.wanted is not None:
            entry.wanted()
        return subscription

    def publish(self, topic: str, message: object) -> None:
        """Publish once without keeping a publisher; a topic that nobody hears is there from then on."""
        entry = self._topic(topic, type(message))
        if not entry.is_there:
            Publisher(self, entry)
        _publish(entry, message)

    @property
    def topics(self) -> dict[str, type]:
        """Name and message type of every topic, in the order they came up."""
        return {name: entry.message_type for name, entry in self._topics.items() if entry.is_there}

    def is_latched(self, topic: str) -> bool:
        """Whether those who come later get the topic's last message."""
        entry = self._topics.get(absolute(topic))
        return entry is not None and entry.latched

    def rate(self, topic: str) -> float:
        """Messages a second that would be heard on a topic, by the word of those who speak on it; 0 where
        none gives a rate."""
        entry = self._topics.get(absolute(topic))
        return 0.0 if entry is None or entry.muted else sum(one.rate for one in entry.publishers)

    def mute(self, topic: str, muted: bool = True) -> bool:
        """Let nothing be heard on a topic, or let it be heard again; whether it was mute before."""
        known = self._topics[absolute(topic)]
        before, known.muted = known.muted, muted
        self.changes += 1
        return before

    def require(self, topic: str) -> type:
        """The type of a topic that must be there.

        Raises:
            KbotError: there is no such topic; the nearest names are said.
        """
        name = absolute(topic)
        if name not in self.topics:
            hint = did_you_mean(name, self.topics)
            raise KbotError(f"there is no topic {name}" + (f": {hint}" if hint else ""))
        return self._topics[name].message_type

    @property
    def inputs(self) -> frozenset[str]:
        """Topics that were heard before anyone spoke on them: what is meant to come from outside."""
        return frozenset(name for name, entry in self._topics.items() if entry.is_input and entry.is_there)

    def _topic(self, topic: str, message_type: type, is_input: bool = False) -> _Topic:
        name = absolute(topic)
        entry = self._topics.setdefault(name, _Topic(name, message_type, is_input))
        if not (entry.is_there or entry.subscriptions):
            entry = self._topics[name] = _Topic(name, message_type, is_input)
        if entry.message_type is not message_type:
            raise KbotError(
                f"topic {name} carries {entry.message_type.__name__}, not {message_type.__name__}"
            )
        return entry


def absolute(topic: str, namespace: str = "") -> str:
    """The topic's full name: `odom` is `/odom`, in namespace `a` it is `/a/odom`; `/odom` stays.

    Raises:
        KbotError: empty, or with an empty part.
    """
    name = topic if topic.startswith("/") else f"{namespace.rstrip('/')}/{topic}"
    name = name if name.startswith("/") else f"/{name}"
    if not all(name[1:].split("/")):
        raise KbotError(f"'{topic}' is no topic's name")
    return name
