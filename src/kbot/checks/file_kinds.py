"""The kinds of files other than descriptions that `kbot check` reads, each with its check function."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module

from kbot.checks.config import Config
from kbot.extensions import parts
from kbot.text import Diagnostic, Source
from kbot.text.file_kind import ROBOT, file_kind, kind_of_file
from kbot.xacro import Packages

_MANIFEST = "kbot.checks.manifest:PACKAGE_MANIFEST"
"""A string, like the kinds of other parts: it is imported when the first such file is checked."""

Check = Callable[[Source, Mapping[str, str], Packages, Config], tuple[list[Diagnostic], list[Source]]]
"""Returns the findings in a file and in the descriptions that it names, and all sources that it read."""


@dataclass(frozen=True, slots=True)
class FileKind:
    """A kind of file.

    kind           its name in `kbot.text.file_kind`
    has_arguments  whether name:=value may set an argument of the file itself
    """

    kind: str
    check: Check
    has_arguments: bool = False


@cache
def file_kinds() -> tuple[FileKind, ...]:
    found = []
    for place in (_MANIFEST, *(place for part in parts() for place in part.FILE_KINDS)):
        module, name = place.split(":")
        found.append(getattr(import_module(module), name))
    return tuple(found)


def kind_of(path: str, text: str | None = None) -> FileKind | None:
    """The kind of a file; None for a description. `text` is its content if that differs from the file on
    disk."""
    found = kind_of_file(path) if text is None else file_kind(path, text)
    if found == ROBOT:  # the usual case: do not import the other kinds
        return None
    return next((each for each in file_kinds() if each.kind == found), None)
