"""Edit the description from the page: values, source edits, fixes, undo."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from kbot.model.units import units_of
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
from kbot.workbench.source.merging import merge
from kbot.workbench.source.overrides import Overrides
from kbot.workbench.source.places import place_of_span
from kbot.workbench.source.saving import SHIPPED_REASON
from kbot.xacro.packages import is_shipped
from kbot.xacro.written_values import WrittenValue, value_of, written_parameters

if TYPE_CHECKING:
    from kbot.workbench.source.description import DescriptionReading


DIGITS = 9
"""Digits of a slider's value: a drag computes more than anyone wants in a file."""
MOST_UNDONE = 200
"""Changes that can be undone."""
_EXPRESSION = re.compile(r"\$\{[^$}]+\}|\$\([^$)]+\)")
_NOT_IN_AN_ATTRIBUTE = frozenset("<>&\"'\r\n\0")


@dataclass(frozen=True, slots=True)
class _Change:
    title: str
    texts: tuple[tuple[str, str, str], ...]
    """File, its text before, its text after."""
    spot: tuple[str, int] | None = None
    """File and offset of a single value. Repeated changes of it, as in a drag, count as one change."""


class Editor:
    """Writes changes, and keeps them for undo."""

    def __init__(self, before_change: Callable[[Iterable[str]], None]) -> None:
        """`before_change` raises KbotError for a file that may not be changed."""
        self._before_change = before_change
        self._done: list[_Change] = []
        self._undone: list[_Change] = []

    @property
    def undo_title(self) -> str:
        """The title of the change that `undo` would undo, or empty."""
        return self._done[-1].title if self._done else ""

    @property
    def redo_title(self) -> str:
        """The title of the change that `redo` would redo, or empty."""
        return self._undone[-1].title if self._undone else ""

    def replace(self, file: str, line: int, column: int, was: str, text: str) -> None:
        """Replace the number at a line and column (1-based) within an attribute.

        Raises:
            KbotError: the text there has changed, the new text is not allowed in an attribute, or it is
                neither a finite number nor an expression.
        """
        self._before_change((file,))
        if _NOT_IN_AN_ATTRIBUTE & set(text):
            raise KbotError("a value cannot contain quotes, angle brackets, & or line breaks")
        if not _is_value(text):
            raise KbotError(f"{text!r} is neither a finite number nor an expression with ${{…}} or $(…)")
        source = read_source(file)
        start = source.offset(line, column)
        end = start + len(was.encode())
        if source.line_column(start) != (line, column):
            raise KbotError(f"{Path(file).name} has no line {line}, column {column}")
        self.apply(f"{was} → {text}", [(Edit(Span(source, start, end), text), was)], (file, start))

    def apply(
        self, title: str, edits: Sequence[tuple[Edit, str]], spot: tuple[str, int] | None = None
    ) -> None:
        """Write all edits or none, each with the text that it replaces.

        Raises:
            KbotError: a file has changed meanwhile, cannot be written, or ships with KBot.
        """
        by_file: dict[str, list[tuple[Edit, str]]] = {}
        for edit, was in edits:
            by_file.setdefault(edit.span.file, []).append((edit, was))
        self._before_change(by_file)
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
        """Undo the last change. Later changes at other places are kept.

        Raises:
            KbotError: there is none, or its text was changed since.
        """
        if not self._done:
            raise KbotError("there is nothing to undo")
        texts = _replace_texts([(file, after, before) for file, before, after in self._done[-1].texts])
        change = self._done.pop()
        self._undone.append(replace(change, texts=tuple((file, put, was) for file, was, put in texts)))

    def redo(self) -> None:
        """Redo the change that was undone last. Later changes at other places are kept.

        Raises:
            KbotError: there is none, or the text there was changed since.
        """
        if not self._undone:
            raise KbotError("there is nothing to redo")
        texts = _replace_texts(self._undone[-1].texts)
        self._done.append(replace(self._undone.pop(), texts=tuple(texts)))


