"""Finds the files in a folder to check: launch files, whole robots and package.xml."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator
from pathlib import Path

from kbot.checks.file_kinds import file_kinds
from kbot.text import DescriptionError, Diagnostic, Origin, Severity, Source, Span, parse_xml, read_source
from kbot.text.file_kind import ROBOT, kind_of_file

_ROBOT = (".xacro", ".urdf")
_SEARCHED = (*_ROBOT, ".launch", ".xml", ".yaml", ".yml")
"""Endings of files that may be one to check. Launch files in Python are programs, and not searched."""
_SKIPPED = frozenset({"build", "install", "log", "devel", "node_modules", "__pycache__"})
_VIRTUAL = frozenset({"/proc", "/sys", "/dev"})
"""File systems of the kernel. They have no robots, but hundreds of thousands of files."""
_INCLUDE = re.compile(r"""<xacro:include\b[^<>]*""")
_FILENAME = re.compile(r"""\bfilename\s*=\s*["']([^"']+)["']""")


def entry_points(folder: str, progress: Callable[[str], None] = lambda _: None) -> list[str]:
    """The files below a folder to check, sorted: launch files, whole robots, package.xml.

    `progress` receives a text about the folder or file that is searched.

    A description that another file of the folder includes is skipped. Of the others, a whole robot is a
    description whose root has a name and content, or that has a link of its own.

    Raises:
        DescriptionError: F006, the folder has no such file.
    """
    files = sorted(_walk(Path(folder), progress))
    included: set[str] = set()
    texts: dict[Path, str] = {}
    found: list[Path] = []
    others = {kind.kind for kind in file_kinds()}
    for file in files:
        progress(f"reading {file}")
        kind = kind_of_file(str(file))
        if kind in others:
            found.append(file)
        elif kind == ROBOT or file.name.endswith(_ROBOT):
            try:
                texts[file] = read_source(file).text
            except DescriptionError:
                texts[file] = ""
            included.update(
                os.path.basename(match[1])
                for tag in _INCLUDE.findall(texts[file])
                if (match := _FILENAME.search(tag))
            )
    found += [f for f in texts if f.name not in included and _is_robot(f, texts[f])]
    if not found:
        message = f"{folder} contains no launch file, package.xml, xacro or URDF"
        place = Origin(Span(Source(folder, ""), 0, 0))
        raise DescriptionError([Diagnostic("F006", Severity.ERROR, message, place)])
    return [str(f) for f in sorted(found)]


def _walk(folder: Path, progress: Callable[[str], None]) -> Iterator[Path]:
    """The files to read. Links to folders are not followed."""
    for root, folders, names in os.walk(folder):
        progress(f"looking for files in {root}")
        if os.path.realpath(root) in _VIRTUAL:
            folders.clear()
            continue
        folders[:] = [f for f in folders if f not in _SKIPPED and not f.startswith(".")]
        for name in names:
            if name.endswith(_SEARCHED):
                yield Path(root) / name


def _is_robot(file: Path, text: str) -> bool:
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
