"""The description as it is written: findings, texts, numbers that can be tried and edits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from kbot.workbench.protocol.values import Name, PathName, Place, Range


@dataclass(frozen=True, slots=True)
class Step:
    """One macro call or include that brought a finding's element."""

    kind: Literal["macro", "include"]
    name: str
    place: Place


@dataclass(frozen=True, slots=True)
class Note:
    """Another place a finding speaks of."""

    message: str
    place: Place


@dataclass(frozen=True, slots=True)
class Finding:
    """One diagnostic; `link` is the link it lies in and `fix` what would mend it, or they are empty."""

    code: str
    severity: Literal["error", "warning", "info"]
    message: str
    hint: str
    place: Place | None
    stack: tuple[Step, ...]
    related: tuple[Note, ...]
    link: str
    fix: str


@dataclass(frozen=True, slots=True)
class Findings:
    """All findings; `stale` when the scene shows an older, still good description.

    `serial` counts readings, so that a fix is asked for from the list that is on show.
    """

    serial: int
    stale: bool
    findings: tuple[Finding, ...]
    type: Literal["findings"] = "findings"


@dataclass(frozen=True, slots=True)
class OpenSource:
    file: PathName
    type: Literal["open_source"] = "open_source"


@dataclass(frozen=True, slots=True)
class Hint:
    """What an attribute that is written as an expression came to: a value for each macro call that made
    another one; `more` where there are more than are told."""

    place: Place
    values: tuple[str, ...]
    more: bool


@dataclass(frozen=True, slots=True)
class SourceText:
    """The text of one of the description's files; `owners` says which links each line belongs to, `hints`
    what the expressions in it came to."""

    file: str
    text: str
    owners: tuple[tuple[str, ...], ...]
    hints: tuple[Hint, ...]
    type: Literal["source"] = "source"


@dataclass(frozen=True, slots=True)
class Parameter:
    """A number that the description is made with: a xacro argument or property.

    `written` is what the file says and `value` what the picture shows; with `is_truth` it is true or false,
    as 1 or 0. `place` is that of the number.
    """

    kind: Literal["arg", "property"]
    name: str
    written: float
    value: float
    is_truth: bool
    place: Place


@dataclass(frozen=True, slots=True)
class Parameters:
    """All of them, in the order they are written. `undo` says what would be undone, if anything, and `redo`
    what would be done again."""

    parameters: tuple[Parameter, ...]
    undo: str
    redo: str
    type: Literal["parameters"] = "parameters"


@dataclass(frozen=True, slots=True)
class SetParameter:
    """Show the robot with another value, the file left as it is."""

    kind: Literal["arg", "property"]
    name: Name
    value: Annotated[float, Range(-1e9, 1e9)]
    type: Literal["set_parameter"] = "set_parameter"


@dataclass(frozen=True, slots=True)
class DropParameters:
    """Show what the file says again."""

    type: Literal["drop_parameters"] = "drop_parameters"


@dataclass(frozen=True, slots=True)
class KeepParameters:
    """Write the values on show into the file."""

    type: Literal["keep_parameters"] = "keep_parameters"


@dataclass(frozen=True, slots=True)
class EditSource:
    """Replace `was`, which stands at a line and column (1-based) of one of the files, by `text`."""

    file: PathName
    line: Annotated[float, Range(1, 1e9)]
    column: Annotated[float, Range(1, 1e9)]
    was: Name
    text: Name
    type: Literal["edit_source"] = "edit_source"


@dataclass(frozen=True, slots=True)
class ApplyFix:
    """Carry out the fix of a finding of the list with this serial."""

    serial: Annotated[float, Range(0, 1e15)]
    index: Annotated[float, Range(0, 1e6)]
    type: Literal["apply_fix"] = "apply_fix"


@dataclass(frozen=True, slots=True)
class Undo:
    """Take back the last change that the page made to a file."""

    type: Literal["undo"] = "undo"


@dataclass(frozen=True, slots=True)
class Redo:
    """Do again what was taken back last."""

    type: Literal["redo"] = "redo"
