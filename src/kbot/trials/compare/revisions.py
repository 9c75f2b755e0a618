"""What `kbot compare` compares: robot files, packages, recordings, and git revisions of a file or package."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from kbot.model.load import SHIPPED_NAME, Loaded, load_robot, resolve_robot_path
from kbot.record.names import is_recording
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean
from kbot.text.temporary import TemporaryFolder
from kbot.trials.compare.git import Repository, extract
from kbot.trials.robot_folder import absolute, own_package, robot_of_folder
from kbot.xacro import PackageNotFound, Packages
from kbot.xacro.assignments import Assignments, resolve_names

_REVISION = re.compile(r"(?P<revision>[^:]+):(?P<path>.*)", re.DOTALL)
_DRIVE = re.compile(r"[A-Za-z]:[\\/]")


@dataclass(frozen=True)
class Description:
    """A robot's description: a file on disk, or of a git revision that was extracted.

    name          as the user wrote it
    file          the robot's file
    values        typed `name:=value`: xacro arguments, or else top-level properties
    package_path  where packages are searched first
    tree          the folder with the extracted revision, empty for a file on disk
    top           the repository's folder on disk, for an extracted revision
    """

    name: str
    file: str
    values: Mapping[str, str] = field(default_factory=dict)
    package_path: tuple[str, ...] = ()
    tree: str = ""
    top: str = ""

    def given(self) -> Assignments:
        """The arguments and properties that the values set.

        Raises:
            DescriptionError: the description does not have one of the names.
        """
        return resolve_names(self.file, self.values, self.packages()).require()

    def load(self, given: Assignments | None = None, packages: Packages | None = None) -> Loaded:
        """Expand and read the robot. Errors in the description are diagnostics. Raises as `given` does."""
        assigned, found = given or self.given(), packages or self.packages()
        return load_robot(self.file, assigned.arguments, assigned.properties, found)

    def packages(self) -> Packages:
        """Finds the robot's packages, and caches the results."""
        return Packages(self.package_path, self.file)

    def shown(self, path: str) -> str:
        """The path of a file as reports name it: where it is in the working directory, also if it was
        extracted from a revision."""
        place = Path(absolute(path))
        if self.tree and place.is_relative_to(self.tree):
            place = Path(self.top) / place.relative_to(self.tree)
        here = Path.cwd()
        return place.relative_to(here).as_posix() if place.is_relative_to(here) else str(place)


@dataclass(frozen=True)
class RecordingFile:
    """A recorded run, whose path is `name`."""

    name: str


@contextmanager
def opened(
    word: str, values: Mapping[str, str] | None = None, package_path: Sequence[str] = ()
) -> Iterator[Description | RecordingFile]:
    """The robot or recording that a word on the command line names.

    The word is a file, the folder or name of a package, a recording, or a git revision with the path of a
    file or folder: `main:urdf/robot.xacro`. `HEAD~1:` is the package in the working directory. A revision is
    extracted as a whole, so that files and packages that the robot uses are of the same revision. The
    extracted files exist until the block ends.

    Raises:
        KbotError: there is no such file, package or revision, or a package has none or several robots.
    """
    given = dict(values or {})
    match = None if Path(word).exists() or _DRIVE.match(word) else _REVISION.fullmatch(word)
    if match is None:
        yield _on_disk(word, given, package_path)
        return
    repository = Repository.around(str(Path.cwd()))
    commit = repository.commit(match["revision"])
    with TemporaryFolder("compare") as folder:
        tree = os.path.realpath(folder)  # on macOS the folder of temporary files is a link
        paths = extract(repository, commit, tree)
        place = _in_revision(repository, match["revision"], match["path"], paths)
        file, places = str(Path(tree, place)), (tree, *package_path)
        if Path(file).is_dir():
            file = robot_of_folder(file, places, lambda path: f"{match['revision']}:{_relative(path, tree)}")
        # the revision's packages come before those that ROS's variables and the working directory have
        own = [package for package in own_package(file) if Path(package).is_relative_to(tree)]
        yield Description(word, file, given, (*own, *places), tree, repository.top)


def _on_disk(word: str, values: dict[str, str], package_path: Sequence[str]) -> Description | RecordingFile:
    if is_recording(word):
        return RecordingFile(word)
    file = resolve_robot_path(word)
    if word != SHIPPED_NAME and not Path(word).exists() and not _looks_like_a_path(word):
        try:
            file = Packages(package_path).find(word)
        except PackageNotFound:
            what = "a file, a package, a recording or a git revision (REVISION:PATH)"
            raise KbotError(f"{word} is not {what}") from None
    if Path(file).is_dir():
        file = robot_of_folder(file, package_path)
    return Description(word, file, values, (*own_package(file), *package_path))


def _looks_like_a_path(word: str) -> bool:
    return word.endswith((".xacro", ".urdf")) or "/" in word or os.sep in word


def _in_revision(repository: Repository, revision: str, path: str, paths: Sequence[str]) -> str:
    """A path from the top of the repository. Like git, `path` is relative to the top; if there is no such
    path, or if it begins with `./`, it is relative to the working directory."""
    written = path.replace("\\", "/") if os.name == "nt" else path
    here = repository.prefix
    folders = _folders(paths)
    candidates = [written] if written and not written.startswith(("./", "../")) else []
    for candidate in (*candidates, f"{here}{written}"):
        name = os.path.normpath(candidate or ".").replace(os.sep, "/")
        name = "" if name == "." else name
        if name in folders or name in paths:
            return name
    base = written.rpartition("/")[2]
    same = [name for name in paths if name.rpartition("/")[2] == base][:3]
    listed = " or ".join(f"'{name}'" for name in same)
    hint = f"did you mean {listed}?" if base and same else did_you_mean(written, paths)
    where = written or here.rstrip("/") or "."
    raise KbotError(f"{where} does not exist in the revision {revision}" + (f": {hint}" if hint else ""))


def _folders(paths: Sequence[str]) -> set[str]:
    """The folders that contain files."""
    folders = {""}
    for path in paths:
        folder = path.rpartition("/")[0]
        while folder not in folders:  # else those around it are known too
            folders.add(folder)
            folder = folder.rpartition("/")[0]
    return folders


def _relative(path: str, tree: str) -> str:
    relative = os.path.relpath(path, tree).replace(os.sep, "/")
    return "" if relative == "." else relative
