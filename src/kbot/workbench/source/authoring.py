"""Edits the description from the page: values, source edits, fixes, undo."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from kbot.text import Diagnostic, Edit, KbotError, Span, read_source, rewrite
from kbot.text.numbers import NUMBER
from kbot.workbench.protocol import (
    ApplyFix,
    DropParameters,
    EditSource,
    FromPage,
    KeepParameters,
    Parameter,
    Parameters,
    Redo,
    SetParameter,
    Undo,
)
from kbot.workbench.source.overrides import TRUTHS, Overrides, number_text, value_of
from kbot.workbench.source.places import place_of_span
from kbot.xacro.packages import SHIPPED

if TYPE_CHECKING:
    from kbot.workbench.source.description import DescriptionReading
    from kbot.xacro import Expansion
    from kbot.xacro.binding import Binding


@dataclass(frozen=True, slots=True)
class Written:
    """A number in a file, or a word for true or false, which is then 1 or 0: the span of it."""

    kind: str
    name: str
    value: float
    span: Span

    @property
    def is_truth(self) -> bool:
        return self.span.text in TRUTHS

    def text_of(self, value: float) -> str:
        """Another value as it is written in its place."""
        if not self.is_truth:
            return number_text(value)
        word = "true" if value else "false"
        return word.capitalize() if self.span.text[0].isupper() else word


def written_parameters(expansion: Expansion | None) -> tuple[Written, ...]:
    """Defaults of arguments and properties of the top level, in the order they are written, file by file. Of
    several definitions it is the one that counted."""
    if expansion is None or expansion.scope is None:
        return ()
    files = {file: index for index, file in enumerate((expansion.path, *expansion.dependencies))}
    found = [
        *_written("arg", expansion.defaults.values()),
        *_written("property", expansion.scope.values.values()),
    ]
    return tuple(sorted(found, key=lambda one: (files.get(one.span.file, len(files)), one.span.start)))


def parameters_for_page(written: Iterable[Written], overrides: Overrides) -> tuple[Parameter, ...]:
    return tuple(
        Parameter(
            kind="arg" if one.kind == "arg" else "property",
            name=one.name,
            written=one.value,
            value=overrides.value(one.kind, one.name, one.value),
            is_truth=one.is_truth,
            place=place_of_span(one.span),
        )
        for one in written
    )


def _written(kind: str, bindings: Iterable[Binding]) -> Iterator[Written]:
    for binding in bindings:
        node, origin = binding.node, binding.origin
        if node is None or origin is None:
            continue
        value = value_of(node.attributes.get(binding.attribute, ""))
        if value is not None:
            yield Written(kind, binding.name, value, origin.span)


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


CHANGES = (SetParameter, DropParameters, KeepParameters, EditSource, ApplyFix, Undo, Redo)


class Authoring:
    """What the page may change of a description, and what it has changed.

    `overrides` are those that the description is read with.
    """

    def __init__(self, overrides: Overrides, why_not: str = "") -> None:
        """`why_not` says why nothing may be changed, empty where it may."""
        self.overrides = overrides
        self._why_not = why_not
        self._editor = Editor()
        self._files: tuple[str, ...] = ()
        self._written: tuple[Written, ...] = ()
        self._findings: tuple[Diagnostic, ...] = ()
        self.serial = 0

    def look_at(self, reading: DescriptionReading, findings: tuple[Diagnostic, ...]) -> None:
        """Take note of a new reading, and of its findings in the order the page has them."""
        self._files = reading.files
        self._written = written_parameters(reading.expansion)
        self._findings = findings
        self.serial += 1

    def parameters(self) -> Parameters:
        if self._why_not:
            return Parameters((), "", "")
        parameters = parameters_for_page(self._written, self.overrides)
        return Parameters(parameters, self._editor.undo_title, self._editor.redo_title)

    def obey(self, message: FromPage) -> bool:
        """Do what a page asks; whether it was a change of the description, which is then to be read anew.

        Raises:
            KbotError: it cannot be done; the text says why.
        """
        if self._why_not and isinstance(message, CHANGES):
            raise KbotError(self._why_not)
        match message:
            case SetParameter(kind=kind, name=name, value=value):
                self.overrides.set(kind, name, self._find(kind, name).text_of(value))
            case DropParameters():
                self.overrides.clear()
            case KeepParameters():
                self._keep()
            case EditSource(file=file, line=line, column=column, was=was, text=text):
                if file not in self._files:
                    raise KbotError(f"{file} is not part of this description")
                self._editor.replace(file, int(line), int(column), was, text)
            case ApplyFix(serial=serial, index=index):
                self._fix(int(serial), int(index))
            case Undo():
                self._editor.undo()
            case Redo():
                self._editor.redo()
            case _:
                return False
        return True

    def _find(self, kind: str, name: str) -> Written:
        for one in self._written:
            if (one.kind, one.name) == (kind, name):
                return one
        raise KbotError(f"there is no {kind} {name!r} whose value is a plain number, true or false")

    def _keep(self) -> None:
        changed = [(self._find(*key), text) for key, text in self.overrides.changed.items()]
        edits = [(Edit(w.span, text), w.span.text) for w, text in changed if value_of(text) != w.value]
        if edits:
            names = ", ".join(written.name for written, _ in changed)
            self._editor.apply(f"new values of {names}", edits)
        self.overrides.clear()

    def _fix(self, serial: int, index: int) -> None:
        if serial != self.serial or index >= len(self._findings):
            raise KbotError("the findings have changed: look at them again")
        fix = self._findings[index].fix
        if fix is None:
            raise KbotError("this finding has no fix")
        self._editor.apply(fix.title, [(edit, edit.span.text) for edit in fix.edits])
