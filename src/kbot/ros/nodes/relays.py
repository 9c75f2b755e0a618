"""topic_tools/relay: republishes a topic of the simulation under another name."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from kbot.messages import Publisher, Subscription
from kbot.text import Diagnostic, KbotError, Origin, Severity

if TYPE_CHECKING:  # the engine, which reading a launch file does not need
    from kbot.sim import Simulation

CHECK_RATE = 10.0
"""Hz at which a relay checks whether its target has subscribers."""


@dataclass(frozen=True, slots=True)
class Relayed:
    """A topic and the name under which it is republished. Names are full."""

    source: str
    target: str
    origin: Origin


class Relays:
    """Republishes topics, each only while the new name has subscribers.

    Otherwise sensors would compute data that nobody receives.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._relays: list[_Relay] = []

    def add(self, source: str, target: str, kind: type) -> None:
        """Raises KbotError: the target exists with another type."""
        relay = _Relay(self._simulation, source, target, kind)
        if not self._relays:
            self._simulation.clock.every(CHECK_RATE, self._check_subscribers)
        self._relays.append(relay)
        relay.check_subscribers()

    def _check_subscribers(self) -> None:
        for relay in self._relays:
            relay.check_subscribers()


def relay_topics(simulation: Simulation, relayed: tuple[Relayed, ...]) -> list[Diagnostic]:
    """Relay what the simulation publishes, and commands to it. Returns why a topic is not relayed."""
    bus, relays, notes = simulation.bus, Relays(simulation), []
    for rule in relayed:
        kinds = bus.topics
        try:
            if rule.source == rule.target:
                raise KbotError("the source is the same topic")
            if rule.target in bus.inputs:
                bus.subscribe(rule.source, kinds[rule.target], partial(bus.publish, rule.target))
            elif rule.source not in kinds or rule.source in bus.inputs:
                raise KbotError(f"the simulation does not publish {rule.source}")
            elif rule.target not in kinds:  # else the simulation itself publishes the target
                relays.add(rule.source, rule.target, kinds[rule.source])
        except KbotError as error:
            message = f"nothing is relayed to {rule.target}: {error}"
            notes.append(Diagnostic("L063", Severity.WARNING, message, rule.origin))
    return notes


class _Relay:
    def __init__(self, simulation: Simulation, source: str, target: str, kind: type) -> None:
        self._bus, self._source, self._kind = simulation.bus, source, kind
        latched = self._bus.is_latched(source)
        # Any: each topic has its own type
        self._publisher: Publisher[Any] = self._bus.advertise(target, kind, latched=latched)
        self._subscription: Subscription | None = None

    def check_subscribers(self) -> None:
        if self._publisher.has_subscribers and self._subscription is None:
            self._subscription = self._bus.subscribe(self._source, self._kind, self._publisher.publish)
        elif not self._publisher.has_subscribers and self._subscription is not None:
            self._subscription.close()
            self._subscription = None
