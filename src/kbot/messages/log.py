"""Messages for logs: rcl_interfaces/Log."""

from __future__ import annotations

from dataclasses import dataclass

from kbot.messages.types import Time, UInt8, UInt32

INFO, ERROR = 20, 40
"""Levels of a log entry."""
START = Time()


@dataclass(frozen=True, slots=True)
class Log:
    """An entry: `msg` is the text, `name` the program that wrote it, `file` and `line` its place or empty."""

    stamp: Time = START
    level: UInt8 = INFO
    name: str = ""
    msg: str = ""
    file: str = ""
    function: str = ""
    line: UInt32 = 0
