"""Makes temporary folders, and removes them, also those of processes that were killed.

They are in one private folder of the user, so that finding the rest of killed processes is fast, and no other
user can plant anything there. While a process uses a folder, it holds a lock on a file beside it, which the
system releases when the process ends. Process IDs would not do: the system uses them again, and containers
that share a folder do not share them.
"""

from __future__ import annotations

import atexit
import errno
import os
import re
import stat
import sys
from contextlib import suppress
from pathlib import Path
from types import TracebackType

_LOCK = ".lock"
_NAME_OF_LOCK = re.compile(r"[a-z0-9-]+-\d+-\d+" + re.escape(_LOCK))
"""As `_new` makes them. Files of others, such as `uv.lock`, may lie beside them."""
_TEMPORARY = ("/tmp", "/var/tmp", "/usr/tmp")
"""The folders that `tempfile` tries on POSIX before the working directory."""
_ATTEMPTS = 100
"""Names to try. One may be of an earlier process with the same ID, or another KBot may hold its lock for a
moment, to see whether it is in use."""


class TemporaryFolder:
    """A new folder, which exists until `remove`, the end of a `with` block, or the end of the process.

    If the process is killed, the next KBot removes it.
    """

    def __init__(self, purpose: str) -> None:
        """`purpose` begins its name.

        Raises:
            OSError: the system's temporary folder is not writable, or KBot's folder there is of someone else.
        """
        place = private_folder(user_folder())
        if not _open:
            remove_left()
        self.path, self._lock = _new(place, purpose)
        self._owner = os.getpid()
        _open[self.path] = self
        atexit.unregister(remove_all)
        atexit.register(remove_all)

    def remove(self) -> None:
        if _open.pop(self.path, None) is not None and self._owner == os.getpid():  # not in a fork
            _remove(self.path, self._lock)

    def keep(self) -> None:
        """Leave the folder to the user, who removes it."""
        if _open.pop(self.path, None) is not None:
            _unlock(self.path, self._lock)

    def __enter__(self) -> Path:
        return self.path

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.remove()


def remove_all() -> None:
    """Remove the folders of this process, and those of others that have been killed, such as its workers."""
    for folder in list(_open.values()):
        folder.remove()
    remove_left()


def remove_left() -> None:
    """Remove the folders of processes that no longer run."""
    try:
        place = user_folder()
        left = [Path(entry.path) for entry in os.scandir(place) if _NAME_OF_LOCK.fullmatch(entry.name)]
        private_folder(place)
    except OSError:  # there is none, or it is of someone else
        return
    for file in left:
        with suppress(OSError):  # it is in use
            _remove(file.with_suffix(""), _locked(file, os.O_RDWR))


def private_folder(path: Path) -> Path:
    """Create a folder that only this user can use, if it does not exist.

    Raises:
        OSError: it is a link or a file, or belongs to another user, who could replace what is in it.
    """
    reason = "is a link, is a file, or belongs to another user. Remove it, or set TMPDIR to another folder"
    try:
        path.mkdir(mode=0o700, parents=True, exist_ok=True)
    except FileExistsError:  # also a link to nothing
        raise PermissionError(errno.EPERM, reason, str(path)) from None
    if hasattr(os, "getuid"):  # on Windows, the folder above is the user's own
        found = path.lstat()
        if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid():
            raise PermissionError(errno.EPERM, reason, str(path))
        if found.st_mode & 0o077:
            path.chmod(0o700)
    return path


def user_folder() -> Path:
    """The folder in the system's temporary folder that is for this user. It may not exist.

    Raises:
        OSError: no temporary folder is writable. Python would use the working directory, which is the user's.
    """
    import tempfile  # slow to import

    reason = "no temporary folder can be written. Set TMPDIR"
    try:
        place = tempfile.gettempdir()
    except FileNotFoundError:  # the working directory is not writable either
        raise FileNotFoundError(errno.ENOENT, reason) from None
    if _is_left_over(place):
        raise FileNotFoundError(errno.ENOENT, reason, place)
    return Path(place, f"kbot-{os.getuid() if hasattr(os, 'getuid') else 0}")


def _is_left_over(place: str) -> bool:
    """Whether a folder is the working directory, which `tempfile` takes if it can write to no other one."""
    if os.name == "nt" or place in _TEMPORARY:  # on Windows, TEMP is always set
        return False
    given = [os.environ.get(name) for name in ("TMPDIR", "TEMP", "TMP")]
    try:
        here = Path.cwd()
    except OSError:  # someone has deleted it
        return False
    return Path(place) == here and here not in [here / each for each in given if each]


def _new(place: Path, purpose: str) -> tuple[Path, int]:
    """A new folder, and the descriptor of its lock."""
    for number in range(_ATTEMPTS):
        folder = place / f"{purpose}-{os.getpid()}-{number}"
        with suppress(FileExistsError, FileNotFoundError, BlockingIOError):
            lock = _locked(_lock_of(folder), os.O_RDWR | os.O_CREAT | os.O_EXCL)
            try:
                folder.mkdir(mode=0o700)
            except OSError:
                _unlock(folder, lock)
                raise
            return folder, lock
    raise FileExistsError(errno.EEXIST, "has no name for a new folder", str(place))


def _lock_of(folder: Path) -> Path:
    return folder.with_name(folder.name + _LOCK)


def _locked(file: Path, flags: int) -> int:
    """Open and lock a file. Raises OSError: another process has the lock, or has removed the file."""
    descriptor = os.open(file, flags | getattr(os, "O_NOFOLLOW", 0), 0o600)
    try:
        _lock(descriptor)
        if not os.path.samestat(os.fstat(descriptor), file.stat()):
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(file))
    except OSError:
        os.close(descriptor)
        raise
    return descriptor


def _remove(folder: Path, lock: int) -> None:
    import shutil  # slow to import

    shutil.rmtree(folder, ignore_errors=True)  # it removes links, and does not follow them
    if folder.exists():
        os.close(lock)  # the next KBot tries again
    else:
        _unlock(folder, lock)


def _unlock(folder: Path, lock: int) -> None:
    """Remove the lock, but not the folder."""
    if sys.platform == "win32":  # which does not remove an open file
        os.close(lock)
    with suppress(OSError):
        _lock_of(folder).unlink()
    if sys.platform != "win32":  # last, so that no other KBot takes the folder for that of a dead process
        os.close(lock)


if sys.platform == "win32":
    import msvcrt

    def _lock(descriptor: int) -> None:
        """Raises BlockingIOError: another process has the lock."""
        try:
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        except PermissionError as error:  # EACCES, where POSIX has EAGAIN
            raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN)) from error
else:
    import fcntl

    def _lock(descriptor: int) -> None:
        """Raises BlockingIOError: another process has the lock."""
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


_open: dict[Path, TemporaryFolder] = {}
