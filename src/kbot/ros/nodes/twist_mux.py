"""twist_mux: passes on the command with the highest priority of several topics."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from math import inf

from kbot.messages import Bus, Clock, Twist, TwistStamped
from kbot.messages.clock import NANOSECONDS
from kbot.messages.sensing import Bool
from kbot.text import Diagnostic, KbotError, Origin, Severity


@dataclass(frozen=True, slots=True)
class MuxInput:
    """A topic of commands, or of a lock. Without messages for `timeout` (s; 0 means forever) the commands
    lose their priority, and the lock is closed."""

    topic: str
    timeout: float
    priority: float


@dataclass(frozen=True, slots=True)
class MuxSettings:
    """The topics of a twist_mux, with full names. `is_stamped`: whether its messages are TwistStamped; None
    if the launch does not set it: then they are those of the robot's drive."""

    commands: tuple[MuxInput, ...]
    locks: tuple[MuxInput, ...]
    output: str
    is_stamped: bool | None
    origin: Origin


class TwistMux:
    """Runs a twist_mux on the bus of a simulation."""

    def __init__(self, bus: Bus, clock: Clock, settings: MuxSettings) -> None:
        """Raises KbotError: the output does not exist or is an input too, or a topic has another type."""
        self._bus, self._clock, self._settings = bus, clock, settings
        self._received: dict[MuxInput, float] = {}
        """The time in s of the last message of each input."""
        self._closed: set[MuxInput] = set()
        """The locks whose last message closed them."""
        self._output = bus.require(settings.output)
        is_stamped = self._output is TwistStamped if settings.is_stamped is None else settings.is_stamped
        kind = TwistStamped if is_stamped else Twist
        kinds = {command: bus.topics.get(command.topic, kind) for command in settings.commands}
        for command, own in kinds.items():
            if command.topic == settings.output:
                raise KbotError(f"{command.topic} is both an input and the output")
            if own not in (Twist, TwistStamped):
                raise KbotError(f"topic {command.topic} carries {own.__name__}, not {kind.__name__}")
        for lock in settings.locks:
            bus.subscribe(lock.topic, Bool, partial(self._lock, lock))
        # last: without a twist_mux, the robot must continue to receive commands
        for command, own in kinds.items():
            # a robot subscribes to cmd_vel in any case; behind a twist_mux, it must not receive it twice
            bus.divert(command.topic, own, partial(self._command, command))

    def _command(self, command: MuxInput, message: Twist | TwistStamped) -> None:
        self._received[command] = self._now
        active = [other for other in self._settings.commands if self._is_active(other)]
        if max(active, key=lambda other: other.priority, default=None) is not command:
            return
        twist = message.twist if isinstance(message, TwistStamped) else message
        self._bus.publish(
            self._settings.output, twist if self._output is Twist else TwistStamped(twist=twist)
        )

    def _lock(self, lock: MuxInput, message: Bool) -> None:
        self._received[lock] = self._now
        (self._closed.add if message.data else self._closed.discard)(lock)

    def _is_active(self, command: MuxInput) -> bool:
        closed = (lock for lock in self._settings.locks if lock in self._closed or self._has_expired(lock))
        is_received = command in self._received and not self._has_expired(command)
        return is_received and command.priority >= max((lock.priority for lock in closed), default=0.0)

    def _has_expired(self, given: MuxInput) -> bool:
        return 0.0 < given.timeout < self._now - self._received.get(given, -inf)

    @property
    def _now(self) -> float:
        return self._clock.nanoseconds / NANOSECONDS


def run_muxes(bus: Bus, clock: Clock, muxes: tuple[MuxSettings, ...]) -> list[Diagnostic]:
    """Run the twist_muxes of a launch. Returns why one does not run or drives nothing."""
    notes = []
    for settings in muxes:
        hint = ""
        try:
            if settings.output not in bus.inputs:
                hint = "remap cmd_vel_out to the topic of the robot's drive"
                raise KbotError(f"no robot subscribes to {settings.output}")
            TwistMux(bus, clock, settings)
        except KbotError as error:
            message = f"the twist_mux is not run: {error}"
            notes.append(Diagnostic("L063", Severity.WARNING, message, settings.origin, hint))
    return notes
