"""The kinds of files other than descriptions that `kbot check` reads, each with its check function."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import PurePath

from kbot.checks.config import Config
from kbot.extensions import parts
from kbot.text import Diagnostic, Source
from kbot.xacro import Packages

_MANIFEST = "kbot.checks.manifest:PACKAGE_MANIFEST"
"""A string, like the kinds of other parts: it is imported when the first such file is checked."""

Check = Callable[[Source, Mapping[str, str], Packages, Config], tuple[list[Diagnostic], list[Source]]]
"""Returns the findings in a file and in the descriptions that it names, and all sources that it read."""


@dataclass(frozen=True, slots=True)
class FileKind:
    """A kind of file, recognised by its name.

    An entry of `endings` is a suffix (`.launch`) or a whole name (`package.xml`). Files in `only_by_name` are
    programs: they are checked when named, but not found by a folder search. `has_arguments`: name:=value may
    set an argument of the file itself.
    """

    endings: tuple[str, ...]
    check: Check
    only_by_name: tuple[str, ...] = ()
    has_arguments: bool = False

    def is_found(self, name: str) -> bool:
        """Whether a folder search finds a file of this name."""
        return any(name == ending or (ending[0] == "." and name.endswith(ending)) for ending in self.endings)

    def fits(self, path: str) -> bool:
        name = PurePath(path).name
        return self.is_found(name) or name.endswith(self.only_by_name)


@cache
def file_kinds() -> tuple[FileKind, ...]:
    found = []
    for place in (_MANIFEST, *(place for part in parts() for place in part.FILE_KINDS)):
        module, name = place.split(":")
        found.append(getattr(import_module(module), name))
    return tuple(found)


def kind_of(path: str) -> FileKind | None:
    """The kind of a file; None for a description."""
    if path.endswith((".xacro", ".urdf")):  # the usual case: do not import the other kinds
        return None
    return next((kind for kind in file_kinds() if kind.fits(path)), None)
