"""Values over the last minutes, for plots."""

from __future__ import annotations

import dataclasses
import json
import math
import struct
from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from kbot.workbench.timeline.history import NOTHING, Frame, History

SCENE, STATE, TOPIC = "scene", "state", "topic:"
"""The keys of the history."""
MOST_MOMENTS = 3000
"""More rows than a plot has columns."""
OF_STATE = "state"

Number = float | None


@dataclass(slots=True)
class SeriesTable:
    """Times on the timeline and by the simulation's clock, with a row of values for each."""

    at: list[float] = field(default_factory=list)
    time: list[float] = field(default_factory=list)
    rows: list[tuple[Number, ...]] = field(default_factory=list)
    is_thinned: bool = False

    def add(self, at: float, time: float, row: tuple[Number, ...]) -> None:
        """Add a row. It replaces the last one at the same time, for example while paused."""
        if self.at and round(at, 4) <= self.at[-1]:
            for column in (self.at, self.time, self.rows):
                column.pop()
        self.at.append(round(at, 4))
        self.time.append(round(time, 6))
        self.rows.append(row)

    def columns(self, count: int) -> tuple[tuple[Number, ...], ...]:
        """Return a list of values for each of `count` fields."""
        return tuple(zip(*self.rows, strict=True)) if self.rows else ((),) * count


Making = Generator[None, None, SeriesTable]
"""A table in the making. The caller can pause at each `None`."""


@dataclass(frozen=True, slots=True)
class Field:
    """Where to find a number: the topic (empty for the state), and the path in its message."""

    topic: str
    path: tuple[str, ...]

    @classmethod
    def named(cls, text: str) -> Field:
        """Parse `/topic path.to.field` or `state path.to.field`."""
        topic, _, path = text.partition(" ")
        return cls("" if topic == OF_STATE else topic, tuple(path.split(".")))


def number_at(message: Any, path: Sequence[str]) -> Number:  # noqa: ANN401 - a message of any type
    """Return the number at a path of a message, 0 or 1 for a boolean, or None."""
    value = message
    for key in path:
        try:
            if dataclasses.is_dataclass(value):
                value = getattr(value, key)
            else:
                value = value[int(key) if isinstance(value, list | tuple) else key]
        except (AttributeError, KeyError, IndexError, TypeError, ValueError):
            return None
    if not isinstance(value, bool | int | float) or not math.isfinite(value):
        return None
    return round(float(value), 9)


def series_of_history(history: History, fields: Sequence[Field], start: float, end: float) -> Making:
    """Return kept values from `start` to `end`: a row for each state, with the latest message of each
    topic."""
    keys = {STATE, SCENE, *(TOPIC + field.topic for field in fields if field.topic)}
    before = start - 1e-9
    table = SeriesTable()
    stride = math.ceil(history.count(STATE, before, end) / MOST_MOMENTS)
    table.is_thinned = stride > 1
    newest: dict[str, Any] = {key: _read(frame) for key, frame in history.at(before, keys - {STATE}).items()}
    joints = _joints(newest.get(SCENE))
    count = 0
    for frames in history.between(keys, before, end):
        unread: dict[str, Frame] = {}
        for at, key, frame in frames:
            if key == SCENE:
                joints = _joints(_read(frame))
            elif key != STATE:
                unread[key] = frame
            else:
                count += 1
                if (count - 1) % stride:
                    continue
                newest.update({key: _read(frame) for key, frame in unread.items()})
                unread.clear()
                state = json.loads(frame)
                state["positions"] = dict(zip(joints, state["positions"], strict=False))
                row = (
                    number_at(state if not field.topic else newest.get(TOPIC + field.topic), field.path)
                    for field in fields
                )
                table.add(at, state["time"], tuple(row))
        newest.update({key: _read(frame) for key, frame in unread.items()})
        yield
    return table


def _joints(scene: Mapping[str, Any] | None) -> list[str]:
    return [joint["name"] for joint in scene["joints"]] if scene else []


def _read(frame: Frame) -> Any:  # noqa: ANN401 - a message of any type
    """Return a topic's message or a scene as plain values without large arrays. None if the key has ended."""
    if frame == NOTHING:
        return None
    if isinstance(frame, bytes):
        (length,) = struct.unpack_from("<I", frame)
        frame = frame[4 : 4 + length].decode()
    value = json.loads(frame)
    return value["message"] if value["type"] == "message" else value
