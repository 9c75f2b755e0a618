"""Loads a robot from a file or text: expands it, reads it, and collects all diagnostics."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from kbot.brief import Brief, counted
from kbot.model._attributes import MeshFinder
from kbot.model.read import read_robot
from kbot.model.robot import RobotModel
from kbot.text import DescriptionError, Diagnostic, Element, Origin, Severity, Source, Span
from kbot.text.errors import reading
from kbot.text.file_kind import ROBOT, file_kind, not_a_robot
from kbot.text.xml import MAX_READ_NESTING, parse_document
from kbot.text.xml_nodes import Comment, Instruction
from kbot.xacro import Expansion, Packages, expand, expand_text
from kbot.xacro.packages import SHIPPED

SHIPPED_NAME = "kbot"
"""The word that means the robot that ships with KBot, instead of a file."""
SHIPPED_PACKAGE = Path(SHIPPED) / "kbot_description"
"""The folder of its package."""

_EXPRESSION = re.compile(r"\$[{(]")
_MISSING = frozenset({"U003", "U006", "U007", "U008", "U014"})


@dataclass(frozen=True, repr=False)
class Loaded(Brief):
    """The result of loading a description. `robot` is None if its links and joints form no tree."""

    robot: RobotModel | None
    expansion: Expansion
    diagnostics: tuple[Diagnostic, ...]
    packages: Packages

    @property
    def has_errors(self) -> bool:
        return self.robot is None or any(d.is_error for d in self.diagnostics)

    def require(self) -> RobotModel:
        """Return the robot.

        Raises:
            DescriptionError: a diagnostic is an error. The exception has all diagnostics.
        """
        if self.robot is None or self.has_errors:
            raise DescriptionError(self.diagnostics)
        return self.robot

    def _shown(self) -> Iterator[str]:
        yield repr(self.robot.name) if self.robot is not None else "no robot"
        yield repr(self.expansion.path)
        yield counted(len(self.diagnostics), "diagnostic")


def resolve_robot_path(path: str | os.PathLike[str]) -> str:
    """The file to read: that of the shipped robot for the word `kbot`, or else the path itself."""
    name = os.fspath(path)
    if name != SHIPPED_NAME:
        return name
    return str(SHIPPED_PACKAGE / "urdf" / "kbot.xacro")


def load_robot(
    path: str | os.PathLike[str],
    arguments: Mapping[str, str] | None = None,
    properties: Mapping[str, str] | None = None,
    packages: Packages | None = None,
) -> Loaded:
    """Expand and read a xacro or URDF file. Errors in the description are diagnostics, not exceptions.

    `arguments` are xacro arguments. `properties` override top-level properties. `packages` finds packages,
    also around the file.
    """
    file = resolve_robot_path(path)
    found = (packages or Packages()).beside(file)
    return _read(expand(file, arguments, properties=properties, packages=found, lenient=True), found)


def load_robot_text(
    text: str,
    path: str | os.PathLike[str],
    arguments: Mapping[str, str] | None = None,
    properties: Mapping[str, str] | None = None,
    packages: Packages | None = None,
) -> Loaded:
    """Load a robot from unsaved text, as `load_robot` does. `path` is the file that the text belongs to."""
    file = resolve_robot_path(path)
    found = (packages or Packages()).beside(file)
    expansion = expand_text(text, file, arguments, properties=properties, packages=found, lenient=True)
    return _read(expansion, found)


def read_urdf_text(text: str, path: str, finder: MeshFinder) -> RobotModel:
    """The robot of a URDF text that is not xacro. Nothing in it is evaluated, and no other file is read.

    `path` is the file that the text belongs to. `finder` finds the files of meshes.

    Raises:
        DescriptionError: the text is not URDF, or it is xacro.
    """
    document = parse_document(Source(path, text), MAX_READ_NESTING)
    origin = _xacro_in(document.root)
    if origin is not None:
        message = "the text is xacro. Expand it first with kbot expand"
        raise DescriptionError([Diagnostic("U001", Severity.ERROR, message, origin)])
    if document.diagnostics:
        raise DescriptionError(document.diagnostics)
    return read_robot(document.root, finder).require()


def _xacro_in(root: Element) -> Origin | None:
    """The origin of something that xacro would expand, or None."""
    waiting: list[Element] = [root]
    while waiting:
        element = waiting.pop()
        if element.tag.startswith("xacro:"):
            return element.origin
        for name, value in element.attributes.items():
            if _EXPRESSION.search(value):
                return element.attribute_origin(name)
        for child in element.children:
            if isinstance(child, Element):
                waiting.append(child)
            elif isinstance(child, Comment | Instruction):
                if "xacro:eval-comments" in child.value:
                    return child.origin
            elif _EXPRESSION.search(child.value):
                return child.origin
    return None


def kind_of_unexpanded(expansion: Expansion) -> str:
    """The kind of a file that cannot be expanded, as `file_kind` returns it. Empty without an error."""
    place = _place_of_error(expansion)
    return file_kind(place.span.source.path, place.span.source.text) if place else ""


def error_for_kind(kind: str, expansion: Expansion) -> Diagnostic:
    """The error for a file of another kind, such as a launch file, that cannot be expanded as a robot. Its
    other errors do not matter."""
    root, place = expansion.document, _place_of_error(expansion)
    path = place.span.source.path if place else expansion.path or ""
    message, hint = not_a_robot(kind, f"<{root.tag}>" if root else path)
    return Diagnostic("U001", Severity.ERROR, message, place, hint)


def _place_of_error(expansion: Expansion) -> Origin | None:
    """The root of a document with errors; without a root, the first error. None without an error."""
    first = next((d.origin for d in expansion.diagnostics if d.is_error and d.origin), None)
    root = expansion.document
    return Origin(root.origin.span) if first and root else first


def _read(expansion: Expansion, packages: Packages) -> Loaded:
    kind = kind_of_unexpanded(expansion)
    if kind not in ("", ROBOT):
        return Loaded(None, expansion, (error_for_kind(kind, expansion),), packages)
    if expansion.document is None:
        return Loaded(None, expansion, expansion.diagnostics, packages)
    with reading(expansion.path or ""):
        read = read_robot(expansion.document, packages, expansion.names_at)
    found = not_reported_before(expansion.diagnostics, read.diagnostics)
    expanded = needed_packages(expansion.diagnostics, found)
    if any(d.is_error for d in expanded):
        found = [d for d in found if d.code not in _MISSING]  # the missing part may have had it
    once: dict[object, Diagnostic] = {}  # each use of a wrong value reports it at the same place
    for diagnostic in found:
        once.setdefault((diagnostic.code, diagnostic.message, diagnostic.origin), diagnostic)
    return Loaded(read.robot, expansion, (*expanded, *once.values()), packages)


def needed_packages(expanded: Sequence[Diagnostic], read: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
    """The diagnostics of an expansion. If the robot lacks parts without another error, absent packages are
    errors, because they may have defined the parts."""
    is_explained = any(d.is_error for d in expanded)
    if is_explained or not any(d.code in _MISSING and not d.hint.startswith("did you mean") for d in read):
        return tuple(expanded)
    return tuple(replace(d, severity=Severity.ERROR) if d.code == "X114" else d for d in expanded)


def not_reported_before(reported: Sequence[Diagnostic], new: Iterable[Diagnostic]) -> list[Diagnostic]:
    """Errors of the URDF reader, without those at a place where expansion failed and left the text
    unexpanded."""
    places = [d.origin.span for d in reported if d.is_error and d.origin]
    return [
        d
        for d in new
        if not places
        or not d.origin
        or (
            not (d.code in ("U012", "U013") and ("${" in d.message or "$(" in d.message))
            and not any(_overlap(p, d.origin.span) for p in places)
        )
    ]


def _overlap(a: Span, b: Span) -> bool:
    return a.file == b.file and (a.start == b.start or (a.start < b.end and b.start < a.end))
