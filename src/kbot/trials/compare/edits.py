"""The edits between the sources of two robots, and the robots that have only some of them.

All files are compared that either robot is made from: its description, the files that this includes,
parameter files, and the meshes on which behaviour depends. Files match by their package and their path in it.
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from difflib import SequenceMatcher
from pathlib import Path
from typing import TypeVar

from kbot.kinematics.drive.nearby import files_beside, with_nearby_drive
from kbot.model import Collision, Mesh, RobotModel, Visual
from kbot.model.load import Loaded
from kbot.text import DescriptionError, DiagnosticCollector, KbotError, read_source
from kbot.text.files import unsaved
from kbot.trials.compare.element_order import in_order_of
from kbot.trials.compare.model_equality import (
    YAML_SUFFIXES,
    Value,
    behaviour,
    content,
    is_same,
    parameter_files,
    relevant_meshes,
)
from kbot.trials.compare.revisions import Description
from kbot.trials.compare.text_edits import TextEdit, applied, edit_groups
from kbot.trials.robot_folder import absolute
from kbot.xacro import Packages
from kbot.xacro.assignments import Assignments
from kbot.xacro.packages import package_around, package_name

_RENAMED = 0.6
"""The least similarity (from 0 to 1) of a file that is gone and a new one, to be one that was renamed."""
_NO_ROBOT = "<robot/>"
"""The text of an included file that is gone. The include is optional, otherwise B would have an error."""

Shape = TypeVar("Shape", Visual, Collision)
FileKey = tuple[str, str]
"""A file's package, empty for that of the robot, and its path there."""


@dataclass(frozen=True, slots=True, eq=False)  # equal only to itself: comparing whole texts takes time
class Edit:
    """A difference between the sources of robots A and B that can be applied by itself.

    file           the file in B, or in A if B does not have it
    line, column   in B, from 1: the first character that differs; for a deletion, the text that follows
    before, after  the lines in A and in B. Both are empty for a file that is not text
    words          the texts that this edit removes and adds
    key            the file's package and path
    parts          the places in the texts. Empty for a file as a whole
    """

    file: str
    line: int
    column: int
    before: str
    after: str
    words: tuple[str, str]
    key: FileKey
    parts: tuple[TextEdit, ...]


@dataclass(frozen=True)
class Variant:
    """Robot A with some edits. It can be sent to another process while the files of A and B exist.

    given   the arguments and properties of A
    texts   the changed files of A, by path
    meshes  the changed meshes of A, by path; None for a mesh that does not exist
    """

    description: Description
    given: Assignments
    texts: Mapping[str, str] = field(default_factory=dict)
    meshes: Mapping[str, str | None] = field(default_factory=dict)

    @contextmanager
    def opened(self, packages: Packages | None = None) -> Iterator[RobotModel]:
        """The robot, for the block. A simulation must be made in the block: it reads parameter files.

        `packages` are those of the description, if they are known already.

        Raises:
            DescriptionError: the description has errors.
        """
        with unsaved(self.texts):
            loaded = self.description.load(self.given, packages)
            yield self._with_meshes(loaded, loaded.require())

    def _with_meshes(self, loaded: Loaded, robot: RobotModel) -> RobotModel:
        if not self.meshes:
            return robot

        def replaced(shape: Shape) -> Shape:
            mesh = shape.geometry
            path = _mesh_path(loaded, mesh) if isinstance(mesh, Mesh) else ""
            if not isinstance(mesh, Mesh) or path not in self.meshes:
                return shape
            return dataclasses.replace(shape, geometry=dataclasses.replace(mesh, path=self.meshes[path]))

        links = {
            name: dataclasses.replace(
                link,
                visuals=tuple(map(replaced, link.visuals)),
                collisions=tuple(map(replaced, link.collisions)),
            )
            for name, link in robot.links.items()
        }
        return dataclasses.replace(robot, links=links)


