"""Parses numbers in descriptions and on command lines."""

from __future__ import annotations

import re

NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?", re.ASCII)
"""A finite number in URDF."""


def to_float(text: str) -> float:
    """A number in ASCII digits, as C's strtod (and so ROS) reads it. NaN and infinity are accepted.

    Raises:
        ValueError: the text is not a number. This includes `1_000` and digits of other scripts, which Python
            accepts.
    """
    if not text.isascii() or "_" in text:
        raise ValueError(f"not a number: {text!r}")
    return float(text)
