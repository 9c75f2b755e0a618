"""Notes about meshes: those that are drawn with fewer triangles, and those that are missing."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from kbot.model import Mesh, RobotModel
from kbot.text import Diagnostic, Severity
from kbot.workbench.meshes.store import MeshStore

MISSING = ("G101", "G102")
"""Codes of findings about missing meshes."""


def lightened_meshes(robot: RobotModel, meshes: MeshStore) -> Iterator[Diagnostic]:
    """Yield a note for each simplified mesh file, at the first place that refers to it."""
    reported: set[str] = set()
    for link in robot.links.values():
        for shape in (part.geometry for part in link.shapes):
            if not isinstance(shape, Mesh) or shape.path is None or shape.path in reported:
                continue
            lightened = meshes.lightened.get(shape.path)
            if lightened is not None:
                reported.add(shape.path)
                yield Diagnostic(
                    "F007",
                    Severity.INFO,
                    f"{link.name}: the mesh {shape.uri} has {lightened.before:,} triangles."
                    f" The page draws {lightened.after:,}",
                    shape.origin,
                    "physics and checks use all triangles. A file with fewer triangles is faster everywhere",
                )


def missing_meshes(findings: Iterable[Diagnostic]) -> list[str]:
    """Return the findings about missing meshes as text."""
    return [str(finding) for finding in findings if finding.code in MISSING]