class _Side:
    """A robot and the files that it is made from."""

    def __init__(self, description: Description) -> None:
        self.description = description
        self.given = description.given()
        self.loaded = description.load(self.given)
        self.robot = self.loaded.require()
        self.main = absolute(description.file)
        self.package = package_around(Path(self.main).parent)
        is_nearby = with_nearby_drive(self.robot, DiagnosticCollector()) is not self.robot
        self.nearby = [self.key(str(path)) for path in files_beside(self.robot)] if is_nearby else []
        """Files of controllers that no description names."""
        self.texts = dict.fromkeys((*map(self.key, self._text_paths()), *self.nearby))
        """The files that the description names, and those nearby, in the order of reading."""
        self.meshes = dict.fromkeys(map(self.key, self._mesh_paths()))

    def key(self, path: str) -> FileKey:
        place = Path(absolute(path))
        if str(place) == self.main:
            return "", ""  # the robots' own files match whatever their names are
        package = package_around(place.parent)
        if package is None or package == self.package:
            home = self.package or Path(self.main).parent
            return "", Path(os.path.relpath(place, home)).as_posix()
        return package_name(str(package)), place.relative_to(package).as_posix()

    def path(self, key: FileKey) -> str | None:
        """Where this side has, or would have, a file. None if it does not have its package."""
        package, inner = key
        if not package:
            return absolute((self.package or Path(self.main).parent) / (inner or self.main))
        folder = self.loaded.packages.folder(package)
        return None if folder is None else absolute(Path(folder) / inner)

    def _text_paths(self) -> Iterator[str]:
        yield self.main
        yield from self.loaded.expansion.dependencies
        yield from parameter_files(self.robot)

    def _mesh_paths(self) -> Iterator[str]:
        for mesh in relevant_meshes(self.robot):
            path = _mesh_path(self.loaded, mesh)
            if path:
                yield path


class Edits:
    """The edits between two robots.

    Raises:
        DescriptionError: a description has errors.
    """

    def __init__(self, before: Description, after: Description) -> None:
        self._before, self._after = _Side(before), _Side(after)
        self.before, self.after = self._before.robot, self._after.robot
        self._before_behaviour, self._after_behaviour = behaviour(self.before), behaviour(self.after)
        self._texts: dict[FileKey, tuple[str, str | None]] = {}
        """The texts in A and B of the files that differ. In A, a file that was renamed has its new name."""
        self._old_paths: dict[FileKey, str] = {}
        """Where A has the files that were renamed."""
        self.whole = Edit(after.file, 1, 1, "", "", ("", ""), ("", ""), ())
        """Replaces A by B, if A with all edits does not behave like B."""
        self._unused = Variant(before, self._before.given)
        """A with the new files of B, which A does not use without an edit, and with its parts in the order of
        B where the order does not matter."""
        self.all: tuple[Edit, ...] = (*self._of_texts(), *self._of_meshes())
        """Each edit, in the order of files and lines."""
        self._packages = self._unused.description.packages()
        self._behaviours: dict[frozenset[Edit], Value] = {}

    def variant(self, edits: Iterable[Edit]) -> Variant:
        """Robot A with some of the edits. With `whole`, it is robot B."""
        chosen: dict[FileKey, list[Edit]] = {}
        for edit in edits:
            if edit is self.whole:
                return Variant(self._after.description, self._after.given)
            chosen.setdefault(edit.key, []).append(edit)
        texts, meshes = dict(self._unused.texts), dict(self._unused.meshes)
        for key, own in chosen.items():
            path = self._before.path(key) or ""
            if key not in self._texts:
                meshes[path] = _existing(self._after.path(key))
                continue
            old, new = self._texts[key]
            parts = [part for edit in own for part in edit.parts]
            if new is None:
                texts[path] = "" if path.endswith(YAML_SUFFIXES) else _NO_ROBOT
            else:
                texts[path] = applied(old, new, parts) if parts else new
            if key in self._old_paths:
                texts[self._old_paths[key]] = texts[path]
        return dataclasses.replace(self._unused, texts=texts, meshes=meshes)

    def behaviour(self, edits: Iterable[Edit]) -> Value:
        """What the behaviour of robot A with some of the edits depends on. None if they do not make a valid
        description. Cached."""
        chosen = frozenset(edits)
        if chosen not in self._behaviours:
            self._behaviours[chosen] = _behaviour_of(self.variant(chosen), self._packages)
        return self._behaviours[chosen]

    def is_valid(self, edits: Iterable[Edit]) -> bool:
        """Whether robot A with some of the edits is a valid description."""
        return self.behaviour(edits) is not None

    def behaves_like_after(self, edits: Iterable[Edit]) -> bool:
        """Whether robot A with some of the edits behaves like robot B."""
        return is_same(self.behaviour(edits), self._after_behaviour)

    def _of_texts(self) -> Iterator[Edit]:
        before, after = self._before, self._after
        for key in dict.fromkeys((*before.texts, *after.texts)):
            path, other = before.path(key), after.path(key)
            old, new = _text(path), _text(other)
            if new is None and key not in after.texts and key not in before.nearby:
                continue
            if key not in before.texts and key not in after.nearby:
                renamed = self._renamed(key, new or "")
                if renamed is not None or old is None:
                    self._add_unused(key, path, new if renamed is None else renamed)
                if renamed is None and old is None:
                    continue
                old = old if renamed is None else renamed
            if old == new:
                continue
            if old is None or new is None:
                self._texts[key] = old or "", new
                file = other if new is not None else path
                yield Edit(file or "", 1, 1, old or "", new or "", ("", ""), key, ())
                continue
            old = self._reordered(path or "", old, new)
            self._texts[key] = old, new
            for parts in edit_groups(old, new):
                yield _edit(other or "", old, new, key, parts)

    def _add_unused(self, key: FileKey, path: str | None, text: str | None) -> None:
        """Give A a file of B that A does not have, or the whole package if A does not have it."""
        unused = self._unused
        if path is not None and text is not None:
            self._unused = dataclasses.replace(unused, texts={**unused.texts, path: text})
            return
        folder = self._after.loaded.packages.folder(key[0])
        if folder is not None and folder not in unused.description.package_path:
            places = (*unused.description.package_path, folder)
            description = dataclasses.replace(unused.description, package_path=places)
            self._unused = dataclasses.replace(unused, description=description)

    def _reordered(self, path: str, old: str, new: str) -> str:
        """The text of A in the order of B, if the order does not matter. Then a fault in a part that was
        moved is an edit by itself."""
        moved = in_order_of(old, new)
        if moved == old:
            return old
        variant = dataclasses.replace(self._unused, texts={**self._unused.texts, path: moved})
        if not is_same(_behaviour_of(variant), self._before_behaviour):
            return old
        self._unused = variant
        return moved

    def _renamed(self, key: FileKey, text: str) -> str | None:
        """The text in A of the file that has this key and text in B."""
        gone = (self._before.path(other) for other in self._before.texts if other not in self._after.texts)
        best, most = None, _RENAMED
        for path in filter(None, gone):
            other = _text(path) or ""
            lines, other_lines = text.splitlines(), other.splitlines()
            alike = SequenceMatcher(None, other_lines, lines, autojunk=False).ratio()
            if alike >= most:
                best, most = other, alike
                self._old_paths[key] = path
        return best

    def _of_meshes(self) -> Iterator[Edit]:
        before, after = self._before, self._after
        for key in dict.fromkeys((*before.meshes, *after.meshes)):
            path, other = before.path(key), after.path(key)
            old, new = _existing(path), _existing(other)
            if path is None or _same_file(old, new) or (new is None and key not in after.meshes):
                continue
            if old is None and key not in before.meshes:
                meshes = {**self._unused.meshes, path: new}
                self._unused = dataclasses.replace(self._unused, meshes=meshes)
            else:
                yield Edit(new or path, 1, 1, "", "", ("", ""), key, ())


