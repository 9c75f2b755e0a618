"""Reads source files with clear errors, and writes a file completely or not at all."""

from __future__ import annotations

import codecs
import errno
import os
import re
import stat
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from contextvars import ContextVar

from kbot.text.errors import DescriptionError, KbotError
from kbot.text.span import Origin, Source, Span
from kbot.text.suggest import did_you_mean

_DECLARED = re.compile(r"""<\?xml\s[^>]*?\bencoding\s*=\s*["']([A-Za-z][\w.\-]*)["']""", re.ASCII)
_MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)
_SCRATCH = ".kbot-scratch"
SCRATCH_SECONDS = 60.0
"""Age from which a scratch file is left over. Writing the largest description takes a second."""
_LFS_POINTER = b"version https://git-lfs.github.com/spec/v1\n"
_BEGINNINGS = ((b"<\0", "utf-16-le"), (b"\0<", "utf-16-be"))


class BadEncoding(Exception):
    """The bytes are not text in their encoding, or XML cannot use it. The message has the reason."""


def decode(data: bytes) -> str:
    """Decode text by its byte order mark, or else by its XML declaration, or else as UTF-8.

    Like expat, it accepts UTF-8, UTF-16, US-ASCII, and every encoding with one byte per character.

    Raises:
        BadEncoding: the bytes are not valid in the encoding, or there is no such encoding.
    """
    mark, marked = _byte_order_mark(data)
    declared = None
    if marked is None and data.startswith(b"<?xml"):
        declared = declared_encoding(data[:256].decode("latin-1"))
        if declared is not None and (not _is_bytewise(declared)):
            raise BadEncoding(f"declares the encoding {declared}, which is unknown or not that of the file")
    name = marked or declared or "utf-8"
    try:
        return data[len(mark) :].decode(name)
    except UnicodeDecodeError as error:
        kind = {"utf-16-le": "UTF-16", "utf-16-be": "UTF-16"}.get(name, name.upper())
        at = len(mark) + error.start
        line = data[len(mark) : at].decode(name).count("\n") + 1
        raise BadEncoding(
            f"is not {kind} text: byte 0x{data[at]:02x} in line {line}, at offset {at}"
        ) from None


def _byte_order_mark(data: bytes) -> tuple[bytes, str | None]:
    """The byte order mark, and the encoding that the mark or the first bytes imply."""
    for mark, name in _MARKS:
        if data.startswith(mark):
            return mark, name
    return b"", next((name for beginning, name in _BEGINNINGS if data.startswith(beginning)), None)


def encode(text: str, old: bytes = b"") -> bytes:
    """Encode text as its XML declaration requires, or else as UTF-8.

    If `old`, the previous content of the file, has a byte order mark or is UTF-16, the new content is encoded
    the same way. Characters that the encoding does not have become character references.
    """
    mark, marked = _byte_order_mark(old)
    if marked is not None:
        return mark + text.encode(marked)
    declared = declared_encoding(text[:256])
    if declared is None or not (_is_bytewise(declared) or _canonical(declared) == "utf-16"):
        return text.encode("utf-8")
    return text.encode(declared, "xmlcharrefreplace")


def declared_encoding(text: str) -> str | None:
    """The encoding in the XML declaration at the start of a text."""
    match = _DECLARED.match(text)
    return match[1] if match else None


def _is_bytewise(name: str) -> bool:
    """Whether the encoding is UTF-8 or has one byte per character, as text without a byte order mark can."""
    canonical = _canonical(name)
    if canonical in ("utf-8", "ascii"):
        return True
    try:
        return len(bytes(range(256)).decode(canonical, "replace")) == 256
    except (LookupError, UnicodeError):
        return False


def _canonical(name: str) -> str:
    try:
        return codecs.lookup(name).name
    except LookupError:
        return ""


MAX_BYTES = 32 * 1024 * 1024
"""Size of the largest text file that is read."""

_GZIP = b"\x1f\x8b"
"""The first bytes of a file that is compressed with gzip (RFC 1952)."""

_STDIN = re.compile(r"/dev/stdin|(/dev|/proc/self)/fd/\d+", re.ASCII)
_DRIVE = re.compile(r"/[A-Za-z]:[/\\]")
_NONBLOCKING = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0) | getattr(os, "O_NOCTTY", 0)

_MOST_FOLDERS = 1000
"""Folders that are searched for a missing file, in 20 to 200 ms. A home folder has far more folders."""

_unsaved: ContextVar[Mapping[str, str]] = ContextVar("unsaved texts by real path", default={})  # noqa: B039 - never modified


@contextmanager
def unsaved(texts: Mapping[str, str]) -> Iterator[None]:
    """A block in which `read_source` returns these texts instead of the files at these paths."""
    token = _unsaved.set({**_unsaved.get(), **{os.path.realpath(p): text for p, text in texts.items()}})
    try:
        yield
    finally:
        _unsaved.reset(token)


