"""Finds robot packages without ROS, for `$(find NAME)` and `package://NAME/…`.

Search order: the given paths, AMENT_PREFIX_PATH, ROS_PACKAGE_PATH, folders with a package.xml around the
file and in the working directory, and last the packages that ship with KBot. Symbolic links are not resolved:
the result starts with a path as it was given.

The order of paths and variables decides between packages of one name, as in ROS (rospack: "the first one
found wins"). The order of a search in folders decides nothing: there, several packages of one name are an
error, as for colcon and catkin, unless one of them is nearest to the file.

A package that ships with KBot must never replace the user's own package of the same name. A nearby folder of
that name is therefore the package even without a package.xml: learners create folders by hand.
"""

from __future__ import annotations

import os
import re
from contextlib import suppress
from functools import cache
from itertools import takewhile
from pathlib import Path

from kbot.brief import Brief
from kbot.text.errors import KbotError
from kbot.text.files import from_file_uri, read_bytes
from kbot.text.installed import find_file
from kbot.text.notes import note
from kbot.text.suggest import did_you_mean

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

SHIPPED = os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "robots")
"""The folder of the packages that ship with KBot."""

_NAME = re.compile(r"<name>([^<]*)</name>")
_OF_CATKIN = {"build_isolated", "install_isolated"}
_SKIPPED_FOLDERS = {"build", "install", "log", "node_modules", "__pycache__", "site-packages", *_OF_CATKIN}
_IGNORE_MARKS = ("CATKIN_IGNORE", "COLCON_IGNORE", "AMENT_IGNORE")
_MAX_DEPTH = 8
"""Levels of folders that are searched."""
_MAX_FOLDERS = 20_000
"""Entries of folders after which a search stops."""


_ADD_TO_PATH = "add it to --package-path or ROS_PACKAGE_PATH"
_CHOOSE = "add the right one to --package-path or ROS_PACKAGE_PATH"
_HOW_TO_ADD = f"put its folder below the working directory, or {_ADD_TO_PATH}"
_REPOSITORIES = Path(__file__).with_name("package_repositories.tsv")
"""The GitHub repositories of packages that robots often use. Each one was verified to contain the package."""


class PackageError(KbotError):
    """No package can be used for a name. `problem` and `hint` are the parts of the message."""

    def __init__(self, name: str, problem: str, hint: str) -> None:
        self.name, self.problem, self.hint = name, problem, hint
        super().__init__(f"{problem}: {hint}")


class PackageNotFound(PackageError):
    """There is no package with this name where packages are searched."""

    def __init__(
        self, name: str, known: Sequence[str], searched: Sequence[str], folder: str | None = None
    ) -> None:
        if folder is not None and Path.cwd() in Path(folder).parents:
            folder = str(Path(folder).relative_to(Path.cwd()))
        self.folder = folder
        """A folder with this name that is not such a package. Relative if in the working directory."""
        repository = public_repositories().get(name)
        # no similar name if the user has such a folder: the similar one could be the shipped robot's
        self.nearest = did_you_mean(name, known) if folder is None and repository is None else ""
        if folder is not None:
            hint = _why_not(name, folder)
        elif repository is not None:
            hint = f"get it from https://github.com/{repository} and {_HOW_TO_ADD}"
        else:
            hint = self.nearest or _HOW_TO_ADD
        self.searched = tuple(searched)
        super().__init__(name, f"the package '{name}' is not found", hint)


class AmbiguousPackage(PackageError):
    """Several packages with this name are where packages are searched, and none is nearest to the file."""

    def __init__(self, name: str, places: Sequence[str]) -> None:
        self.places = tuple(places)
        super().__init__(name, f"several packages are named '{name}': {', '.join(places)}", _CHOOSE)


