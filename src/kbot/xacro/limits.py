"""What a description may cost. Every bound is a clear error (X190 to X199) and can be raised."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Limits:
    """Bounds on one expansion; a caller raises them with `Limits(steps=…)`.

    With the defaults an expansion from a stranger ends within about half a minute and half a
    gigabyte, whatever it holds; real robots stay a hundred times below them.
    """

    file_bytes: int = 32 * 1024 * 1024
    """Size of one file that is read."""
    nesting: int = 1000
    """Depth of elements, macro calls and includes taken together."""
    includes: int = 100
    """Depth of files that include one another."""
    macro_calls: int = 500
    """Depth of macros that call one another."""
    nodes: int = 2_000_000
    """Elements and texts of the result, and of all that is evaluated on the way to it."""
    text: int = 64 * 1024 * 1024
    """Characters of evaluated text in all."""
    steps: int = 5_000_000
    """Items that loops and functions of expressions go through."""
    length: int = 4_000_000
    """Length of one string, list, tuple, set or dictionary."""
    bits: int = 32_768
    """Size of one whole number."""
    function_depth: int = 100
    """Depth of lambda functions that call one another."""
    errors: int = 200
    """Errors after which expansion gives up."""


DEFAULT = Limits()
