"""The bus: typed topics within one process. `publish` calls each subscriber before it returns."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, Generic, TypeVar

from kbot.brief import Brief, counted
from kbot.messages.checked import checked
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean

M = TypeVar("M")


class Subscription(Brief):
    """A callback that receives a topic's messages until it is closed."""

    # Any: each topic has its own type
    def __init__(self, bus: Bus, topic: _Topic, callback: Callable[[Any], None], passive: bool) -> None:
        self._bus = bus
        self._topic = topic
        self.callback = callback
        self.passive = passive

    def close(self) -> None:
        if self in self._topic.subscriptions:
            self._topic.subscriptions.remove(self)
            self._bus.changes += 1

    def _shown(self) -> Iterator[str]:
        yield repr(self._topic.name)
        yield self._topic.message_type.__name__


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
        self.on_subscribe: Callable[[], None] | None = None

    @property
    def exists(self) -> bool:
        """Whether it has a publisher, or a subscriber that is not passive."""
        return bool(self.publishers) or any(not subscription.passive for subscription in self.subscriptions)


class Publisher(Brief, Generic[M]):
    """Publishes messages of one type on one topic, until it is closed."""

    def __init__(self, bus: Bus, topic: _Topic, rate: float = 0.0) -> None:
        self._bus = bus
        self._topic = topic
        self.rate = rate
        """Messages per second of the publisher's clock while there are subscribers; 0 if the rate varies."""
        topic.publishers.append(self)
        bus.changes += 1

    def close(self) -> None:
        """Stop publishing. The topic's last publisher takes the latched message with it."""
        if self not in self._topic.publishers:
            return
        self._topic.publishers.remove(self)
        if not self._topic.publishers:
            self._topic.last = self._topic.on_subscribe = None
        self._bus.changes += 1

    @property
    def topic(self) -> str:
        return self._topic.name

    @property
    def has_subscribers(self) -> bool:
        """Whether a message would be received: now or, on a latched topic, by a late subscriber."""
        topic = self._topic
        return bool(topic.subscriptions or topic.latched) and not topic.muted

    def publish(self, message: M) -> None:
        """Pass a message to every subscriber, in the order in which they subscribed.

        Scalars and arrays of numpy in its fields are converted.

        Raises:
            KbotError: the message is not of the topic's type, or a field has the wrong type or shape, or is
                out of range. The error names the field.
        """
        _publish(self._topic, message)

    def publish_plain(self, message: M) -> None:
        """As `publish`, for KBot's own frequent messages: their fields are plain and are not checked."""
        _deliver(self._topic, message)

    def _shown(self) -> Iterator[str]:
        yield repr(self.topic)
        yield self._topic.message_type.__name__


def _publish(topic: _Topic, message: object) -> None:
    if not isinstance(message, topic.message_type):
        raise KbotError(
            f"topic {topic.name} carries {topic.message_type.__name__}, not {type(message).__name__}"
        )
    _deliver(topic, checked(message))


def _deliver(topic: _Topic, message: object) -> None:
    if topic.muted:
        return
    if topic.latched:
        topic.last = message
    for subscription in tuple(topic.subscriptions):
        subscription.callback(message)


