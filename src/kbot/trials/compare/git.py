"""Reads the files of a git revision, without running anything that a repository configures.

`git archive` and `git checkout` would run the smudge filters that attributes and configuration name, leave
out files with `export-ignore`, and change texts with `export-subst`. A repository that was downloaded as an
archive brings its own configuration, so such a filter is a stranger's program. Therefore this module only
asks for revisions, lists trees and reads blobs (`rev-parse`, `ls-tree`, `cat-file --batch`). These use
neither attributes nor hooks. The options and variables below turn off the rest: a file system monitor,
hooks, repositories that are hidden in folders, and fetching missing objects by a configured program.

A repository of a few megabytes can have an object of many gigabytes, which git holds in memory as a whole,
and a pipe in place of a file, for which git waits for ever. So git has a limit of memory and one of time.
"""

from __future__ import annotations

import os
import re
import threading
import time
from collections.abc import Generator, Iterable, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from subprocess import CompletedProcess
from tempfile import TemporaryFile
from typing import IO

from kbot.text import KbotError
from kbot.text.suggest import did_you_mean
from kbot.worker import children

_OPTIONS = (
    "--no-pager",
    "-c", "core.fsmonitor=false",
    "-c", f"core.hooksPath={os.devnull}",
    "-c", "safe.bareRepository=explicit",
    "-c", "protocol.allow=never",
    # git maps packs up to these sizes, by default all of a pack of gigabytes, which `_MEMORY` would forbid
    "-c", "core.packedGitLimit=256m",
    "-c", "core.packedGitWindowSize=32m",
)  # fmt: skip
_VARIABLES = {
    "GIT_NO_LAZY_FETCH": "1",
    "GIT_ALLOW_PROTOCOL": "",
    "GIT_OPTIONAL_LOCKS": "0",
    "GIT_TERMINAL_PROMPT": "0",
    "GIT_NO_REPLACE_OBJECTS": "1",
    "LC_ALL": "C",
}
_MOST_BYTES = 100_000_000
"""Size of the largest file that is extracted. Meshes and texts that KBot reads are smaller."""
_MOST_ALL = 4_000_000_000
"""Size of all extracted files."""
_OVER_ALL = f"more than {_MOST_ALL / 1e9:.0f} GB of files"
_MOST_ENTRIES = 200_000
"""Files and folders of a revision. A few kilobytes of a repository can list any number: folders are stored
once, and a folder may contain another one many times."""
_LONGEST = 4096
"""Bytes of a path, which is the limit of Linux."""
_MOST_LISTED = 100_000_000
"""Bytes of git's list of files. An entry of a real repository has a hundred or two."""
_MOST_NAMES = 10_000
"""Branches and tags among which a similar one is searched."""
_MEMORY = 900_000_000
"""Bytes of git's address space: its packs, a file of `_MOST_BYTES` with that from which it differs, and the
indexes of a repository as large as that of Linux."""
_OVER_MEMORY = "an object for which git needs more than 900 MB of memory"
_NO_MEMORY = re.compile(r"out of memory|cannot allocate memory", re.IGNORECASE)
"""How git names the end of its memory, from its own `xmalloc`, from zlib or from the system."""
_SECONDS = 60.0
"""How long git may print nothing. A fraction of a second is usual, and a slow network drive takes longer."""
_CHUNK = 1 << 16
_FILE, _LINK = ("100644", "100755", "100664"), "120000"
_NOT_ON_WINDOWS = re.compile(r'[<>:"|?*\\]')
_POINTER = b"version https://git-lfs.github.com/spec/v1\n"
_OBJECT = re.compile(rb"^oid sha256:([0-9a-f]{64})$", re.MULTILINE)


@dataclass(frozen=True)
class Repository:
    """A git repository. `top` is its folder, and `prefix` the path from there to the working directory, empty
    or with a slash at its end."""

    top: str
    prefix: str

    @classmethod
    def around(cls, folder: str) -> Repository:
        """The repository that contains a folder.

        Raises:
            KbotError: there is none, git refuses it, or git is not installed.
        """
        found = _git(folder, "rev-parse", "--show-toplevel")
        if found.returncode:
            reason = _reason(found.stderr)
            if "not a git repository" in reason:
                raise KbotError(f"{folder} is not in a git repository, so that it has no revisions")
            raise KbotError(f"git does not read the repository at {folder}: {reason}")
        top = os.path.realpath(os.fsdecode(found.stdout).removesuffix("\n"))
        inner = os.path.relpath(os.path.realpath(folder), top).replace(os.sep, "/")
        return cls(top, "" if inner == "." else f"{inner}/")

    def commit(self, revision: str) -> str:
        """The object name of a revision's commit.

        Raises:
            KbotError: there is no such revision.
        """
        if revision.startswith("-"):  # git would take it for an option
            raise KbotError(f"'{revision}' is not a git revision")
        found = _git(self.top, "rev-parse", "--verify", f"{revision}^{{commit}}")
        if found.returncode == 0:
            return found.stdout.decode().strip()
        listed = _git(
            self.top, "for-each-ref", f"--count={_MOST_NAMES}", "--format=%(refname:short)",
            "refs/heads", "refs/tags",
        )  # fmt: skip
        names = os.fsdecode(listed.stdout).split()
        hint = did_you_mean(revision, names)
        reason = _reason(found.stderr)
        reason = "" if "Needed a single revision" in reason else reason
        raise KbotError(f"there is no git revision '{revision}': {hint or reason or _known(names)}")

    def object(self, digest: str) -> Path:
        """Where Git LFS keeps the file with this SHA-256 digest."""
        return self._common / "lfs" / "objects" / digest[:2] / digest[2:4] / digest

    @cached_property
    def _common(self) -> Path:
        """The folder `.git` of the repository, also from one of its worktrees."""
        return Path(self.top, os.fsdecode(_git(self.top, "rev-parse", "--git-common-dir").stdout).strip())


