"""The kinds of files that `kbot check` reads beside descriptions, each with the function that checks it."""

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
"""Imported when the first file that is not a description is checked, like the kinds of other parts."""

Check = Callable[[Source, Mapping[str, str], Packages, Config], tuple[list[Diagnostic], list[Source]]]
"""The findings in a source and in the descriptions that it names, and all sources that were read."""


@dataclass(frozen=True, slots=True)
class FileKind:
    """Files whose name ends in one of `endings`, or is one that does not begin with a dot. A search of a
    folder leaves out those in `only_by_name`, which are programs. `has_arguments`: name:=value may set an
    argument of the file itself."""

    endings: tuple[str, ...]
    check: Check
    only_by_name: tuple[str, ...] = ()
    has_arguments: bool = False

    def is_found(self, name: str) -> bool:
        """Whether a search of a folder picks a file up by its name."""
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
    """None for a description."""
    if path.endswith((".xacro", ".urdf")):  # most files, which need no other part of KBot
        return None
    return next((kind for kind in file_kinds() if kind.fits(path)), None)
