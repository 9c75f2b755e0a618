"""The description on show: the last reading that made a robot, the latest one, and what was found in it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Protocol

from kbot.model import Robot
from kbot.text import DescriptionError, KbotError
from kbot.text.files import read_source
from kbot.workbench.meshes.notes import lightened_meshes, missing_meshes
from kbot.workbench.meshes.roots import Confined, MeshRoots, confine
from kbot.workbench.meshes.store import MeshStore
from kbot.workbench.protocol import Findings, SourceText
from kbot.workbench.source.authoring import Authoring
from kbot.workbench.source.description import Reading
from kbot.workbench.source.hints import Hints
from kbot.workbench.source.overrides import Overrides
from kbot.workbench.source.ownership import Ownership
from kbot.workbench.source.places import findings_for_page, gravest_first
from kbot.xacro.packages import Packages


class Reader(Protocol):
    """Reads the description as it is now."""

    overrides: Overrides
    package_path: tuple[str, ...]

    def read(self) -> Reading: ...


class Shown:
    """A reading that makes no robot leaves the last good one on show, which is then stale."""

    def __init__(self, reader: Reader, meshes: MeshStore, why_not: str = "") -> None:
        """Reads the description; `why_not` says why pages may not change it, empty where they may.

        Raises:
            DescriptionError: it makes no robot, or one with errors.
        """
        self._reader, self._meshes = reader, meshes
        self.authoring = Authoring(reader.overrides, why_not)
        self._good = self._latest = reader.read()
        self.robot = self._good.require()
        self.is_stale = False
        meshes.refused = self._good.outside
        self._ownership = Ownership(self._good.document)
        self._hints: Hints | None = None

    @property
    def file(self) -> str:
        return self._latest.files[0]

    @property
    def files(self) -> tuple[str, ...]:
        """Every file the description was last read from."""
        return self._latest.files

    @property
    def is_written(self) -> bool:
        """Whether it was read from a file, so that there is something to find faults in."""
        return self._latest.expansion is not None

    @property
    def watched(self) -> tuple[str, ...]:
        """Those, and the mesh files that it names: what is shown anew when it changes."""
        return (*self._latest.files, *self._latest.meshes)

    @property
    def began(self) -> int:
        """Wall time in ns at which the last reading of them began."""
        return self._latest.began

    @property
    def package_path(self) -> tuple[str, ...]:
        return self._reader.package_path

    def confine(self, robot: Robot) -> Confined:
        """Another robot beside this one, without the meshes that are not for the page."""
        packages = Packages(self.package_path, around=self.file)
        return confine(robot, MeshRoots(self.file, packages))

    def read(self) -> Reading:
        """Read the description again; may run on another thread."""
        return self._reader.read()

    def take(self, reading: Reading, use: Callable[[Robot], None]) -> str:
        """Take over a new reading, and hand its robot to `use`, which may refuse it with a KbotError; why it
        did, else nothing."""
        self._latest = reading
        self._ownership = Ownership(reading.document)
        self._hints = None
        self.is_stale = reading.robot is None or not reading.usable
        if reading.robot is None or self.is_stale:
            return ""
        try:
            use(reading.robot)
        except KbotError as error:
            problems = error.diagnostics if isinstance(error, DescriptionError) else ()
            self._latest = dataclasses.replace(reading, findings=(*problems, *reading.findings))
            self.is_stale = True
            return str(error)
        self.robot, self._good = reading.robot, reading
        self._meshes.refused = reading.outside
        return ""

    def look(self) -> None:
        """Take note of what was found; the scene's meshes are there by now."""
        notes = lightened_meshes(self.robot, self._meshes)
        self._findings = gravest_first((*self._latest.findings, *notes))
        self.authoring.look_at(self._latest, self._findings)

    def findings(self) -> Findings:
        found = findings_for_page(self._findings, self._ownership)
        return Findings(self.authoring.serial, self.is_stale, found)

    def missing_meshes(self) -> list[str]:
        """What is said of meshes that are not there."""
        return missing_meshes(self._findings)

    def source(self, file: str) -> SourceText:
        """The text of one of the description's files.

        Raises:
            KbotError: another file is asked for, or it cannot be read.
        """
        if file not in self._latest.files and file not in self._good.files:
            raise KbotError(f"{file} is not part of this description")
        source = read_source(file)
        if self._hints is None:
            self._hints = Hints(self._latest.document)
        return SourceText(file, source.text, self._ownership.lines(source.whole()), self._hints.of(source))
