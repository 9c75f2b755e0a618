"""Splits a command line of a launch file into words."""

from __future__ import annotations

import os
import shlex


def split_words(text: str, *, windows: bool = os.name == "nt") -> list[str]:
    """Words with spaces between, quoted ones whole, as a shell has them. On Windows a backslash is part of a
    path, as `$(find …)` gives it, and quotes nothing.

    Raises:
        ValueError: a quote is not closed.
    """
    if not windows:
        return shlex.split(text)
    lexer = shlex.shlex(text, posix=True)
    lexer.whitespace_split, lexer.commenters, lexer.escape = True, "", ""
    return list(lexer)
