"""Changing the description from the page: other values at once, edits and fixes in its files, undo."""

from __future__ import annotations

from typing import TYPE_CHECKING

from kbot.text import Diagnostic, Edit, KbotError
from kbot.workbench.protocol import (
    ApplyFix,
    DropParameters,
    EditSource,
    FromPage,
    KeepParameters,
    Parameters,
    Redo,
    SetParameter,
    Undo,
)
from kbot.workbench.source.edits import Editor
from kbot.workbench.source.overrides import Overrides, value_of
from kbot.workbench.source.parameters import Written, parameters_for_page, written_parameters

if TYPE_CHECKING:
    from kbot.workbench.source.description import Reading

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

    def look_at(self, reading: Reading, findings: tuple[Diagnostic, ...]) -> None:
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