def extract(repository: Repository, commit: str, folder: str) -> list[str]:
    """Write the files of a commit to a folder. Returns their paths from the top of the repository.

    Submodules have no files in a commit. Symbolic links out of the tree are left out, and so are names that
    would leave the folder.

    Raises:
        KbotError: the commit is too large, an object is missing, or the files cannot be written.
    """
    files, links = list[tuple[str, str]](), list[tuple[str, str]]()
    size = 0
    with closing(_entries(repository, commit)) as entries:
        for count, entry in enumerate(entries, 1):
            about, _, name = entry.partition(b"\t")
            mode, _, blob, length = about.decode().split()
            if len(name) > _LONGEST:
                raise _too_long()
            path = os.fsdecode(name)
            number = int(length) if length.isdigit() else 0  # `BAD` for a missing object, `-` for a folder
            if count > _MOST_ENTRIES:
                raise _too_large(f"more than {_MOST_ENTRIES:,} files and folders")
            if not _stays_inside(path) or number > _MOST_BYTES:
                continue
            size += number
            if size > _MOST_ALL:
                raise _too_large(_OVER_ALL)
            if mode in _FILE:
                files.append((path, blob))
            elif mode == _LINK:
                links.append((path, blob))
    try:
        _write(repository, folder, files, links)
    except OSError as error:
        raise KbotError(f"the revision cannot be extracted to {folder}: {error.strerror}") from None
    return [path for path, _ in (*files, *links)]


def _entries(repository: Repository, commit: str) -> Generator[bytes, None, None]:
    """The files and folders of a commit, as git lists them: `MODE TYPE NAME SIZE<tab>PATH`.

    Folders are listed too, because a repository can have any number of folders without a file.

    Raises:
        KbotError: git cannot read the commit, or it has too many or too long paths.
    """
    command = _command("ls-tree", "-r", "-t", "-z", "-l", "--full-tree", commit)
    rest, listed = b"", 0
    with _Stream(repository, command) as git:
        while chunk := git.read(_CHUNK):
            listed += len(chunk)
            *entries, rest = (rest + chunk).split(b"\0")
            yield from entries
            if len(rest) > 2 * _LONGEST:  # also without its end, which may be far
                raise _too_long()
            if listed > _MOST_LISTED:
                raise _too_large(f"a list of files of more than {_MOST_LISTED / 1e6:.0f} MB")
        git.require_success()


def _too_long() -> KbotError:
    return KbotError(f"the revision has paths of more than {_LONGEST:,} bytes, too long to compare")


def _too_large(what: str) -> KbotError:
    return KbotError(f"the revision is too large to compare: it has {what}. Compare two files instead")


def _write(
    repository: Repository, folder: str, files: Sequence[tuple[str, str]], links: Sequence[tuple[str, str]]
) -> None:
    with TemporaryFile() as names:
        names.write("".join(f"{blob}\n" for _, blob in (*files, *links)).encode())
        names.seek(0)
        with _Stream(repository, _command("cat-file", "--batch"), names) as git:
            size = 0
            for path, _ in files:
                data = _without_pointer(repository, _blob(git, path))
                size += len(data)
                if size > _MOST_ALL:  # many pointers may refer to one large file
                    raise _too_large(_OVER_ALL)
                target = Path(folder, path)
                target.parent.mkdir(parents=True, exist_ok=True)
                target.write_bytes(data)
            # links come last, so that no file is written through one
            made = [_link(Path(folder), path, os.fsdecode(_blob(git, path))) for path, _ in links]
            _remove_outward(Path(folder), filter(None, made))


def _blob(git: _Stream, path: str) -> bytes:
    """The next object in the output of `git cat-file --batch`."""
    words = git.readline().split()
    data = git.read(int(words[2])) if len(words) == 3 else b""
    if len(words) != 3 or len(data) != int(words[2]):
        git.require_limits()
        raise KbotError(
            f"git does not have the content of {path} in this revision: run git fetch, and then try again"
        )
    git.read(1)  # the line end after the object
    return data


