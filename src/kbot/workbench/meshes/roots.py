"""The files that a page may display or change: those in the description's own folders and in packages."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from kbot.model import Mesh, RobotModel, Visual
from kbot.text import Diagnostic, Severity
from kbot.xacro.packages import Packages, lies_in_package, package_around


@dataclasses.dataclass(frozen=True, slots=True)
class Confined:
    """A robot without visuals from other folders, the files that were removed, and a finding for each."""

    robot: RobotModel
    outside: frozenset[str]
    findings: tuple[Diagnostic, ...]


TEXTS = (".xacro", ".urdf", ".gazebo", ".xml", ".sdf", ".yaml", ".yml")
"""Endings of the text files of a description."""
NOT_OWN = "outside the description's own folders and all packages, or not a description or YAML file"
"""Why a text file is not one of `OwnFiles`."""


class OwnFiles:
    """The files in the package around a description, and in every package that is found from there.

    A description outside any package may use its own folder. Its meshes may also be in the one above, for the
    usual `../meshes/`. Symbolic links are resolved before the check.
    """

    def __init__(self, description: str, packages: Packages) -> None:
        self._packages = packages
        folder = Path(description).resolve().parent
        above = folder.parent if folder.parent != folder.parent.parent else folder
        self._own_texts = package_around(folder) or folder
        self._own = package_around(folder) or above
        self._known: dict[str, bool] = {}

    def have_mesh(self, mesh: Mesh) -> bool:
        """Return whether a mesh's file is inside these folders, or missing."""
        path = mesh.path
        if path is None:
            return not mesh.uri.startswith(("http://", "https://"))
        if path not in self._known:
            self._known[path] = self._lies_within(Path(path).resolve(), mesh.uri)
        return self._known[path]

    def have_text(self, path: str) -> bool:
        """Return whether a file is inside these folders, and may be a part of a description by its name.

        A description in the home folder has the user's keys and programs beside it.
        """
        file = Path(path).resolve()
        if file.suffix not in TEXTS:
            return False
        if file.is_relative_to(self._own_texts):
            return not any(part.startswith(".") for part in file.relative_to(self._own_texts).parts)
        return lies_in_package(file, "", self._packages)

    def _lies_within(self, file: Path, uri: str) -> bool:
        return file.is_relative_to(self._own) or lies_in_package(file, uri, self._packages)


def confine(robot: RobotModel, own: OwnFiles) -> Confined:
    """Remove the files of visuals outside the roots.

    Collisions keep theirs for physics, but those are not sent to the page.
    """
    outside: dict[str, Diagnostic] = {}
    for link in robot.links.values():
        for mesh in (part.geometry for part in link.shapes):
            if not isinstance(mesh, Mesh) or (mesh.path or mesh.uri) in outside or own.have_mesh(mesh):
                continue
            outside[mesh.path or mesh.uri] = Diagnostic(
                "F008",
                Severity.ERROR,
                f"{link.name}: the mesh {mesh.uri} is outside the description's own folders and"
                " all packages. It is not displayed",
                mesh.origin,
                "move it into the robot's package, or add the folder of its package with --package-path",
            )
    if not outside:
        return Confined(robot, frozenset(), ())
    links = {
        name: dataclasses.replace(link, visuals=tuple(_without(part, outside) for part in link.visuals))
        for name, link in robot.links.items()
    }
    return Confined(dataclasses.replace(robot, links=links), frozenset(outside), tuple(outside.values()))


def _without(part: Visual, outside: dict[str, Diagnostic]) -> Visual:
    shape = part.geometry
    if not isinstance(shape, Mesh) or shape.path not in outside:
        return part
    return dataclasses.replace(part, geometry=dataclasses.replace(shape, path=None))
