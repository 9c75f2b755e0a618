"""Searches folders within limits: a folder may have millions of files, or thousands of nested levels."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path

from kbot.text.errors import KbotError

MOST_SEARCHED = 1_000_000
"""Files and folders that a search visits, in about 5 s. Workspaces with many packages have a tenth."""
_MOST_NAMES = 10_000
"""Names of a folder among which a similar one is searched."""
_SKIPPED = frozenset({"build", "install", "log", "devel", "node_modules", "__pycache__"})
"""Folders that tools create. Their files are copies, or not the user's."""
_VIRTUAL = frozenset({"/proc", "/sys", "/dev"})
"""File systems of the kernel. They have no robots, but hundreds of thousands of files."""
_VIRTUAL_NAMES = frozenset(map(os.path.basename, _VIRTUAL))


def files_below(
    folder: str | os.PathLike[str],
    is_wanted: Callable[[str], bool],
    progress: Callable[[str], None] = lambda _: None,
) -> Iterator[str]:
    """The paths of the files below a folder whose names are wanted, the nearest ones first.

    Hidden folders, and those that build tools create, are skipped. Links to folders are not followed.
    `progress` receives each folder.

    Raises:
        KbotError: there are more than MOST_SEARCHED files and folders.
    """
    top = os.fspath(folder)
    waiting, searched = deque([top]), 0
    while waiting:
        here = waiting.popleft()
        progress(here)
        if os.path.basename(here) in _VIRTUAL_NAMES and os.path.realpath(here) in _VIRTUAL:
            continue
        try:
            with os.scandir(here) as entries:
                for entry in entries:
                    searched += 1
                    if searched > MOST_SEARCHED:
                        raise KbotError(
                            f"{top} has more than {MOST_SEARCHED:,} files and folders, too many to search. "
                            "Choose a folder in it"
                        )
                    if entry.is_dir(follow_symlinks=False):
                        if entry.name not in _SKIPPED and not entry.name.startswith("."):
                            waiting.append(entry.path)
                    # entry.is_dir() would raise an error for a link to what is not readable, or to itself
                    elif is_wanted(entry.name) and not os.path.isdir(entry.path):
                        yield str(Path(entry.path))
        except OSError:  # not readable, deleted in the meantime, or its path is too long for the system
            continue


def names_in(folder: str | os.PathLike[str]) -> list[str]:
    """Names in a folder, of which a user may have meant one. Empty if it cannot be listed."""
    try:
        with os.scandir(os.fspath(folder) or ".") as entries:
            return [entry.name for entry in islice(entries, _MOST_NAMES)]
    except (OSError, ValueError):  # a null character in its name
        return []
