"""Gives Python launch files an `os.environ` with the variables that ROS sets."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

from kbot.xacro.ros_variables import ros_value

_BETWEEN = (__name__, "os", "_collections_abc", "collections.abc")
"""The modules between the line `os.getenv(…)` of a launch file and `__getitem__`."""


@contextmanager
def ros_environment() -> Iterator[None]:
    """Within the block, a variable that ROS sets has a value in `os.environ` also if it is not set.

    KBot itself does not see these values: it finds its own packages and connections by the variables.
    """
    original = os.environ
    os.environ = _RosEnvironment(original)  # noqa: B003 - it shares the data of the original
    try:
        yield
    finally:
        os.environ = original  # noqa: B003 - see above


class _RosEnvironment(os._Environ[str]):
    def __init__(self, original: os._Environ[str]) -> None:
        vars(self).update(vars(original))

    def __getitem__(self, key: str) -> str:
        try:
            return super().__getitem__(key)
        except KeyError:
            value = ros_value(key) if _is_read_by_launch_file() else None
            if value is None:
                raise
            return value

    def get(self, key: str, default: Any = None) -> Any:  # Any: as in Mapping
        """The value of a variable. The default that a launch file gives comes before that of KBot."""
        try:
            return self[key] if default is None else super().__getitem__(key)
        except KeyError:
            return default


def _is_read_by_launch_file() -> bool:
    frame: FrameType | None = sys._getframe(1)
    while frame is not None and frame.f_globals.get("__name__") in _BETWEEN:
        frame = frame.f_back
    return frame is not None and not frame.f_globals.get("__name__", "").startswith("kbot.")
