"""What a launch plays back. Apart from the player, which loads the readers of recordings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from kbot.ros import names
from kbot.text import Origin


@dataclass(frozen=True, slots=True)
class Playing:
    """Recordings that are said again together: from `start` seconds after the first message on, `rate` times
    as fast, after a `delay` (s). `topics` empty means all; `remaps` are by the recording's names. One that is
    `paused` waits to be let go on. At the end a `required` one ends the launch."""

    paths: tuple[str, ...]
    origin: Origin
    rate: float = 1.0
    start: float = 0.0
    seconds: float | None = None
    delay: float = 0.0
    loop: bool = False
    topics: tuple[str, ...] = ()
    remaps: Mapping[str, str] = field(default_factory=dict)
    prefix: str = ""
    required: bool = False
    paused: bool = False

    def said_on(self, topic: str) -> str:
        """Where a topic of the recording is said."""
        prefix = names.canonical(f"/{self.prefix}") if self.prefix else ""
        return self.remaps.get(topic, f"{prefix}{topic}")
