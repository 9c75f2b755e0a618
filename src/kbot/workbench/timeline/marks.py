"""Bookmarks of times: shared by all pages, and kept in a file beside a recording."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import TypeGuard

from kbot.text import KbotError
from kbot.text.files import read_source, write_text
from kbot.workbench.displays.marked_yaml import Marked, read_marked
from kbot.workbench.protocol import Bookmark, Bookmarks, Mark, NoteMark, RemoveMark

MOST = 1000
"""Bookmarks of one run."""
SUFFIX = ".bookmarks.yaml"
FIELDS = ("at", "time", "note")
HEADER = "# Bookmarks of a recording: seconds from its start, its clock there in s, and what was noted\n"


class Marks:
    """The bookmarks of one run, ordered by time."""

    def __init__(self, recording: str = "") -> None:
        """With a recording, they are read from and written to a file beside it. Without one they are not
        saved."""
        self.file = f"{recording.rstrip('/')}{SUFFIX}" if recording else ""
        self.note = ""
        """Why the file's bookmarks are not displayed, or empty."""
        self._all: list[Bookmark] = []
        self._count = 0
        self._text = ""
        """The last known content of the file."""
        if self.file and Path(self.file).exists():
            try:
                self._text = read_source(self.file).text
                self._all = _read(self._text, self.file)
            except KbotError as error:
                self.note = f"{error} (these bookmarks are not shown, and you cannot set new ones)"
            self._count = len(self._all)

    @property
    def view(self) -> Bookmarks:
        return Bookmarks(tuple(self._all))

    def handle(self, order: Mark | NoteMark | RemoveMark) -> None:
        """Set a bookmark, change its note, or remove it. A bookmark that does not exist is ignored.

        Raises:
            KbotError: there are too many, or writing the file would lose the changes of other programs.
        """
        if self.note:
            raise KbotError(self.note)
        changed = list(self._all)
        match order:
            case Mark(at=at, time=time):
                if len(changed) >= MOST:
                    raise KbotError(f"the limit of {MOST} bookmarks is reached. Remove some first")
                changed.append(Bookmark(self._count + 1, round(at, 3), round(time, 3), self._unused_name()))
                changed.sort(key=lambda mark: mark.at)
            case NoteMark(number=number, note=note):
                changed = [replace(mark, note=note) if mark.number == number else mark for mark in changed]
            case RemoveMark(number=number):
                changed = [mark for mark in changed if mark.number != number]
        if self.file:
            self._require_untouched()
            text = _written(changed)
            write_text(self.file, text)
            self._text = text
        self._all = changed
        self._count += isinstance(order, Mark)

    def _require_untouched(self) -> None:
        """Raise KbotError if writing the file would lose changes of other programs."""
        if Path(self.file).exists() and read_source(self.file).text != self._text:
            raise KbotError(f"{self.file} has changed since it was read. Open the recording again")
        if _has_comments(self._text):
            raise KbotError(f"{self.file} has comments, which would be lost. Edit the bookmarks in that file")

    def _unused_name(self) -> str:
        names = {mark.note for mark in self._all}
        return next(name for n in range(1, MOST + 2) if (name := f"Bookmark {n}") not in names)


def _read(text: str, file: str) -> list[Bookmark]:
    """Raises KbotError with file:line if the text does not contain bookmarks."""
    document = read_marked(text, file)
    entries = document.items if document.value is not None else []
    found = [_bookmark(number, entry) for number, entry in enumerate(entries, 1)]
    return sorted(found, key=lambda mark: mark.at)


def _bookmark(number: int, entry: Marked) -> Bookmark:
    fields = entry.fields
    at, time, note = (fields[name].value if name in fields else None for name in FIELDS)
    if not (_is_number(at) and at >= 0 and _is_number(time) and isinstance(note, str)):
        raise entry.error("a bookmark needs 'at' and 'time' in seconds, and a 'note'")
    for name, field in fields.items():
        if name not in FIELDS:
            raise field.error(f"unknown field '{name}' in a bookmark: another program wrote this file")
    return Bookmark(number, float(at), float(time), note)


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _has_comments(text: str) -> bool:
    """Return whether there are comments other than KBot's. Between two YAML tokens there is nothing else."""
    import yaml  # imported lazily, for a fast start-up

    text = text.removeprefix(HEADER)
    try:
        pairs = list(pairwise(yaml.scan(text, yaml.SafeLoader)))
    except yaml.YAMLError:  # for example a tab before a value, which only LibYAML reads
        return "#" in text
    return any("#" in text[token.end_mark.index : following.start_mark.index] for token, following in pairs)


def _written(marks: list[Bookmark]) -> str:
    import yaml

    plain = [{"at": mark.at, "time": mark.time, "note": mark.note} for mark in marks]
    return HEADER + str(yaml.safe_dump(plain, sort_keys=False, allow_unicode=True))
