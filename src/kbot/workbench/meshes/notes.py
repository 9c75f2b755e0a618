"""Notes about meshes: which are drawn with fewer triangles, and which are missing."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from kbot.model import Mesh, RobotModel
from kbot.text import Diagnostic, Severity
from kbot.workbench.meshes.store import MeshStore

MISSING = ("G101", "G102")


def lightened_meshes(robot: RobotModel, meshes: MeshStore) -> Iterator[Diagnostic]:
    """A note for each very large mesh file, where it is first named."""
    said: set[str] = set()
    for link in robot.links.values():
        for shape in (part.geometry for part in link.shapes):
            if not isinstance(shape, Mesh) or shape.path is None or shape.path in said:
                continue
            lightened = meshes.lightened.get(shape.path)
            if lightened is not None:
                said.add(shape.path)
                yield Diagnostic(
                    "F007",
                    Severity.INFO,
                    f"{link.name}: the mesh {shape.uri} has {lightened.before:,} triangles;"
                    f" {lightened.after:,} of them are drawn here",
                    shape.origin,
                    "physics and checks take all of them; a lighter file is faster everywhere",
                )


def missing_meshes(findings: Iterable[Diagnostic]) -> list[str]:
    """The findings that a mesh is not there, as text."""
    return [str(finding) for finding in findings if finding.code in MISSING]
