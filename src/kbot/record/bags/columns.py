"""What a message has in a table of SQLite, whose columns hold whatever they are given."""

from __future__ import annotations

from typing import Any

Found = Any


def checked(topic: Found, type_name: Found, nanoseconds: Found, data: Found) -> tuple[str, str, int, bytes]:
    """The same. Raises ValueError: one of them is of another kind."""
    if not (isinstance(topic, str) and isinstance(type_name, str)):
        raise ValueError(f"a topic is called {topic!r}, of type {type_name!r}")
    if not isinstance(nanoseconds, int) or nanoseconds < 0:
        raise ValueError(f"a message of {topic} has the time {nanoseconds!r}")
    if not isinstance(data, bytes | memoryview):
        raise ValueError(f"a message of {topic} has {type(data).__name__} in the place of its bytes")
    return topic, type_name, nanoseconds, bytes(data)