class Packages(Brief):
    """Finds packages, and caches the results for the life of the object.

    `paths` are package folders, folders of packages, or install prefixes. `around` is the file or folder
    whose workspace is searched.
    """

    def __init__(self, paths: Sequence[str | os.PathLike[str]] = (), around: str | None = None) -> None:
        # absolute, so that a file in any folder can name the results
        self.paths = tuple(os.path.abspath(path) for path in paths)
        self.around = around
        self._found: dict[str, str | None] = {}
        self._origins: dict[str, str] = {}
        """The option or variable through which a package was found, by the package's name."""
        self._notes: dict[str, str] = {}
        self._fallbacks: set[str] = set()
        """Names of packages for which KBot's own is used."""
        self._missing: dict[str, tuple[Sequence[str], Sequence[str], str | None]] = {}
        self._ambiguous: dict[str, Sequence[str]] = {}
        """The folders of the packages between which nothing decides, by name."""
        self._crawled: dict[str, dict[str, list[str]]] = {}
        self._enclosing: dict[str, dict[str, str]] = {}
        """For each folder: the folder and those that contain it, by folder name and by package name."""

    def beside(self, file: str) -> Packages:
        """These packages, searched also around `file`. Returns itself if it already has such a place."""
        return self if self.around is not None else Packages(self.paths, file)

    def find(self, name: str) -> str:
        """The share folder of a package.

        Sends a note if KBot's own package is used, or if an option or variable hides the user's own folder of
        that name.

        Raises:
            PackageNotFound: there is no such package. The error has a hint.
            AmbiguousPackage: there are several, and nothing decides between them.
        """
        folder = self.folder(name)
        if name in self._ambiguous:
            raise AmbiguousPackage(name, self._ambiguous[name])
        if folder is None:
            if name not in self._missing:
                self._missing[name] = (self.names(), self._roots(), self._same_named_folder(name))
            raise PackageNotFound(name, *self._missing[name])
        if name in self._fallbacks:
            places = f"{self.around} or {Path.cwd()}" if self.around else str(Path.cwd())
            note(
                f"using the {name} that ships with KBot: no folder or package {name} is near {places}, "
                "or in --package-path, AMENT_PREFIX_PATH or ROS_PACKAGE_PATH"
            )
        if name in self._origins:
            if name not in self._notes:
                self._notes[name] = self._hidden(name, folder)
            if self._notes[name]:
                note(self._notes[name])
        return folder

    def folder(self, name: str) -> str | None:
        """The share folder of a package, or None, also if there are several. Sends no note."""
        if name not in self._found:
            try:
                folder = self._search(name)
            except AmbiguousPackage as error:
                folder, self._ambiguous[name] = None, error.places
            if folder is None and name in _shipped_names() and name not in self._ambiguous:
                folder = os.path.join(SHIPPED, name)
                self._fallbacks.add(name)
            self._found[name] = folder
        return self._found[name]

    def resolve(self, uri: str, beside: str | None = None) -> str | None:
        """The file that a mesh's or texture's URI names, or None if it does not exist. See `expected`."""
        path = self.expected(uri, beside)
        return find_file(path) if path is not None else None

    def expected(self, uri: str, beside: str | None = None) -> str | None:
        """The path that a URI names, whether or not the file exists. None for a URI that names no local path.

        A URI is `package://NAME/…`, `model://NAME/…`, `file://…`, an absolute path, or a path relative to the
        folder of `beside` (by default, of the file around which packages are searched).
        """
        scheme, separator, rest = uri.partition("://")
        if separator and "%" in rest:
            from urllib.parse import unquote  # rarely needed: start-up time

            rest = unquote(rest)
        if separator and scheme in ("package", "model"):
            name, _, inner = rest.partition("/")
            try:
                path = os.path.join(self.find(name), inner.lstrip("/"))
            except PackageError:
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
        if not _can_be_a_name(name):
            return None
        own = os.path.join(SHIPPED, name)
        if self.around and Path(os.path.abspath(self.around)).is_relative_to(own):
            return own  # the shipped robot always uses its own files, even if ROS has such a package
        for origin, found in self._named_places(name):
            if found:
                self._origins[name] = origin
                return found
        for place, workspaces in self._places():
            found = self._near(place, workspaces, name)
            if found:
                return found
        return None

    def _named_places(self, name: str) -> Iterator[tuple[str, str | None]]:
        """Each place that the user or ROS names: the option or variable, and the package there, if any."""
        for path in self.paths:
            yield "--package-path", self._below(path, name)
        for prefix in _split("AMENT_PREFIX_PATH"):
            yield "AMENT_PREFIX_PATH", _installed(prefix, name)
        for root in _split("ROS_PACKAGE_PATH"):
            yield "ROS_PACKAGE_PATH", _beside(root, name) or next(iter(self._crawl(root).get(name, ())), None)

    def _hidden(self, name: str, used: str) -> str:
        """A note that an option or variable hides the user's own folder of this name. Empty if it does not.

        Only a typed name (`around` is None) is searched below the working directory too. A description names
        dozens of ROS packages, and each search visits thousands of folders.
        """
        here = Path.cwd()
        own = self._containing(_folder_of(self.around), name) if self.around else None
        relation = "the folder that contains the file"
        if own is None:
            own, relation = self._containing(here, name), "the folder that contains the working directory"
        if own is None and self.around is None:
            with suppress(AmbiguousPackage):  # the option or variable decides between them
                own, relation = self._near(here, (str(here),), name), "the folder in the working directory"
        if own is None or _is_same_package(used, own):
            return ""
        return f"the package {name} is {used} (from {self._origins[name]}), not {own}, {relation}"

    def _near(self, place: Path, workspaces: Sequence[str], name: str) -> str | None:
        """A package around a folder or in its workspaces."""
        ships = name in _shipped_names()
        own = self._containing(place, name) if ships else None
        if own is not None:  # a repository may have the same name as the package in it
            return self._only(name, self._crawl(own).get(name, [own]))
        for root in workspaces:
            # a package beside the file, or beside the package that contains it, is the nearest
            beside_file = _beside(root, name) if self.around and place == _folder_of(self.around) else None
            found = beside_file or self._only(name, self._crawl(root).get(name, ()))
            if found:
                return found
        beside = (os.path.join(folder, name) for folder in (place, *place.parents))
        return next(filter(os.path.isdir, beside), None) if ships else None

    def _containing(self, place: Path, name: str) -> str | None:
        """The nearest folder, from `place` upwards, that has this name or a package.xml with this name."""
        names = self._enclosing.get(str(place))
        if names is None:
            names = self._enclosing[str(place)] = {}
            folder, inner = str(place), ""
            while folder != inner:
                names.setdefault(os.path.basename(folder), folder)
                if os.path.isfile(os.path.join(folder, "package.xml")):
                    names.setdefault(package_name(folder), folder)
                folder, inner = os.path.dirname(folder), folder
        return names.get(name)

    def _same_named_folder(self, name: str) -> str | None:
        """A folder with the name of a package that was not found.

        The folder contains the file or the working directory, or is in one of the searched folders.
        """
        if not _can_be_a_name(name):
            return None
        for place, workspaces in self._places():
            own = self._containing(place, name)
            if own is not None:
                return own
            inside = (os.path.join(folder, name) for folder in (str(place), *workspaces))
            found = next(filter(os.path.isdir, inside), None)
            if found is not None:
                return found
        return None

    def _only(self, name: str, folders: Sequence[str]) -> str | None:
        """The package of this name among folders that a search found, or None if there are none.

        If there are several, it is the one that shares most of its path with the file. Raises
        AmbiguousPackage: none does.
        """
        if len(folders) < 2:
            return folders[0] if folders else None
        different = {os.path.realpath(folder): folder for folder in reversed(folders)}  # the first of each
        if len(different) > 1 and self.around:
            place = _folder_of(self.around).resolve()
            shared = {real: _shared_parts(place, Path(real)) for real in different}
            most = max(shared.values())
            different = {real: folder for real, folder in different.items() if shared[real] == most}
        if len(different) > 1:
            raise AmbiguousPackage(name, [folder for folder in folders if folder in different.values()])
        return next(iter(different.values()))

    def _below(self, path: str, name: str) -> str | None:
        """A package at `path`, installed under it, or anywhere below it."""
        return _installed(path, name) or self._only(name, self._crawl(path).get(name, ()))

    def _prefixes(self) -> tuple[str, ...]:
        return (*self.paths, *_split("AMENT_PREFIX_PATH"))

    def _roots(self) -> tuple[str, ...]:
        near = (root for _, workspaces in self._places() for root in workspaces)
        return tuple(dict.fromkeys((*self.paths, *_split("ROS_PACKAGE_PATH"), *near, SHIPPED)))

    def _places(self) -> Iterator[tuple[Path, Sequence[str]]]:
        """The folders around which packages are searched, each with the folders to crawl.

        First the file's folder with its workspace, then the working directory.
        """
        if self.around:
            folder = _folder_of(self.around)
            package = package_around(folder)
            if package is None:
                yield folder, (str(folder),)
            elif package.parent == package.parent.parent:  # a root folder is not a workspace
                yield folder, (str(package),)
            else:
                yield folder, (str(package), str(package.parent))
        yield Path.cwd(), (str(Path.cwd()),)

    def _crawl(self, root: str) -> dict[str, list[str]]:
        """Names and folders of the packages in a folder, which may itself be a package. The nearest come
        first."""
        known = self._crawled.get(root)
        if known is None:
            known, shipped, called = {}, _shipped_names(), dict[str, list[str]]()
            for folder, is_package in _folders(root):
                if is_package:
                    known.setdefault(package_name(folder), []).append(folder)
                elif os.path.basename(folder) in shipped:
                    called.setdefault(os.path.basename(folder), []).append(folder)
            for name, folders in called.items():
                # a repository may have the name of the package in it
                inner = known.setdefault(name, [])
                real = tuple(map(Path, inner))
                inner += [f for f in folders if not any(path.is_relative_to(f) for path in real)]
            self._crawled[root] = known
        return known


