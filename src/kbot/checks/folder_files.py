"""Finds the files in a folder to check: launch files, whole robots and package.xml."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from kbot.checks.file_kinds import file_kinds
from kbot.text import DescriptionError, Diagnostic, Origin, Severity, Source, Span, parse_xml, read_source
from kbot.text.file_kind import MAY_BE_LAUNCH, MAY_BE_ROBOT, ROBOT, kind_of_file
from kbot.text.folders import files_below

_ROBOT = (".xacro", ".urdf")
"""Endings of files that are a description, whatever they contain."""
_SEARCHED = tuple({*MAY_BE_ROBOT, *MAY_BE_LAUNCH} - {".py"})
"""Endings of files that may be one to check. Launch files in Python are programs, and not searched."""
_INCLUDE = re.compile(r"""<xacro:include\b[^<>]*""")
_FILENAME = re.compile(r"""\bfilename\s*=\s*["']([^"']+)["']""")


def entry_points(folder: str, progress: Callable[[str], None] = lambda _: None) -> list[str]:
    """The files below a folder to check, sorted: launch files, whole robots, package.xml.

    `progress` receives a text about the folder or file that is searched.

    A description that another file of the folder includes is skipped. Of the others, a whole robot is a
    description whose root has a name and content, or that has a link of its own.

    Raises:
        DescriptionError: F006, the folder has no such file.
        KbotError: it has too many files.
    """
    files = files_below(
        folder, lambda name: name.endswith(_SEARCHED), lambda at: progress(f"looking for files in {at}")
    )
    included: set[str] = set()
    others = {kind.kind for kind in file_kinds()}
    found: list[str] = []
    robots: list[str] = []
    for file in files:
        progress(f"reading {file}")
        kind = kind_of_file(file)
        if kind in others:
            found.append(file)
        elif kind == ROBOT or file.endswith(_ROBOT):
            robots.append(file)
            with suppress(DescriptionError):
                included.update(
                    os.path.basename(match[1])
                    for tag in _INCLUDE.findall(read_source(file).text)
                    if (match := _FILENAME.search(tag))
                )
    found += [file for file in robots if os.path.basename(file) not in included and _is_robot(file)]
    if not found:
        message = f"{folder} contains no launch file, package.xml, xacro or URDF"
        place = Origin(Span(Source(folder, ""), 0, 0))
        raise DescriptionError([Diagnostic("F006", Severity.ERROR, message, place)])
    return sorted(found, key=Path)


def _is_robot(file: str) -> bool:
    """Whether a file is a whole robot and not a library of macros. True for a file with a syntax error, so
    that the error is reported."""
    try:
        root = parse_xml(read_source(file))
    except DescriptionError:
        return True
    if root.tag != "robot":
        return False
    makes = any(e.tag != "xacro:macro" and not _is_setting(e.tag) for e in root.elements())
    return ("name" in root.attributes and makes) or any(e.tag == "link" for e in root.elements())


def _is_setting(tag: str) -> bool:
    return tag in ("xacro:property", "xacro:arg", "xacro:include", "material", "gazebo")