def _link(folder: Path, path: str, goal: str) -> Path | None:
    """A symbolic link in the same tree. Windows may forbid links, and then it is left out.

    In a malicious tree, its folder may be a link that was just written.
    """
    place = folder / path
    if "\0" in goal:  # no system has such a link
        return None
    if Path(goal).is_absolute() or os.path.realpath(place.parent) != str(place.parent) or place.exists():
        return None
    place.parent.mkdir(parents=True, exist_ok=True)
    with suppress(OSError, NotImplementedError):
        place.symlink_to(goal)
    return place


def _remove_outward(folder: Path, links: Iterable[Path]) -> None:
    """Remove the links out of the tree. Where a link leads depends on the other ones, so all are there."""
    for link in [each for each in links if not Path(os.path.realpath(each)).is_relative_to(folder)]:
        link.unlink(missing_ok=True)


def _without_pointer(repository: Repository, data: bytes) -> bytes:
    """The file to which a pointer of Git LFS refers, if it was fetched."""
    found = _OBJECT.search(data) if data.startswith(_POINTER) else None
    if found is not None:
        file = repository.object(found[1].decode())
        with suppress(OSError):
            if file.is_file() and file.stat().st_size <= _MOST_BYTES:  # not a device, which has no end
                return file.read_bytes()
    return data


def _stays_inside(path: str) -> bool:
    """Whether a name in a tree is below the tree's folder. A damaged or malicious tree may have others."""
    parts = path.split("/")
    if any(part in ("", ".", "..") or part.lower() == ".git" for part in parts):
        return False
    return os.name != "nt" or not _NOT_ON_WINDOWS.search(path)


def _git(folder: str, *arguments: str) -> CompletedProcess[bytes]:
    try:
        done = children.run(
            _command(*arguments),
            environment=_environment(),
            folder=folder,
            seconds=_SECONDS,
            memory=_MEMORY,
        )
    except FileNotFoundError:
        raise KbotError("git is not installed: install it, or compare two files") from None
    except TimeoutError:
        raise _too_slow() from None
    if done.returncode and _NO_MEMORY.search(_reason(done.stderr)):
        raise _too_large(_OVER_MEMORY)
    return done


class _Stream:
    """A git whose output is read as a stream, until the end of a `with` block.

    It is killed when nothing can be read for `_SECONDS`. The time of a reader between two reads counts too,
    and is short.
    """

    def __init__(
        self, repository: Repository, command: Sequence[str], stdin: IO[bytes] | int = children.DEVNULL
    ) -> None:
        self._errors = TemporaryFile()  # noqa: SIM115 - __exit__ closes it
        self._process = children.start(
            command,
            environment=_environment(),
            folder=repository.top,
            stdin=stdin,
            stdout=children.PIPE,
            stderr=self._errors,
            memory=_MEMORY,
        )
        self._is_slow = False
        self._ended = threading.Event()
        self._heard = time.monotonic()
        threading.Thread(target=self._watch, daemon=True, name="kbot-git").start()

    def __enter__(self) -> _Stream:
        return self

    def __exit__(self, *error: object) -> None:
        self._ended.set()
        self._process.end()
        self._errors.close()

    def read(self, size: int) -> bytes:
        """Up to `size` bytes, fewer only at the end."""
        assert self._process.stdout is not None  # it is a pipe
        data = self._process.stdout.read(size)
        self._heard = time.monotonic()
        return data

    def readline(self) -> bytes:
        assert self._process.stdout is not None  # it is a pipe
        return self._process.stdout.readline()

    def require_success(self) -> None:
        """After the last output. Raises KbotError: git has failed."""
        status = self._process.wait()
        self.require_limits()
        if status:
            reason = self._reason() or f"it ended with status {status}"
            raise KbotError(f"git cannot read the revision: {reason}")

    def require_limits(self) -> None:
        """After the last output. Raises KbotError: git was ended by the limit of time or memory."""
        if self._is_slow:
            raise _too_slow()
        if _NO_MEMORY.search(self._reason()):
            raise _too_large(_OVER_MEMORY)

    def _reason(self) -> str:
        self._errors.seek(0)
        return _reason(self._errors.read(_CHUNK))

    def _watch(self) -> None:
        while (left := self._heard + _SECONDS - time.monotonic()) > 0:
            if self._ended.wait(left):
                return
        self._is_slow = True
        self._process.kill_all()


def _too_slow() -> KbotError:
    return KbotError(
        f"git has printed nothing for {_SECONDS:g} s. A file of the repository may be a pipe, or on a drive "
        "that does not answer. Compare two files instead"
    )


def _command(*arguments: str) -> list[str]:
    return ["git", *_OPTIONS, *arguments]


def _environment() -> dict[str, str]:
    return {**os.environ, **_VARIABLES}


def _reason(printed: bytes) -> str:
    """The first line of git's error, without the word in front of it."""
    first = printed.decode("utf-8", "replace").strip().split("\n")[0]
    return re.sub(r"^(fatal|error): ", "", first)


def _known(names: Sequence[str]) -> str:
    return f"the branches and tags are {', '.join(names[:6])}" if names else "the repository has no commits"