def _can_be_a_name(name: str) -> bool:
    return bool(name) and "/" not in name and "\\" not in name and name not in (".", "..")


def _why_not(name: str, folder: str) -> str:
    """Why a folder is not the package with this name, and what to do."""
    if not os.path.isfile(os.path.join(folder, "package.xml")):
        return f"the folder {folder} has no package.xml: add one"
    own = package_name(folder)
    if own != name:
        return f"the package.xml of the folder {folder} has the name '{own}': correct one of the two names"
    return f"the folder {folder} is not searched: {_ADD_TO_PATH}"


def _folder_of(path: str) -> Path:
    """The folder of a file, or a folder itself."""
    folder = Path(os.path.abspath(path))
    return folder if folder.is_dir() else folder.parent


def _is_same_package(used: str, own: str) -> bool:
    """Whether the used package is the user's own.

    It may be the same folder, be installed by links to it (colcon --symlink-install), or be inside it (a
    repository with the name of its package).
    """
    with suppress(OSError):  # either may have no package.xml
        if os.path.samefile(os.path.join(used, "package.xml"), os.path.join(own, "package.xml")):
            return True
    return Path(used).resolve().is_relative_to(Path(own).resolve())


def _shared_parts(place: Path, folder: Path) -> int:
    """How many folders two paths share, from the root on."""
    same = (a == b for a, b in zip(place.parts, folder.parts, strict=False))
    return sum(takewhile(bool, same))