def _replace_texts(texts: Iterable[tuple[str, str, str]]) -> list[tuple[str, str, str]]:
    """Replace texts, given as file, text to replace and new text.

    Returns the file, the text on disk before, and the text written.
    """
    done = []
    for file, was, put in texts:
        now = read_source(file).text
        text = merge(was, put, now)
        if text is None:
            raise KbotError(
                f"{Path(file).name} was changed at this place after the edit. Change it back in your editor"
            )
        done.append((file, now, text))
    rewrite({file: (now, text) for file, now, text in done})
    return done


def _is_value(text: str) -> bool:
    if _EXPRESSION.search(text):
        return True
    return NUMBER.fullmatch(text) is not None and math.isfinite(float(text))


def _changed(file: str, edits: Iterable[tuple[Edit, str]]) -> tuple[str, str, str]:
    if is_shipped(file):
        raise KbotError(SHIPPED_REASON)
    source = read_source(file)
    data, at = source.data, len(source.data) + 1
    for edit, was in sorted(edits, key=lambda both: both[0].span.start, reverse=True):
        start, end = edit.span.start, edit.span.end
        if end > at:
            raise KbotError("two edits overlap")
        if data[start:end] != was.encode():
            raise KbotError(f"{Path(file).name} has changed. Open it again")
        data, at = data[:start] + edit.replacement.encode() + data[end:], start
    return file, source.text, data.decode()


CHANGES = (SetParameter, DropParameters, KeepParameters, EditSource, ApplyFix, Undo, Redo)


class Authoring:
    """What the page may change in a description, and what it has changed.

    The description is read with `overrides`.
    """

    def __init__(
        self,
        overrides: Overrides,
        before_change: Callable[[Iterable[str]], None],
        read_only_reason: str = "",
    ) -> None:
        """`before_change` raises KbotError for a file that pages may not change. `read_only_reason` is the
        reason why nothing may be changed, or empty."""
        self.overrides = overrides
        self.read_only_reason = read_only_reason
        self._editor = Editor(before_change)
        self._written: tuple[WrittenValue, ...] = ()
        self._units: Mapping[int, str] = {}
        self._findings: tuple[Diagnostic, ...] = ()
        self.serial = 0

    def take_reading(self, reading: DescriptionReading, findings: tuple[Diagnostic, ...]) -> None:
        """Use a new reading, and its findings in the page's order."""
        self._written = written_parameters(reading.expansion)
        self._units = units_of(reading.expansion) if reading.expansion is not None else {}
        self._findings = findings
        self.serial += 1

    def parameters(self) -> Parameters:
        if self.read_only_reason:
            return Parameters((), "", "", self.read_only_reason)
        parameters = tuple(
            Parameter(
                kind="arg" if number.kind == "arg" else "property",
                name=number.name,
                written=number.value,
                value=self.overrides.value(number.kind, number.name, number.value),
                is_truth=number.is_truth,
                unit=self._units.get(id(number.binding), ""),
                place=place_of_span(number.span),
            )
            for number in self._written
        )
        return Parameters(parameters, self._editor.undo_title, self._editor.redo_title, "")

    def handle(self, message: FromPage) -> bool:
        """Carry out a page's message. Returns whether it changed the description, which must then be read
        again.

        Raises:
            KbotError: the message cannot be carried out. The text is the reason.
        """
        if self.read_only_reason and isinstance(message, CHANGES):
            raise KbotError(self.read_only_reason)
        match message:
            case SetParameter(kind=kind, name=name, value=value):
                rounded = float(f"{value:.{DIGITS}g}")
                self.overrides.set(kind, name, self._find(kind, name).text_of(rounded))
            case DropParameters():
                self.overrides.clear()
            case KeepParameters():
                self._keep()
            case EditSource(file=file, line=line, column=column, was=was, text=text):
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

    def _find(self, kind: str, name: str) -> WrittenValue:
        for number in self._written:
            if (number.kind, number.name) == (kind, name):
                return number
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
            raise KbotError("the findings have changed. Look at the new list")
        fix = self._findings[index].fix
        if fix is None:
            raise KbotError("this finding has no fix")
        self._editor.apply(fix.title, [(edit, edit.span.text) for edit in fix.edits])