class Bus(Brief):
    """The topics of one simulation.

    The first publisher or subscriber of a topic sets its type. A topic exists while it has a publisher or a
    subscriber that is not passive.
    """

    def __init__(self) -> None:
        self._topics: dict[str, _Topic] = {}
        self.changes = 0
        """Grows whenever a publisher or subscription is added or closed, or a topic is muted."""
        self.when_announced: list[Callable[[], None]] = []
        """Called by `announce`. A recorder subscribes to new topics then."""

    def announce(self) -> None:
        """Report that topics were added, so that a recorder receives their first message."""
        for listener in tuple(self.when_announced):
            listener()

    def advertise(
        self,
        topic: str,
        message_type: type[M],
        *,
        latched: bool = False,
        on_subscribe: Callable[[], None] | None = None,
        rate: float = 0.0,
    ) -> Publisher[M]:
        """Add a publisher.

        Args:
            topic: the name. `odom` means `/odom`.
            message_type: the class of the messages.
            latched: late subscribers receive the last message.
            on_subscribe: called when somebody subscribes before the first message. It may publish one, which
                is useful if the message is costly to compute.
            rate: see `Publisher.rate`.

        Raises:
            KbotError: the topic's name is not valid, or the topic has another type.
        """
        entry = self._topic(topic, message_type)
        entry.latched = entry.latched or latched
        entry.on_subscribe = on_subscribe or entry.on_subscribe
        return Publisher(self, entry, rate)

    def subscribe(
        self, topic: str, message_type: type[M], callback: Callable[[M], None], *, passive: bool = False
    ) -> Subscription:
        """Call `callback` with each message of a topic. The topic needs no publisher yet.

        A `passive` subscriber displays or records messages: alone, it does not make the topic exist.

        Raises:
            KbotError: the topic's name is not valid, or the topic has another type.
        """
        entry = self._topic(topic, message_type, is_input=True)
        subscription = Subscription(self, entry, callback, passive)
        self.changes += 1
        entry.subscriptions.append(subscription)
        if entry.last is not None:
            callback(entry.last)
        elif entry.on_subscribe is not None:
            entry.on_subscribe()
        return subscription

    def divert(self, topic: str, message_type: type[M], callback: Callable[[M], None]) -> None:
        """Subscribe in place of the topic's subscribers. Passive ones continue to receive its messages.

        Raises:
            KbotError: the topic's name is not valid, or the topic has another type.
        """
        entry = self._topic(topic, message_type, is_input=True)
        for subscription in [
            subscription for subscription in entry.subscriptions if not subscription.passive
        ]:
            subscription.close()
        self.subscribe(topic, message_type, callback)

    def publish(self, topic: str, message: object) -> None:
        """Publish once, without a publisher of the caller. A new topic keeps a publisher and so exists.

        Raises:
            KbotError: as for `Publisher.publish`.
        """
        entry = self._topic(topic, type(message))
        if not entry.exists:
            Publisher(self, entry)
        _publish(entry, message)

    @property
    def topics(self) -> dict[str, type]:
        """Name and message type of every topic, in the order of their creation."""
        return {name: entry.message_type for name, entry in self._topics.items() if entry.exists}

    def is_latched(self, topic: str) -> bool:
        """Whether late subscribers receive the topic's last message."""
        entry = self._topics.get(absolute(topic))
        return entry is not None and entry.latched

    def rate(self, topic: str) -> float:
        """Messages per second on a topic, as its publishers declare them; 0 if unknown or muted."""
        entry = self._topics.get(absolute(topic))
        return 0.0 if entry is None or entry.muted else sum(publisher.rate for publisher in entry.publishers)

    def mute(self, topic: str, muted: bool = True) -> bool:
        """Drop the messages of a topic, or stop dropping them. Returns whether they were dropped before."""
        known = self._topics[absolute(topic)]
        before, known.muted = known.muted, muted
        self.changes += 1
        return before

    def require(self, topic: str) -> type:
        """The type of an existing topic.

        Raises:
            KbotError: there is no such topic. The error suggests similar names.
        """
        name = absolute(topic)
        if name not in self.topics:
            hint = did_you_mean(name, self.topics)
            raise KbotError(f"there is no topic {name}" + (f": {hint}" if hint else ""))
        return self._topics[name].message_type

    @property
    def inputs(self) -> frozenset[str]:
        """Topics that had a subscriber before a publisher: messages for them come from outside."""
        return frozenset(name for name, entry in self._topics.items() if entry.is_input and entry.exists)

    def _topic(self, topic: str, message_type: type, is_input: bool = False) -> _Topic:
        name = absolute(topic)
        entry = self._topics.setdefault(name, _Topic(name, message_type, is_input))
        if not (entry.exists or entry.subscriptions):
            entry = self._topics[name] = _Topic(name, message_type, is_input)
        if entry.message_type is not message_type:
            raise KbotError(
                f"topic {name} carries {entry.message_type.__name__}, not {message_type.__name__}"
            )
        return entry

    def _shown(self) -> Iterator[str]:
        yield counted(len(self.topics), "topic")


def absolute(topic: str, namespace: str = "") -> str:
    """The full name of a topic: `odom` is `/odom`, or `/a/odom` in the namespace `a`. `/odom` is not changed.

    Raises:
        KbotError: the name is empty or has an empty part.
    """
    name = topic if topic.startswith("/") else f"{namespace.rstrip('/')}/{topic}"
    name = name if name.startswith("/") else f"/{name}"
    if not all(name[1:].split("/")):
        raise KbotError(f"'{topic}' is not a topic name: write at least one character between slashes")
    return name
