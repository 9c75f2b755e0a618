"""The options of a recording: its file and its topics."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class RecordOptions:
    """The file to record to, none if empty, and the topics to record, all if empty."""

    path: str = ""
    topics: tuple[str, ...] = ()
