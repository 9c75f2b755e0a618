"""Splits command lines of launch files into words."""

from __future__ import annotations

import os
import shlex


def split_words(text: str, *, windows: bool = os.name == "nt") -> list[str]:
    """The words of a command line, split at spaces and quotes like a shell does. On Windows a backslash is
    not an escape character, because `$(find …)` gives paths with backslashes.

    Raises:
        ValueError: a quote is not closed.
    """
    if not windows:
        return shlex.split(text)
    lexer = shlex.shlex(text, posix=True)
    lexer.whitespace_split, lexer.commenters, lexer.escape = True, "", ""
    return list(lexer)
