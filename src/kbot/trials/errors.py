"""Errors in one line, for the results of trials that could not run."""

from __future__ import annotations

from kbot.text import DescriptionError, KbotError
from kbot.worker import LimitExceeded

_LONGEST_LINE = 2000
"""Characters of an error in one line."""


def first_error(error: KbotError) -> str:
    """An error in one line, with file, line and column if it has them."""
    if isinstance(error, DescriptionError):
        errors = [found for found in error.diagnostics if found.is_error] or list(error.diagnostics)
        rest = len(errors) - 1
        more = f" (and {rest} more error{'s' if rest > 1 else ''})" if rest else ""
        return f"{one_line(str(errors[0]))}{more}"
    return one_line(str(error))


def one_line(text: str) -> str:
    """A text in one line. Its end is left out if it is long: a script may raise an error with any text."""
    line = " ".join(text[: 2 * _LONGEST_LINE].split())
    return line if len(line) <= _LONGEST_LINE else f"{line[:_LONGEST_LINE]}…"


def sentence(error: Exception | None, what: str) -> str:
    """An error in one line. `what` is what was done."""
    if isinstance(error, LimitExceeded):
        return f"{what} {error}"
    if isinstance(error, KbotError):
        return first_error(error)
    return f"{what}: {type(error).__name__}: {one_line(str(error))}".removesuffix(": ")
