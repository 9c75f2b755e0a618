"""Writes characters that are not printable as escapes."""

from __future__ import annotations


def with_escapes(text: str, kept: str = "") -> str:
    """Write each character that is not printable, and not in `kept`, as its escape, such as `\\x1b`."""
    return "".join(c if c.isprintable() or c in kept else ascii(c)[1:-1] for c in text)
