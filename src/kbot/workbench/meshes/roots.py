"""Which mesh files a description may bring into the page: those of its own folders and of packages."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from kbot.model import Mesh, Robot, Visual
from kbot.text import Diagnostic, Severity
from kbot.xacro.packages import PackageNotFound, Packages, package_name


@dataclasses.dataclass(frozen=True, slots=True)
class Confined:
    """A robot whose visuals name no file from elsewhere; those that are, with a finding for each."""

    robot: Robot
    outside: frozenset[str]
    findings: tuple[Diagnostic, ...]


class MeshRoots:
    """The package around a description (without one its folder and the one above, for the usual `../meshes/`)
    and every package that is found from there. Symbolic links are followed before it is decided."""

    def __init__(self, description: str, packages: Packages) -> None:
        self._packages = packages
        folder = Path(description).resolve().parent
        above = folder.parent if folder.parent != folder.parent.parent else folder
        self._own = _package_around(folder) or above
        self._known: dict[str, bool] = {}

    def allow(self, mesh: Mesh) -> bool:
        """Whether the file that a mesh names lies within."""
        path = mesh.path
        if path is None:
            return True
        if path not in self._known:
            self._known[path] = self._lies_within(Path(path).resolve(), mesh.uri)
        return self._known[path]

    def _lies_within(self, file: Path, uri: str) -> bool:
        if file.is_relative_to(self._own):
            return True
        scheme, _, rest = uri.partition("://")
        if scheme in ("package", "model"):
            folder = self._found(rest.partition("/")[0])
            if folder is not None and file.is_relative_to(folder.resolve()):
                return True
        # a workspace may be installed by links to its sources, each with its package.xml
        source = _package_around(file.parent)
        installed = self._found(package_name(str(source))) if source else None
        return (
            source is not None
            and installed is not None
            and (installed / "package.xml").resolve() == (source / "package.xml").resolve()
        )

    def _found(self, name: str) -> Path | None:
        try:
            return Path(self._packages.find(name))
        except PackageNotFound:
            return None


def confine(robot: Robot, roots: MeshRoots) -> Confined:
    """The robot without the files of visuals from elsewhere. Collisions keep theirs, for physics; the page is
    not sent them."""
    outside: dict[str, Diagnostic] = {}
    for link in robot.links.values():
        for mesh in [part.geometry for part in link.visuals] + [part.geometry for part in link.collisions]:
            if not isinstance(mesh, Mesh) or mesh.path is None or mesh.path in outside or roots.allow(mesh):
                continue
            outside[mesh.path] = Diagnostic(
                "F008",
                Severity.ERROR,
                f"{link.name}: the mesh {mesh.uri} lies outside the description's own folders and"
                " all packages; it is not shown",
                mesh.origin,
                "put it into the robot's package, or name the folder of its package with --package-path",
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


def _package_around(folder: Path) -> Path | None:
    return next((f for f in (folder, *folder.parents) if (f / "package.xml").is_file()), None)
