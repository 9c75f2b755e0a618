"""Finding robot packages without ROS: `$(find NAME)` and `package://NAME/…`.

Searched in this order: the paths given, AMENT_PREFIX_PATH, ROS_PACKAGE_PATH, folders with a
package.xml around the file and in the working directory, and at last the packages shipped with
KBot. Symbolic links are not resolved: a path is answered as it was given.
"""

from __future__ import annotations

import os
import re
from contextlib import suppress
from pathlib import Path

from kbot.text.errors import KbotError
from kbot.text.files import check_regular, from_file_uri
from kbot.text.installed import find_file
from kbot.text.suggest import did_you_mean

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

SHIPPED = os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "robots")

_NAME = re.compile(r"<name>\s*([^<]*?)\s*</name>")
_SKIPPED_FOLDERS = {"build", "install", "log", "node_modules", "__pycache__", "site-packages"}
_IGNORE_MARKS = ("CATKIN_IGNORE", "COLCON_IGNORE", "AMENT_IGNORE")
_MAX_DEPTH = 8
_MAX_FOLDERS = 20_000


class PackageNotFound(KbotError):
    """No package of that name where packages are looked for."""

    def __init__(self, name: str, known: Sequence[str], searched: Sequence[str]) -> None:
        self.name = name
        self.nearest = did_you_mean(name, known)
        self.hint = self.nearest or (
            "put its folder beneath the working directory, or name it with --package-path or ROS_PACKAGE_PATH"
        )
        self.searched = tuple(searched)
        super().__init__(f"the package '{name}' is not found: {self.hint}")


class Packages:
    """Where packages are found. Answers are remembered for the life of the object.

    `paths` are package folders, folders of packages, or install prefixes; `around` is the file
    (or folder) whose own workspace is searched.
    """

    def __init__(self, paths: Sequence[str | os.PathLike[str]] = (), around: str | None = None) -> None:
        # absolute, so that what is found there can be named in a file of any folder
        self.paths = tuple(os.path.abspath(path) for path in paths)
        self.around = around
        self._found: dict[str, str] = {}
        self._missing: dict[str, tuple[Sequence[str], Sequence[str]]] = {}
        self._crawled: dict[str, dict[str, str]] = {}

    def beside(self, file: str) -> Packages:
        """These packages, searched around `file` too; itself when it has a place already."""
        return self if self.around is not None else Packages(self.paths, file)

    def find(self, name: str) -> str:
        """The share folder of a package.

        Raises:
            PackageNotFound: with the nearest names that there are.
        """
        folder = self._found.get(name)
        if folder is None:
            folder = None if name in self._missing else self._search(name)
            if folder is None:
                if name not in self._missing:
                    self._missing[name] = (self.names(), self._roots())
                raise PackageNotFound(name, *self._missing[name])
            self._found[name] = folder
        return folder

    def others(self, name: str) -> tuple[str, ...]:
        """Where `find` takes a package from the working directory: further ones of that name in there.

        Raises:
            PackageNotFound: there is none of the name.
        """
        taken = os.path.abspath(self.find(name))
        folders = [f for f in _package_folders(str(Path.cwd())) if package_name(f) == name]
        return tuple(f for f in folders if f != taken) if taken in folders else ()

    def resolve(self, uri: str, beside: str | None = None) -> str | None:
        """The path a mesh's or texture's URI names, or None when there is no such file; see `expected`."""
        path = self.expected(uri, beside)
        return find_file(path) if path is not None else None

    def expected(self, uri: str, beside: str | None = None) -> str | None:
        """The path a URI names, whether or not there is such a file; None where it names no path here.

        `package://NAME/…`, `model://NAME/…`, `file://…`, an absolute path, or a path relative to
        the folder of `beside` (or of the file around which packages are searched).
        """
        scheme, separator, rest = uri.partition("://")
        if separator and "%" in rest:
            from urllib.parse import unquote

            rest = unquote(rest)
        if separator and scheme in ("package", "model"):
            name, _, inner = rest.partition("/")
            try:
                path = os.path.join(self.find(name), inner.lstrip("/"))
            except PackageNotFound:
                return None
        elif separator and scheme == "file":
            path = from_file_uri(rest)
        elif separator:
            return None
        else:
            anchor = os.fspath(beside or self.around or ".")
            folder = anchor if os.path.isdir(anchor) else os.path.dirname(anchor)
            path = os.path.join(folder, uri)
        return str(Path(path))

    def names(self) -> list[str]:
        """Every package name that can be found, sorted."""
        known: set[str] = set()
        for root in self._roots():
            known.update(self._crawl(root))
        for prefix in self._prefixes():
            share = Path(prefix) / "share"
            if share.is_dir():
                known.update(p.parent.name for p in share.glob("*/package.xml"))
        return sorted(known)

    def _search(self, name: str) -> str | None:
        if not name or "/" in name or "\\" in name or name in (".", ".."):
            return None
        for path in self.paths:
            found = self._below(path, name)
            if found:
                return found
        for prefix in _split("AMENT_PREFIX_PATH"):
            found = _installed(prefix, name)
            if found:
                return found
        for root in (*_split("ROS_PACKAGE_PATH"), *self._workspaces(), SHIPPED):
            direct = os.path.join(root, name)
            if os.path.isfile(os.path.join(direct, "package.xml")) and package_name(direct) == name:
                return direct
            found = self._crawl(root).get(name)
            if found:
                return found
        return None

    def _below(self, path: str, name: str) -> str | None:
        """A package at `path`, installed under it, or anywhere beneath it."""
        return _installed(path, name) or self._crawl(path).get(name)

    def _prefixes(self) -> tuple[str, ...]:
        return (*self.paths, *_split("AMENT_PREFIX_PATH"))

    def _roots(self) -> tuple[str, ...]:
        roots = (*self.paths, *_split("ROS_PACKAGE_PATH"), *self._workspaces(), SHIPPED)
        return tuple(dict.fromkeys(roots))

    def _workspaces(self) -> Iterator[str]:
        """Folders to crawl for packages: the one that holds the file's own package, and the working one."""
        if self.around:
            folder = Path(os.path.abspath(self.around))
            folder = folder if folder.is_dir() else folder.parent
            package = next((p for p in (folder, *folder.parents) if (p / "package.xml").is_file()), None)
            if package:
                yield str(package)
                # its siblings are the rest of the workspace; a root folder is not one
                if package.parent != package.parent.parent:
                    yield str(package.parent)
            else:
                yield str(folder)
        yield str(Path.cwd())

    def _crawl(self, root: str) -> dict[str, str]:
        """Names and folders of the packages beneath a folder, which may be one itself."""
        known = self._crawled.get(root)
        if known is None:
            known = self._crawled[root] = {}
            for folder in _package_folders(root):
                known.setdefault(package_name(folder), folder)
        return known