def unsaved_files() -> tuple[str, ...]:
    """The real paths of the files whose texts `unsaved` gives to the caller."""
    return tuple(_unsaved.get())


_allowed: ContextVar[tuple[Callable[[str], bool], str] | None] = ContextVar("`reading_only`", default=None)


@contextmanager
def reading_only(may_read: Callable[[str], bool], why: str) -> Iterator[None]:
    """A block in which other files are refused, because a stranger wrote what names them.

    `why` is the reason in the error: `it is …`.
    """
    token = _allowed.set((may_read, why))
    try:
        yield
    finally:
        _allowed.reset(token)


@contextmanager
def files_read() -> Iterator[dict[str, None]]:
    """A block that records the names of the files that `read_bytes` is asked for, in order."""
    names: dict[str, None] = {}

    def record(name: str) -> bool:
        names[name] = None
        return True

    with reading_only(record, ""):
        yield names


def is_allowed(path: str) -> bool:
    """Whether the block of `reading_only` around the caller, if there is one, allows a file."""
    return not _why_refused(path)


def _why_refused(path: str) -> str:
    """Why the block of `reading_only` around the caller refuses a file. Empty if it does not."""
    allowed = _allowed.get()
    if allowed is None:
        return ""
    may_read, why = allowed
    token = _allowed.set(None)  # it may read a package.xml to find out
    try:
        return "" if may_read(path) else why
    finally:
        _allowed.reset(token)


def _unreadable(path: str, code: str, message: str, hint: str = "") -> DescriptionError:
    from kbot.text.diagnostic import Diagnostic, Severity  # only for an error: start-up time

    origin = Origin(Span(Source(path, ""), 0, 0)) if path else None
    return DescriptionError([Diagnostic(code, Severity.ERROR, message, origin, hint)])


def read_source(
    path: str | os.PathLike[str], max_bytes: int = MAX_BYTES, *, from_pipe: bool = True
) -> Source:
    """Read a text file: UTF-8, or the encoding of its byte order mark or XML declaration.

    Symbolic links in the source's path are not resolved. Devices and pipes are rejected, because they may
    never end. With `from_pipe`, `/dev/stdin` and `/dev/fd/N` may be a pipe that a shell created.

    Raises:
        DescriptionError: F001 missing, F002 a directory, F003 not readable or not a regular file,
            F004 too large, F005 not text in its encoding.
    """
    name = os.fspath(path)
    if not name:
        raise _unreadable(name, "F001", "the file name is empty")
    texts = _unsaved.get()
    if texts and (text := texts.get(os.path.realpath(name))) is not None:
        return Source(name, text)
    try:
        data = read_bytes(name, max_bytes, from_pipe=from_pipe)
    except FileNotFoundError:
        from kbot.text.installed import find_file  # cycle: it imports this module

        found = find_file(name)
        if found is not None and not os.path.isdir(found):
            return read_source(found, max_bytes, from_pipe=from_pipe)
        raise _unreadable(name, "F001", *_missing(name, search=from_pipe)) from None
    except IsADirectoryError:
        raise _unreadable(name, "F002", f"{name} is a directory, not a file", _package_hint(name)) from None
    except (OSError, ValueError) as error:
        if getattr(error, "errno", None) == errno.EFBIG:
            raise _unreadable(name, "F004", f"{name} is larger than {max_bytes} bytes") from None
        reason = getattr(error, "strerror", None) or str(error)
        raise _unreadable(name, "F003", f"{name} cannot be read: {reason}") from None
    if data.startswith(_GZIP):
        raise _unreadable(name, "F005", f"{name} is compressed with gzip. Decompress it first: gunzip {name}")
    try:
        return Source(name, decode(data))
    except BadEncoding as error:
        raise _unreadable(name, "F005", f"{name} {error}") from None


def read_bytes(path: str | os.PathLike[str], max_bytes: int = MAX_BYTES, *, from_pipe: bool = True) -> bytes:
    """Read a file of any kind. Never waits for a device or for a pipe that does not end.

    Raises:
        OSError: the file is missing, a directory, a device, a pipe, a socket, unreadable, too large, or only
            the pointer that Git LFS stores in place of a large file. Or `reading_only` refuses it.
        ValueError: the name contains a null character.
    """
    name = os.fspath(path)
    if why := _why_refused(name):
        raise PermissionError(errno.EACCES, why, name)
    status = os.stat(name)
    is_pipe = from_pipe and stat.S_ISFIFO(status.st_mode) and _STDIN.fullmatch(name) is not None
    if not is_pipe:
        check_regular(name, status)
        if status.st_size > max_bytes:
            raise _too_large(name, max_bytes)
    descriptor = os.open(name, os.O_RDONLY | _NONBLOCKING)
    try:
        if is_pipe:
            os.set_blocking(descriptor, True)
        parts = [os.read(descriptor, min(status.st_size, max_bytes) + 1)]
        size = len(parts[0])
        while size <= max_bytes and (more := os.read(descriptor, 1 << 16)):
            parts.append(more)
            size += len(more)
    finally:
        os.close(descriptor)
    if size > max_bytes:
        raise _too_large(name, max_bytes)
    data = b"".join(parts)
    if data.startswith(_LFS_POINTER):
        raise _lfs_pointer(name)
    return data


