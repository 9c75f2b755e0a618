"""Bookmarks of times: shared by all pages, and kept in a file beside a recording."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import TypeGuard

from kbot.text import KbotError
from kbot.text.files import read_source, write_bytes
from kbot.workbench.displays.marked_yaml import Marked, read_marked
from kbot.workbench.protocol import Bookmark, Bookmarks, Mark, NoteMark, RemoveMark

MOST = 1000
SUFFIX = ".bookmarks.yaml"
FIELDS = ("at", "time", "note")
HEADER = "# Bookmarks of a recording: seconds from its start, its clock there in s, and what was noted\n"


class Marks:
    """The bookmarks of one run, in the order of their moments."""

    def __init__(self, recording: str = "") -> None:
        """Those of a recording are read from beside it, and written there; without one they last as long as
        this does."""
        self.file = f"{recording.rstrip('/')}{SUFFIX}" if recording else ""
        self.note = ""
        """Why what is in the file is not shown, empty where it is."""
        self._all: list[Bookmark] = []
        self._count = 0
        self._text = ""
        """What is in the file, as far as is known."""
        if self.file and Path(self.file).exists():
            try:
                self._text = read_source(self.file).text
                self._all = _read(self._text, self.file)
            except KbotError as error:
                self.note = f"{error} (its bookmarks are not shown, and no others can be set)"
            self._count = len(self._all)

    @property
    def view(self) -> Bookmarks:
        return Bookmarks(tuple(self._all))

    def obey(self, order: Mark | NoteMark | RemoveMark) -> None:
        """Set a bookmark, write on one, or remove it; one that is gone already is passed over.

        Raises:
            KbotError: there are very many, or the file beside the recording cannot be written without losing
                what others wrote in it.
        """
        if self.note:
            raise KbotError(self.note)
        changed = list(self._all)
        match order:
            case Mark(at=at, time=time):
                if len(changed) >= MOST:
                    raise KbotError(f"{MOST} bookmarks are set: remove some first")
                changed.append(Bookmark(self._count + 1, round(at, 3), round(time, 3), self._unused_name()))
                changed.sort(key=lambda one: one.at)
            case NoteMark(number=number, note=note):
                changed = [replace(one, note=note) if one.number == number else one for one in changed]
            case RemoveMark(number=number):
                changed = [one for one in changed if one.number != number]
        if self.file:
            self._require_untouched()
            text = _written(changed)
            write_bytes(self.file, text.encode())
            self._text = text
        self._all = changed
        self._count += isinstance(order, Mark)

    def _require_untouched(self) -> None:
        """Raises KbotError: what others wrote in the file would be lost."""
        if Path(self.file).exists() and read_source(self.file).text != self._text:
            raise KbotError(f"{self.file} has changed since it was read: open the recording anew")
        if _has_comments(self._text):
            raise KbotError(f"{self.file} has comments, which would be lost: write bookmarks there")

    def _unused_name(self) -> str:
        names = {one.note for one in self._all}
        return next(name for n in range(1, MOST + 2) if (name := f"Bookmark {n}") not in names)


def _read(text: str, file: str) -> list[Bookmark]:
    """Raises KbotError: it holds something else; with file:line."""
    document = read_marked(text, file)
    entries = document.items if document.value is not None else []
    found = [_bookmark(number, entry) for number, entry in enumerate(entries, 1)]
    return sorted(found, key=lambda one: one.at)


def _bookmark(number: int, entry: Marked) -> Bookmark:
    fields = entry.fields
    at, time, note = (fields[name].value if name in fields else None for name in FIELDS)
    if not (_is_number(at) and at >= 0 and _is_number(time) and isinstance(note, str)):
        raise entry.error("a bookmark has 'at' and 'time', in seconds, and a 'note'")
    for name, field in fields.items():
        if name not in FIELDS:
            raise field.error(f"a bookmark has no '{name}': the file is another program's")
    return Bookmark(number, float(at), float(time), note)


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _has_comments(text: str) -> bool:
    """Whether there are others than KBot's own: between two tokens of YAML there is nothing else."""
    import yaml  # lazy in this module: start-up time

    text = text.removeprefix(HEADER)
    try:
        pairs = list(pairwise(yaml.scan(text, yaml.SafeLoader)))
    except yaml.YAMLError:  # as for a tab before a value, which only LibYAML reads
        return "#" in text
    return any("#" in text[one.end_mark.index : next_one.start_mark.index] for one, next_one in pairs)


def _written(all_of_them: list[Bookmark]) -> str:
    import yaml

    plain = [{"at": one.at, "time": one.time, "note": one.note} for one in all_of_them]
    return HEADER + str(yaml.safe_dump(plain, sort_keys=False, allow_unicode=True))
