"""Changes that the page makes to the description's files: each checked, written whole, and undone."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from kbot.text import Edit, KbotError, Span, read_source, rewrite
from kbot.text.numbers import NUMBER
from kbot.xacro.packages import SHIPPED

MOST_UNDONE = 200
_EXPRESSION = re.compile(r"\$\{[^$}]+\}|\$\([^$)]+\)")
_NOT_IN_AN_ATTRIBUTE = frozenset("<>&\"'\r\n\0")


@dataclass(frozen=True, slots=True)
class _Change:
    title: str
    texts: tuple[tuple[str, str, str], ...]
    """File, its text before, its text after."""
    spot: tuple[str, int] | None = None
    """File and offset of a single value: changing it again and again, as a drag does, is one change."""


class Editor:
    """Writes changes, and remembers them to take them back."""

    def __init__(self) -> None:
        self._done: list[_Change] = []
        self._undone: list[_Change] = []

    @property
    def undo_title(self) -> str:
        """What `undo` would take back; empty when there is nothing."""
        return self._done[-1].title if self._done else ""

    @property
    def redo_title(self) -> str:
        """What `redo` would do again; empty when there is nothing."""
        return self._undone[-1].title if self._undone else ""

    def replace(self, file: str, line: int, column: int, was: str, text: str) -> None:
        """Replace the number that stands at a line and column (1-based) within an attribute.

        Raises:
            KbotError: something else stands there now, or the text does not belong in an attribute, or is
                neither a finite number nor makes one when it is expanded.
        """
        if _NOT_IN_AN_ATTRIBUTE & set(text):
            raise KbotError("a value cannot hold quotes, angle brackets, & or line ends")
        if not _is_value(text):
            raise KbotError(f"{text!r} is no finite number, nor does it hold ${{…}} or $(…)")
        source = read_source(file)
        start = source.offset(line, column)
        end = start + len(was.encode())
        if source.line_column(start) != (line, column):
            raise KbotError(f"{Path(file).name} has no line {line}, column {column}")
        self.apply(f"{was} → {text}", [(Edit(Span(source, start, end), text), was)], (file, start))

    def apply(
        self, title: str, edits: Sequence[tuple[Edit, str]], spot: tuple[str, int] | None = None
    ) -> None:
        """Carry out edits, each with the text that it replaces; all of them or none.

        Raises:
            KbotError: a file has changed meanwhile, cannot be written, or is KBot's own.
        """
        by_file: dict[str, list[tuple[Edit, str]]] = {}
        for edit, was in edits:
            by_file.setdefault(edit.span.file, []).append((edit, was))
        texts = tuple(_changed(file, both) for file, both in by_file.items())
        rewrite({file: (before, after) for file, before, after in texts})
        last = self._done[-1] if self._done else None
        if last is not None and spot is not None and last.spot == spot and last.texts[0][2] == texts[0][1]:
            file, before, _ = last.texts[0]
            title = f"{last.title.split(' → ')[0]} → {title.split(' → ')[-1]}"
            texts = ((file, before, texts[0][2]),)
            self._done.pop()
        self._done = [*self._done[-MOST_UNDONE + 1 :], _Change(title, texts, spot)]
        self._undone.clear()

    def undo(self) -> None:
        """Take back the last change; what was changed elsewhere since stays.

        Raises:
            KbotError: there is none, or what it wrote was changed since.
        """
        if not self._done:
            raise KbotError("there is nothing to undo")
        texts = _swapped([(file, after, before) for file, before, after in self._done[-1].texts])
        change = self._done.pop()
        self._undone.append(replace(change, texts=tuple((file, put, was) for file, was, put in texts)))

    def redo(self) -> None:
        """Do again what was taken back last; what was changed elsewhere since stays.

        Raises:
            KbotError: there is nothing, or what was there was changed since.
        """
        if not self._undone:
            raise KbotError("there is nothing to do again")
        texts = _swapped(self._undone[-1].texts)
        self._done.append(replace(self._undone.pop(), texts=tuple(texts)))


def _swapped(texts: Iterable[tuple[str, str, str]]) -> list[tuple[str, str, str]]:
    """Put texts in the place of others, by file that to be replaced and that to be put; as what was on disk
    was replaced by what."""
    done = []
    for file, was, put in texts:
        now = read_source(file).text
        text = put if now == was else _merged(now, was, put)
        if text is None:
            raise KbotError(
                f"{Path(file).name} was changed at this place since: change it back where that was done"
            )
        done.append((file, now, text))
    rewrite({file: (now, text) for file, now, text in done})
    return done


def _merged(now: str, was: str, put: str) -> str | None:
    """A text with the lines in which `put` differs from `was`; None where those of `was` do not stand in it
    once, beside one of their neighbours."""
    old, new, lines = (text.splitlines(keepends=True) for text in (was, put, now))
    head = _same(old, new)
    tail = min(_same(old[::-1], new[::-1]), len(old) - head, len(new) - head)
    middle = old[head : len(old) - tail]
    above, below = old[head - 1 : head], old[len(old) - tail : len(old) - tail + 1]
    found = [
        at
        for at in range(len(lines) - len(middle) + 1)
        if middle
        and lines[at : at + len(middle)] == middle
        and (lines[at - 1 : at] == above or lines[at + len(middle) : at + len(middle) + 1] == below)
    ]
    if len(found) != 1:
        return None
    (at,) = found
    return "".join([*lines[:at], *new[head : len(new) - tail], *lines[at + len(middle) :]])


def _same(one: Sequence[str], other: Sequence[str]) -> int:
    """How many lines are the same from the start."""
    return next(
        (n for n, (a, b) in enumerate(zip(one, other, strict=False)) if a != b), min(len(one), len(other))
    )


def _is_value(text: str) -> bool:
    if _EXPRESSION.search(text):
        return True
    return NUMBER.fullmatch(text) is not None and math.isfinite(float(text))


def _changed(file: str, edits: Iterable[tuple[Edit, str]]) -> tuple[str, str, str]:
    if Path(file).absolute().is_relative_to(SHIPPED):
        raise KbotError("this robot ships with KBot and is not changed: work on a copy of its package")
    source = read_source(file)
    data, at = source.data, len(source.data) + 1
    for edit, was in sorted(edits, key=lambda both: both[0].span.start, reverse=True):
        start, end = edit.span.start, edit.span.end
        if end > at:
            raise KbotError("two changes of the same place")
        if data[start:end] != was.encode():
            raise KbotError(f"{Path(file).name} has changed: look at it again")
        data, at = data[:start] + edit.replacement.encode() + data[end:], start
    return file, source.text, data.decode()