def refuse_lfs_pointer(path: str | os.PathLike[str]) -> None:
    """Check the first bytes of a file that is not read as a whole.

    Raises:
        OSError: it is the pointer that Git LFS stores in place of a large file.
    """
    with open(path, "rb") as file:
        if file.read(len(_LFS_POINTER)) == _LFS_POINTER:
            raise _lfs_pointer(os.fspath(path))


def _lfs_pointer(name: str) -> OSError:
    return OSError(
        errno.ENODATA, "it is only a pointer of Git LFS: `git lfs pull` fetches the file itself", name
    )


def _too_large(name: str, max_bytes: int) -> OSError:
    return OSError(errno.EFBIG, f"it is larger than {max_bytes} bytes", name)


def read_text(path: str | os.PathLike[str]) -> str:
    """Read a settings file in UTF-8, within the limits of `read_bytes`.

    Raises:
        KbotError: the file cannot be read, or is not UTF-8.
    """
    try:
        return read_bytes(path).decode("utf-8")
    except UnicodeDecodeError as error:
        raise KbotError(f"{path} is not text in UTF-8: {error.reason} at byte {error.start}") from None
    except (OSError, ValueError) as error:
        raise KbotError(f"{path} cannot be read: {getattr(error, 'strerror', None) or error}") from None


def check_regular(path: str | os.PathLike[str], status: os.stat_result | None = None) -> None:
    """Check that a path is a regular file. Reading other files may never end.

    Raises:
        OSError: the file is missing, a directory, a device, a pipe or a socket.
    """
    mode = (status or os.stat(path)).st_mode
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, "it is a directory, not a file", os.fspath(path))
    if not stat.S_ISREG(mode):
        raise OSError(errno.EINVAL, "it is not a regular file", os.fspath(path))


def _missing(name: str, search: bool) -> tuple[str, str]:
    """The message and hint for a missing file.

    Without `search`, subfolders are not searched. A description may include hundreds of missing files, and
    each search takes time.
    """
    folder, last = os.path.split(name)
    with suppress(OSError):  # files in /proc may disappear, and some of its links have no target
        if os.path.islink(name):
            return f"{name} is a symbolic link to {os.readlink(name)}, which does not exist", ""
    from kbot.text.folders import names_in  # rarely needed: start-up time

    hint = str(did_you_mean(last, names_in(folder)))
    if search and last and not folder and not hint:
        found = _find_below(last)
        hint = f"did you mean {found[0]}?" if len(found) == 1 else ""
    return f"{name} does not exist", hint


def _find_below(name: str) -> list[str]:
    """Up to two files with this name below the working directory.

    Users often type a command in the wrong folder. The nearest folders are searched first. Hidden folders and
    links are skipped.
    """
    folders, found = [""], list[str]()
    for folder in folders:  # grows in the loop
        try:
            with os.scandir(folder or ".") as entries:
                for entry in entries:
                    if entry.name == name and os.path.isfile(entry.path):  # no error for a link to itself
                        found.append(os.path.join(folder, name))
                    elif (
                        len(folders) < _MOST_FOLDERS
                        and not entry.name.startswith(".")
                        and entry.is_dir(follow_symlinks=False)
                    ):
                        folders.append(os.path.join(folder, entry.name))
        except OSError:  # not readable, or deleted in the meantime
            continue
        if len(found) > 1:
            break
    return found


def _package_hint(folder: str) -> str:
    """The hint for a package folder that was given instead of a description."""
    urdf = os.path.join(folder, "urdf")
    try:
        names = sorted(n for n in os.listdir(urdf) if n.endswith((".xacro", ".urdf")))
    except OSError:
        return ""
    return "choose a file in it: " + ", ".join(os.path.join(urdf, n) for n in names[:8]) if names else ""


