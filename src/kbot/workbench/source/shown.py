"""The displayed description: the last usable reading, the latest one, and its findings."""

from __future__ import annotations

import dataclasses
import html
import math
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Protocol

from kbot.checks.ranking import ranked
from kbot.model import RobotModel
from kbot.text import DescriptionError, Diagnostic, Element, KbotError, Origin, Source, Span
from kbot.text.files import read_source
from kbot.workbench.meshes.notes import lightened_meshes, missing_meshes
from kbot.workbench.meshes.roots import NOT_OWN, Confined, OwnFiles, confine
from kbot.workbench.meshes.store import MeshStore
from kbot.workbench.protocol import (
    CheckTexts,
    Completions,
    Findings,
    Hint,
    SaveSource,
    SourceConflict,
    SourceSaved,
    SourceText,
    TextsChecked,
)
from kbot.workbench.source.authoring import Authoring
from kbot.workbench.source.completions import completions_of
from kbot.workbench.source.description import DescriptionReading
from kbot.workbench.source.description_file import Checked
from kbot.workbench.source.overrides import Overrides
from kbot.workbench.source.ownership import Ownership
from kbot.workbench.source.places import findings_for_page, place_of_span
from kbot.workbench.source.saving import read_only_reason, require_small, save
from kbot.worker import LimitExceeded
from kbot.xacro.packages import Packages
from kbot.xacro.templates import shortened

if TYPE_CHECKING:
    from kbot.xacro.binding import Binding


MOST_VALUES = 4
"""Values listed for one place. A macro has one for each of its calls."""
MOST_CHARACTERS = 60
"""Characters of a listed value."""


class Hints:
    """Values of expressions in an expanded document: of attributes, and of the properties and parameters they
    use."""

    def __init__(self, document: Element | None) -> None:
        self._values: dict[str, dict[tuple[int, int], dict[str, Span]]] = {}
        """By file and place: each value as text, with its span."""
        seen: set[int] = set()
        for element in (document, *document.descendants()) if document is not None else ():
            if element.is_plain:
                continue
            for name, value in element.attributes.items():
                self._add(element.attribute_origin(name).span, value)
            for bindings in (element.inputs or {}).values():
                self._add_bindings(bindings, seen)

    def of(self, source: Source) -> tuple[Hint, ...]:
        """Return the hints of a file in their order, or none if the file has changed since it was
        expanded."""
        found = sorted(self._values.get(source.path, {}).items())
        return tuple(
            Hint(place_of_span(span), tuple(list(values)[:MOST_VALUES]), len(values) > MOST_VALUES)
            for _, values in found
            if (span := next(iter(values.values()))).source.data == source.data
        )

    def _add(self, span: Span, value: object) -> None:
        # an expression that cannot be evaluated keeps its text
        if "$" in span.text and html.unescape(span.text).split() != str(value).split():
            places = self._values.setdefault(span.file, {})
            places.setdefault((span.start, span.end), {}).setdefault(_shown(value), span)

    def _add_bindings(self, bindings: Iterable[Binding], seen: set[int]) -> None:
        for binding in _all_of(bindings, seen):
            origin = binding.origin
            if origin is not None and isinstance(binding.value, str | int | float | bool):
                self._add(origin.span, binding.value)


def _all_of(bindings: Iterable[Binding], seen: set[int]) -> Iterator[Binding]:
    waiting = list(bindings)
    while waiting:
        binding = waiting.pop()
        if id(binding) not in seen:
            seen.add(id(binding))
            yield binding
            waiting += binding.inputs


def _shown(value: object) -> str:
    """Return a value as text, with numbers rounded to six digits."""
    text = " ".join(map(_short, str(value).split()))
    return shortened(text, MOST_CHARACTERS)


def _short(word: str) -> str:
    try:
        number = float(word)
    except ValueError:
        return word
    return f"{number:.6g}" if math.isfinite(number) and len(word) > 7 else word