def _beside(root: str, name: str) -> str | None:
    """ROOT/NAME if it is the package of this name."""
    folder = os.path.join(root, name)
    is_package = os.path.isfile(os.path.join(folder, "package.xml")) and package_name(folder) == name
    return folder if is_package else None


def _split(variable: str) -> list[str]:
    return [entry for entry in os.environ.get(variable, "").split(os.pathsep) if entry]


def _installed(prefix: str, name: str) -> str | None:
    """PREFIX/share/NAME if the ament index or a package.xml declares it, or if KBot ships such a package."""
    share = os.path.join(prefix, "share")
    folder = os.path.join(share, name)
    markers = os.path.join(share, "ament_index/resource_index/packages", name), f"{folder}/package.xml"
    is_package = any(map(os.path.isfile, markers))
    return folder if is_package or (name in _shipped_names() and os.path.isdir(folder)) else None


def package_name(folder: str) -> str:
    """The name in a folder's package.xml, or else the folder's name."""
    manifest = Path(folder) / "package.xml"
    try:
        match = _NAME.search(read_bytes(manifest).decode("utf-8", "replace"))
    except OSError:
        match = None
    return match[1].strip() if match else manifest.parent.name


def is_shipped(file: str | Path) -> bool:
    """Whether a file ships with KBot, also if a symbolic link leads to it. Nothing may change such a file."""
    return Path(file).resolve().is_relative_to(Path(SHIPPED).resolve())


def may_change(file: str | Path) -> bool:
    """Whether a command may change a file of a robot: it is in the working directory, and not KBot's own.

    Files elsewhere, such as those in /opt/ros, belong to other packages.
    """
    return Path(file).resolve().is_relative_to(Path.cwd().resolve()) and not is_shipped(file)


def package_around(folder: Path) -> Path | None:
    """The nearest folder with a package.xml, from this one upwards."""
    return next((f for f in (folder, *folder.parents) if (f / "package.xml").is_file()), None)


def lies_in_package(file: Path, uri: str, packages: Packages) -> bool:
    """Whether a file is inside the package that its URI names, or inside another package that can be found.

    `file` is a path with resolved symbolic links.
    """
    scheme, _, rest = uri.partition("://")
    if scheme in ("package", "model"):
        folder = packages.folder(rest.partition("/")[0])
        if folder is not None and file.is_relative_to(Path(folder).resolve()):
            return True
    # colcon --symlink-install: the installed package links to a source package with the same package.xml
    source = package_around(file.parent)
    installed = packages.folder(package_name(str(source))) if source else None
    return (
        source is not None
        and installed is not None
        and Path(installed, "package.xml").resolve() == (source / "package.xml").resolve()
    )


@cache
def public_repositories() -> dict[str, str]:
    """The GitHub repository (OWNER/NAME) of well-known packages, by package."""
    lines = _REPOSITORIES.read_text("utf-8").splitlines()[1:]
    return dict(line.split("\t") for line in lines)


@cache
def _shipped_names() -> frozenset[str]:
    """Names of the packages that ship with KBot."""
    return frozenset(name for name in os.listdir(SHIPPED) if not name.startswith((".", "__")))


def _folders(root: str) -> Iterator[tuple[str, bool]]:
    """The folders below `root`, and whether each is a package. Folders inside a package are not visited.

    The search is breadth-first, so that the nearest package wins.
    """
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
            yield folder, "package.xml" in names
            if "package.xml" in names:
                continue
            for child in children:
                if child.name.startswith(".") or child.name in _SKIPPED_FOLDERS:
                    continue
                with suppress(OSError):  # a circular link
                    if child.is_dir():
                        following.append(child.path)
            seen += len(children)
            if seen > _MAX_FOLDERS:
                return
        level = following