def from_file_uri(rest: str, *, windows: bool = os.name == "nt") -> str:
    """The path in a `file://` URI without its scheme. On Windows, `/C:/robot.stl` becomes `C:/robot.stl`."""
    return rest[1:] if windows and _DRIVE.match(rest) else rest


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write text, like `write_bytes`. XML is encoded as it declares, other text as UTF-8.

    The bytes of file names that are not UTF-8 become escapes (`\\udcff`), as on stdout. In JSON, these are
    the escapes of the same characters.
    """
    write_bytes(path, encode(text.encode("utf-8", "backslashreplace").decode("utf-8")))


def write_bytes(path: str | os.PathLike[str], data: bytes) -> None:
    """Write a file next to its target and rename it, so that readers never see an incomplete file.

    Raises:
        KbotError: the folder is missing or not writable.
    """
    from pathlib import Path  # slower to import than this whole package

    if not os.fspath(path):
        raise KbotError("the name of the output file is empty")
    try:
        if Path(path).exists() and not Path(path).is_file():
            Path(path).write_bytes(data)  # a device or a pipe, such as /dev/stdout, cannot be replaced
            return
        with ExitStack() as scratches:
            os.replace(_write_scratch(path, data, scratches), os.path.realpath(path))  # a link stays a link
    except OSError as error:
        raise KbotError(f"{path} cannot be written: {error.strerror}") from None


def rewrite(texts: Mapping[str, tuple[str, str]]) -> None:
    """Replace the texts of files: of all of them or of none. `texts` has the old and new text for each path.

    Each file keeps its encoding and byte order mark.

    Raises:
        KbotError: a file does not contain its old text, or cannot be written, or a new text is not Unicode.
            Then no file is changed.
    """
    path, others = "", " (no file was changed)" if len(texts) > 1 else ""
    try:
        with ExitStack() as scratches:
            ready: list[tuple[str, bytes, str]] = []
            for path, (before, after) in texts.items():
                check_regular(path)
                old = read_bytes(path)
                if not _contains(old, before):
                    raise _changed(path)
                if not os.access(path, os.W_OK):
                    raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
                ready.append((path, old, _write_scratch(path, encode(after, old), scratches)))
            for path, old, _ in ready:
                if read_bytes(path) != old:
                    raise _changed(path)
            others = ""
            for path, _, scratch in ready:
                os.replace(scratch, os.path.realpath(path))
    except OSError as error:
        raise KbotError(f"{path} cannot be written{others}: {error.strerror}") from None
    except UnicodeEncodeError:  # of the name of a file, which no XML or YAML can have
        raise KbotError(
            f"{path} cannot be written{others}: the new text has bytes that are not UTF-8"
        ) from None


def _contains(data: bytes, text: str) -> bool:
    try:
        return decode(data) == text
    except BadEncoding:
        return False


def _changed(path: str) -> KbotError:
    return KbotError(f"{path} has changed in the meantime. Nothing was written. Try again")


def _write_scratch(path: str | os.PathLike[str], data: bytes, scratches: ExitStack) -> str:
    """Write the data to a file next to `path`, with its mode. `scratches` deletes it if it is not renamed."""
    import tempfile  # slow to import; most runs write no file

    folder, name = os.path.split(os.path.realpath(path))
    _remove_left_scratches(folder, name)
    descriptor, scratch = tempfile.mkstemp(prefix=f".{name}.", suffix=_SCRATCH, dir=folder)
    scratches.callback(_remove, scratch)
    with os.fdopen(descriptor, "wb") as stream:
        stream.write(data)
    os.chmod(scratch, os.stat(path).st_mode & 0o777 if os.path.exists(path) else 0o666 & ~_umask())
    return scratch


@contextmanager
def scratch_folder(path: str | os.PathLike[str]) -> Iterator[str]:
    """A path of the same name in a new folder next to `path`, for output that is renamed when it is complete.

    Raises:
        OSError: the folder is missing or not writable.
    """
    import shutil  # slow to import, like tempfile
    import tempfile

    folder, name = os.path.split(os.path.realpath(path))
    _remove_left_scratches(folder, name)
    scratch = tempfile.mkdtemp(prefix=f".{name}.", suffix=_SCRATCH, dir=folder)
    try:
        yield os.path.join(scratch, name)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def _remove_left_scratches(folder: str, name: str) -> None:
    """Remove the scratch files and folders that killed runs left. Newer ones may be of a run that writes
    now."""
    import shutil

    for entry in os.scandir(folder):
        if entry.name.startswith(f".{name}.") and entry.name.endswith(_SCRATCH):
            with suppress(OSError):
                if time.time() - _last_change(entry) > SCRATCH_SECONDS:
                    if entry.is_dir(follow_symlinks=False):
                        shutil.rmtree(entry.path, ignore_errors=True)
                    else:
                        os.unlink(entry.path)


def _last_change(entry: os.DirEntry[str]) -> float:
    times = [entry.stat(follow_symlinks=False).st_mtime]
    if entry.is_dir(follow_symlinks=False):
        times += [_last_change(part) for part in os.scandir(entry.path)]
    return max(times)


def _remove(path: str) -> None:
    with suppress(FileNotFoundError):
        os.unlink(path)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