class Reader(Protocol):
    """What `DescriptionFile` does, also for a description that was read by somebody else."""

    overrides: Overrides
    package_path: tuple[str, ...]
    read_only_reason: str
    """Why pages may not change the description, and changes of its files are not shown. Or empty."""

    def read(self) -> DescriptionReading: ...

    def read_again(self) -> DescriptionReading: ...

    def check(self, texts: Mapping[str, str], allowed: Iterable[str]) -> Checked: ...

    def allow_only(self, files: Iterable[str]) -> None: ...


class ShownDescription:
    """The displayed description. An unusable reading keeps the last valid robot, which is then stale.

    `robot` has no links until `take` accepts the first usable reading.
    """

    def __init__(self, reader: Reader, meshes: MeshStore, read_only_reason: str = "") -> None:
        """Read the description. `read_only_reason` is the reason why pages may not change it, or empty."""
        self._reader, self._meshes = reader, meshes
        self.authoring = Authoring(reader.overrides, self._before_change, read_only_reason)
        self._good = self._latest = reader.read()
        self.robot = RobotModel("", {}, {}, {}, (), Origin(Span(Source(self.file, ""), 0, 0)))
        self.is_stale = True
        self._ownership = Ownership(self._latest.document)
        self._hints: Hints | None = None
        self._completions: Completions | None = None
        self._owners: dict[str, tuple[bytes, tuple[tuple[str, ...], ...]]] = {}
        """By file: its content, and the links of each line. Pages may ask for a file many times."""
        self._opened: set[str] = set()
        """Files that a page has opened. It can save them also if the description stops using them."""

    @property
    def file(self) -> str:
        return self._latest.files[0]

    @property
    def latest(self) -> DescriptionReading:
        return self._latest

    @property
    def has_robot(self) -> bool:
        """Whether a reading has been usable."""
        return bool(self.robot.links)

    @property
    def files(self) -> tuple[str, ...]:
        """Every file the description was last read from."""
        return self._latest.files

    @property
    def is_written(self) -> bool:
        """Whether it was read from a file, so that it was checked."""
        return self._latest.expansion is not None

    @property
    def watched(self) -> tuple[str, ...]:
        """The description's files and mesh files. A change of one is displayed."""
        if self._reader.read_only_reason:
            return ()
        return (*self._latest.files, *self._latest.meshes)

    @property
    def began(self) -> int:
        """Wall-clock time in ns at which the last reading began."""
        return self._latest.began

    @property
    def package_path(self) -> tuple[str, ...]:
        return self._reader.package_path

    def confine(self, robot: RobotModel) -> Confined:
        """Remove the meshes that the page may not load from another robot."""
        packages = Packages(self.package_path, around=self.file)
        return confine(robot, OwnFiles(self.file, packages))

    def read(self) -> DescriptionReading:
        """Read the description again, in the worker. May run on another thread."""
        return self._reader.read_again()

    def take(self, reading: DescriptionReading, use: Callable[[RobotModel], None]) -> KbotError | None:
        """Use a new reading, and pass its robot to `use`, which may refuse it with a KbotError.

        Returns the refusal, or None.
        """
        self._latest = reading
        self._ownership = Ownership(reading.document)
        self._hints = self._completions = None
        self._owners.clear()
        self.is_stale = reading.robot is None or not reading.usable
        if reading.robot is None or self.is_stale:
            return None
        try:
            use(reading.robot)
        except KbotError as error:
            problems = error.diagnostics if isinstance(error, DescriptionError) else ()
            self._latest = dataclasses.replace(reading, findings=(*problems, *reading.findings))
            self.is_stale = True
            return error
        self.robot, self._good = reading.robot, reading
        self._meshes.refused = reading.outside
        self._meshes.simplified.update(reading.simplified)
        return None

    def collect_findings(self) -> None:
        """Collect the findings. It must run after the scene's meshes are loaded."""
        notes = lightened_meshes(self.robot, self._meshes)
        self._findings = tuple(ranked((*self._latest.findings, *notes)))
        self.authoring.take_reading(self._latest, self._findings)

    def findings(self, others: Sequence[Diagnostic] = ()) -> Findings:
        """Return the first findings, followed by others that are not about the description.

        Others have no fix, because pages refer to fixes by their place in the description's list.
        """
        others = tuple(dataclasses.replace(other, fix=None) for other in others)
        found = findings_for_page(self._findings, self._ownership, others)
        return Findings(self.authoring.serial, self.is_stale, found)

    def missing_meshes(self) -> list[str]:
        """Return the findings about missing meshes as text."""
        return missing_meshes(self._findings)

    def source(self, file: str, others: Sequence[Diagnostic] = ()) -> SourceText:
        """Return the text of one of the description's files, or of a file that another finding is in.

        Raises:
            KbotError: the file is not part of the description, or cannot be read.
        """
        is_other = any(other.origin is not None and other.origin.span.file == file for other in others)
        if not is_other:
            self._require_files((file,))
        source = read_source(file)
        if not is_other:
            self._opened.add(file)
        if self._hints is None:
            self._hints = Hints(self._latest.document)
        known, owners = self._owners.get(file, (b"", ()))
        if known != source.data:
            owners = self._ownership.lines(source.whole())
            self._owners[file] = source.data, owners
        reason = self.authoring.read_only_reason or read_only_reason(file, source.text)
        if is_other and file not in self._latest.files:
            reason = "only the files of the robot's description can be changed here"
        return SourceText(file, source.text, owners, self._hints.of(source), reason)

    def open(self, file: str, others: Sequence[Diagnostic] = ()) -> SourceText | SourceConflict:
        """Do the same as `source`, but report a deleted file in a way that a page can save it again.

        Raises:
            KbotError: the file is not part of the description, or cannot be read.
        """
        if file in self._known_files and not os.path.lexists(file):
            return SourceConflict(file, None)
        return self.source(file, others)

    def completions(self) -> Completions | None:
        """Return what an editor can complete, or None if the latest text is not well-formed."""
        if self._completions is None:
            self._completions = completions_of(self._latest)
        return self._completions

    def save(self, message: SaveSource) -> SourceSaved | SourceConflict:
        """Save a file that the page has edited.

        Raises:
            KbotError: the file is not part of the description, read-only, or cannot be written.
        """
        if self.authoring.read_only_reason:
            raise KbotError(self.authoring.read_only_reason)
        self._before_change((message.file,))
        return save(message)

    def check(self, message: CheckTexts) -> TextsChecked:
        """Check the description with unsaved texts, in the worker. May run on another thread.

        Raises:
            KbotError: a file is not part of the description, or the checks' configuration is not usable.
        """
        self._require_files(message.files)
        if len(message.files) != len(message.texts):
            raise KbotError(f"{len(message.files)} files need as many texts, not {len(message.texts)}")
        require_small(message.texts)
        texts = dict(zip(message.files, message.texts, strict=True))
        try:
            return TextsChecked(message.number, *self._reader.check(texts, self._known_files))
        except LimitExceeded as error:
            raise KbotError(f"checking the unsaved text {error}") from None

    @property
    def _known_files(self) -> frozenset[str]:
        """The files of the description, of its last valid version, and those that a page has opened."""
        return frozenset(self._opened.union(self._latest.files, self._good.files))

    def _before_change(self, files: Iterable[str]) -> None:
        """Raise KbotError for a file that a page may not change. From now on, the description may not name
        further files outside its own folders, because a page writes it."""
        self._require_files(files)
        self._reader.allow_only(self._known_files)

    def _require_files(self, files: Iterable[str]) -> None:
        """Raise KbotError for a file that pages may not open. A page can write an include of any file."""
        own = OwnFiles(self.file, Packages(self.package_path, around=self.file))
        for file in files:
            if file not in self._known_files:
                raise KbotError(f"{file} is not part of this description")
            if file != self.file and not own.have_text(file):
                raise KbotError(f"{file} is {NOT_OWN}, so the page does not open it")