def _split(variable: str) -> list[str]:
    return [entry for entry in os.environ.get(variable, "").split(os.pathsep) if entry]


def _installed(prefix: str, name: str) -> str | None:
    """PREFIX/share/NAME where the ament index or a package.xml says that it is one."""
    share = Path(prefix) / "share"
    folder = share / name
    marker = share / "ament_index" / "resource_index" / "packages" / name
    return str(folder) if marker.is_file() or (folder / "package.xml").is_file() else None


def package_name(folder: str) -> str:
    """The name that a package's folder gives itself."""
    manifest = Path(folder) / "package.xml"
    try:
        check_regular(manifest)
        match = _NAME.search(manifest.read_text(encoding="utf-8", errors="replace"))
    except OSError:
        match = None
    return match[1] if match else manifest.parent.name


def _package_folders(root: str) -> Iterator[str]:
    """Folders with a package.xml, breadth first so that the nearest one wins; none within another."""
    level, seen = [root], 0
    for _ in range(_MAX_DEPTH):
        following: list[str] = []
        for folder in level:
            try:
                with os.scandir(folder) as entries:
                    children = sorted(entries, key=lambda entry: entry.name)
            except OSError:
                continue
            names = {child.name for child in children}
            if not names.isdisjoint(_IGNORE_MARKS):
                continue
            if "package.xml" in names:
                yield folder
                continue
            for child in children:
                if child.name.startswith(".") or child.name in _SKIPPED_FOLDERS:
                    continue
                with suppress(OSError):  # a link that leads round in a circle
                    if child.is_dir():
                        following.append(child.path)
            seen += len(children)
            if seen > _MAX_FOLDERS:
                return
        level = following
