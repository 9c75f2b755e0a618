"""What a user may ask to go along with a simulation."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Wishes:
    """A recording and bridges. `topics` are those to record, all when empty; `host` is the address that
    bridges are reached at, loopback when None; without `navigation` goals, plan and map are not bridged."""

    record: str = ""
    topics: tuple[str, ...] = ()
    ros1: bool = False
    foxglove: bool = False
    rosbridge: bool = False
    ros2: bool = False
    host: str | None = None
    navigation: bool = True

    @property
    def is_live(self) -> bool:
        """Whether somebody out there listens, so that time has to pass as on the wall."""
        return self.ros1 or self.ros2 or self.foxglove or self.rosbridge

    def __bool__(self) -> bool:
        return self.is_live or bool(self.record)
