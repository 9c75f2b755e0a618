"""The settings of `rosbag play` in a launch file, separate from the player, which loads much more."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from kbot.ros import names
from kbot.text import Origin


@dataclass(frozen=True, slots=True)
class Playing:
    """Recordings that are played back together.

    Playback starts `start` seconds after the first message, and ends after `seconds` of the recording, or at
    its end if None. `rate` is a factor of speed, `delay` is in s. If `topics` is empty, all are played back.
    `remaps` has the recording's names as keys. If `required`, the end of the playback ends the launch.
    """

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

    def published_name(self, topic: str) -> str:
        """The name on which a topic of the recording is published."""
        prefix = names.canonical(f"/{self.prefix}") if self.prefix else ""
        return self.remaps.get(topic, f"{prefix}{topic}")
