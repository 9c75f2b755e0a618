"""Checks before long runs that their outputs can be written, and overwrite no other file."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from kbot.text.errors import KbotError

_BEGINNING = 2000
"""Bytes of a file that show whether it is a report."""


def require_place(path: str) -> None:
    """Raises KbotError: a file cannot be written, because its folder is missing or it is a folder."""
    folder = Path(path).parent
    if not folder.is_dir():
        raise KbotError(f"{path} cannot be written: the folder {folder} does not exist")
    if Path(path).is_dir():
        raise KbotError(f"{path} cannot be written: it is a folder")


def require_report_place(path: str, mark: str) -> None:
    """Raises KbotError: a report cannot be written, or would overwrite a file that is not such a report.

    `mark` is a text near the beginning of each such report. An empty file and a device may be written to.
    """
    require_place(path)
    if not Path(path).is_file():
        return
    try:
        with Path(path).open("rb") as file:
            beginning = file.read(_BEGINNING)
    except OSError as error:
        raise KbotError(f"{path} cannot be written: {error.strerror}") from None
    if beginning and mark.encode() not in beginning:
        raise KbotError(
            f"{path} exists and is not a report of this command. Choose another file, or delete this one"
        )


def require_different(paths: Sequence[str]) -> None:
    """Raises KbotError: two outputs of a command are the same file."""
    places: set[str] = set()
    for path in paths:
        place = os.path.realpath(path)
        if place in places and not _is_device(path):
            raise KbotError(f"two outputs of this command are the same file: {path}. Choose different files")
        places.add(place)


def _is_device(path: str) -> bool:
    """Whether a path is a device or a pipe, such as /dev/null, which is never replaced."""
    return Path(path).exists() and not Path(path).is_file()
