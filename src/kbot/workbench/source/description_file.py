"""The description that the workbench displays, with its arguments."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

from kbot.checks.ranking import ranked
from kbot.model import RobotModel
from kbot.model.meshes import ReadMesh, keep_mesh, kept_version, read_mesh
from kbot.text import Diagnostic, Origin, Severity, Source, Span
from kbot.text.files import unsaved
from kbot.workbench.meshes.simplify import MOST_TRIANGLES, simplify, triangle_count
from kbot.workbench.protocol import Completions, Finding
from kbot.workbench.source.completions import completions_of
from kbot.workbench.source.description import DescriptionInput, DescriptionReading
from kbot.workbench.source.overrides import Overrides
from kbot.workbench.source.ownership import Ownership
from kbot.workbench.source.places import findings_for_page
from kbot.worker import READING, LimitExceeded

Checked = tuple[tuple[Finding, ...], Completions | None]


class DescriptionFile:
    """A xacro or URDF file with the arguments it is expanded with.

    The findings are those of the file with the values given on the command line and the arguments set in the
    page. Properties set in the page only affect what is displayed.
    """

    def __init__(
        self,
        path: str,
        arguments: Mapping[str, str] | None = None,
        package_path: Sequence[str] = (),
        alter: Callable[[RobotModel], RobotModel] = lambda robot: robot,
        properties: Mapping[str, str] | None = None,
    ) -> None:
        """`alter` converts the robot in the file to the one that is displayed."""
        self.path = path
        self.overrides = Overrides(arguments, properties)
        self.package_path = tuple(package_path)
        self.read_only_reason = ""
        self._alter = alter
        self._files: tuple[str, ...] = (path,)
        self._meshes: tuple[str, ...] = ()
        """The files of the last reading that was not stopped."""
        self._allowed: frozenset[str] | None = None

    def read(self) -> DescriptionReading:
        """Read the file in this process, as a verb that ends does. The user waits for it."""
        return self._used(self._input(self._allowed).read())

    def read_again(self) -> DescriptionReading:
        """Read the file and its meshes in the worker. A reading that exceeds a limit is not usable."""
        known = {path: kept_version(path) for path in self._meshes}
        try:
            reading, meshes = READING.call(_read_all, self._input(self._allowed), known)
        except LimitExceeded as error:
            findings = (_stopped(self.path, error),)
            return DescriptionReading(None, False, None, findings, self._files, meshes=self._meshes)
        for mesh in meshes:
            keep_mesh(mesh)
        return self._used(reading)

    def check(self, texts: Mapping[str, str], allowed: Iterable[str]) -> Checked:
        """Return the findings and completions of unsaved texts by file. It runs in the worker.

        `allowed` are the files outside the description's own folders that it may include.

        Raises:
            LimitExceeded: the check was stopped.
        """
        return READING.call(_check, self._input(frozenset(allowed)), dict(texts))

    def allow_only(self, files: Iterable[str]) -> None:
        """From now on, read no other files outside the description's own folders and all packages.

        Only the first call counts: later ones would allow what a page has named since.
        """
        if self._allowed is None:
            self._allowed = frozenset(files)

    def _input(self, allowed: frozenset[str] | None) -> DescriptionInput:
        overrides = self.overrides
        return DescriptionInput(
            self.path,
            overrides.arguments,
            overrides.properties,
            overrides.given_properties,
            self.package_path,
            allowed,
        )

    def _used(self, reading: DescriptionReading) -> DescriptionReading:
        self._files, self._meshes = reading.files, reading.meshes
        return replace(reading, robot=self._alter(reading.robot)) if reading.robot is not None else reading


def _read_all(
    given: DescriptionInput, known: Mapping[str, tuple[int, int]]
) -> tuple[DescriptionReading, list[ReadMesh]]:
    """Return a reading, and its meshes of which the caller does not know this version."""
    reading = given.read()
    meshes = [mesh for mesh in map(read_mesh, reading.meshes) if mesh.version != known.get(mesh.path)]
    simplified = {
        mesh.path: simplify(mesh.data.parts)
        for mesh in meshes
        if mesh.data is not None and triangle_count(mesh.data.parts) > MOST_TRIANGLES
    }
    return replace(reading, simplified=simplified), meshes


def _check(given: DescriptionInput, texts: Mapping[str, str]) -> Checked:
    with unsaved(texts):
        reading = given.read()
    return findings_for_page(ranked(reading.findings), Ownership(reading.document)), completions_of(reading)


def _stopped(path: str, error: LimitExceeded) -> Diagnostic:
    more = f"start KBot with --limit-time {READING.limits.seconds * 10:g} if it should take that long"
    return Diagnostic(
        "F009",
        Severity.ERROR,
        f"reading {path} {error}",
        Origin(Span(Source(path, ""), 0, 0)),
        more if error.is_late else "",
    )