def _behaviour_of(variant: Variant, packages: Packages | None = None) -> Value:
    try:
        with variant.opened(packages) as robot:
            return behaviour(robot)
    except KbotError:
        return None


def _edit(file: str, old: str, new: str, key: FileKey, parts: tuple[TextEdit, ...]) -> Edit:
    part = parts[0]
    before, after = old[part.start : part.end], new[part.to_start : part.to_end]
    at = part.to_start + _common(before, after)
    if not before or after == "":  # added or removed lines: their content, or that of the next line
        blank = len(new[at:]) - len(new[at:].lstrip())
        is_whole = (before or after).endswith("\n")
        at += blank if is_whole and at + blank < len(new) else 0
    line, column = _position(new, at)
    lines = _lines(old, part.start, part.end), _lines(new, part.to_start, part.to_end)
    words = "".join(old[p.start : p.end] for p in parts), "".join(new[p.to_start : p.to_end] for p in parts)
    return Edit(file, line, column, *lines, words, key, parts)


def _common(one: str, other: str) -> int:
    """The number of equal characters at the start of two texts."""
    both = enumerate(zip(one, other, strict=False))
    return next((at for at, (a, b) in both if a != b), min(len(one), len(other)))


def _position(text: str, at: int) -> tuple[int, int]:
    """Line and column, both from 1. The end of a text is in its last line."""
    at = min(at, len(text.rstrip("\r\n")))
    return text.count("\n", 0, at) + 1, at - text.rfind("\n", 0, at)


def _lines(text: str, start: int, end: int) -> str:
    """The lines that contain a part of a text, without the white space around them. Empty for a place between
    two lines."""
    if start == end and text[start - 1 : start] in ("", "\n"):
        return ""
    first = text.rfind("\n", 0, start) + 1
    last = text.find("\n", max(start, end - 1))
    return text[first : last if last >= 0 else len(text)].strip()


def _text(path: str | None) -> str | None:
    try:
        return None if path is None else read_source(path).text
    except DescriptionError:
        return None


def _existing(path: str | None) -> str | None:
    return path if path is not None and Path(path).is_file() else None


def _same_file(one: str | None, other: str | None) -> bool:
    if one is None or other is None:
        return one is other
    return Path(one).samefile(other) or content(one) == content(other)


def _mesh_path(loaded: Loaded, mesh: Mesh) -> str:
    """The path of a mesh, also if there is no such file. Empty if the package is not found."""
    path = loaded.packages.expected(mesh.uri)
    return "" if path is None else absolute(path)
