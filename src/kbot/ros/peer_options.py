"""What a user may ask to go along with a simulation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from kbot.tf.static_transforms import StaticTransform


@dataclass(frozen=True, slots=True)
class CompanionOptions:
    """A recording and bridges. `topics` are those to record, all when empty; `host` is the address that
    bridges are reached at, loopback when None; without `navigation` goals, plan and map are not bridged.
    `transforms` are said beside the robot's own; `parameters`, by full names, are there for peers to ask."""

    record: str = ""
    topics: tuple[str, ...] = ()
    ros1: bool = False
    foxglove: bool = False
    rosbridge: bool = False
    ros2: bool = False
    host: str | None = None
    navigation: bool = True
    transforms: tuple[StaticTransform, ...] = ()
    parameters: Mapping[str, Any] = field(default_factory=dict)
    zenoh: bool = False

    @property
    def is_live(self) -> bool:
        """Whether somebody out there listens, so that time has to pass as on the wall."""
        return self.ros1 or self.ros2 or self.zenoh or self.foxglove or self.rosbridge

    def __bool__(self) -> bool:
        return self.is_live or bool(self.record or self.transforms)
