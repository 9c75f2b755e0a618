"""Reads source files with clear errors, and writes a file completely or not at all."""

from __future__ import annotations

import codecs
import errno
import os
import re
import stat
from collections.abc import Iterator, Mapping
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
_BEGINNINGS = ((b"<\0", "utf-16-le"), (b"\0<", "utf-16-be"))


class BadEncoding(Exception):
    """Bytes that are no text in their encoding, or an encoding that XML cannot be in; says why."""


def decode(data: bytes) -> str:
    """Text by its byte order mark, else by the encoding its XML declaration names, else UTF-8.

    As expat has it: UTF-8, UTF-16, US-ASCII, and every encoding of one byte a character.

    Raises:
        BadEncoding: the bytes are not of that encoding, or there is no such encoding.
    """
    mark, marked = _marked(data)
    declared = None
    if marked is None and data.startswith(b"<?xml"):
        declared = declared_encoding(data[:256].decode("latin-1"))
        if declared is not None and (not _is_of_bytes(declared)):
            raise BadEncoding(f"declares the encoding {declared}, which it cannot be in")
    name = marked or declared or "utf-8"
    try:
        return data[len(mark) :].decode(name)
    except UnicodeDecodeError as error:
        kind = {"utf-16-le": "UTF-16", "utf-16-be": "UTF-16"}.get(name, name.upper())
        at = len(mark) + error.start
        raise BadEncoding(f"is not {kind} text: byte 0x{data[at]:02x} at offset {at}") from None


def _marked(data: bytes) -> tuple[bytes, str | None]:
    """The byte order mark, and the encoding that it or the first character's bytes tell."""
    for mark, name in _MARKS:
        if data.startswith(mark):
            return mark, name
    return b"", next((name for beginning, name in _BEGINNINGS if data.startswith(beginning)), None)


def encode(text: str, was: bytes = b"") -> bytes:
    """Text in the encoding that its XML declaration names, else UTF-8; but with the byte order mark and
    in the UTF-16 of the file that it takes the place of. What the encoding lacks becomes a character
    reference."""
    mark, marked = _marked(was)
    if marked is not None:
        return mark + text.encode(marked)
    declared = declared_encoding(text[:256])
    if declared is None or not (_is_of_bytes(declared) or _canonical(declared) == "utf-16"):
        return text.encode("utf-8")
    return text.encode(declared, "xmlcharrefreplace")


def declared_encoding(text: str) -> str | None:
    """The encoding that an XML declaration at the text's beginning names."""
    match = _DECLARED.match(text)
    return match[1] if match else None


def _is_of_bytes(name: str) -> bool:
    """Whether it is UTF-8, or of one byte a character: what text without a byte order mark may be in."""
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

_STDIN = re.compile(r"/dev/stdin|(/dev|/proc/self)/fd/\d+", re.ASCII)
_DRIVE = re.compile(r"/[A-Za-z]:[/\\]")
_AT_ONCE = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0) | getattr(os, "O_NOCTTY", 0)

_MOST_FOLDERS = 1000
"""Folders that are searched for a missing file, which takes 20 to 200 ms: a home folder has far more."""

_unsaved: ContextVar[Mapping[str, str]] = ContextVar("unsaved texts by real path", default={})  # noqa: B039 - nobody writes into it


@contextmanager
def unsaved(texts: Mapping[str, str]) -> Iterator[None]:
    """Within it, `read_source` gives these texts in place of the files of these paths."""
    token = _unsaved.set({**_unsaved.get(), **{os.path.realpath(p): text for p, text in texts.items()}})
    try:
        yield
    finally:
        _unsaved.reset(token)


def _unreadable(path: str, code: str, message: str, hint: str = "") -> DescriptionError:
    from kbot.text.diagnostic import Diagnostic, Severity  # only for an error: start-up time

    origin = Origin(Span(Source(path, ""), 0, 0)) if path else None
    return DescriptionError([Diagnostic(code, Severity.ERROR, message, origin, hint)])


def read_source(
    path: str | os.PathLike[str], max_bytes: int = MAX_BYTES, *, from_pipe: bool = True
) -> Source:
    """Read a text file: UTF-8, or what its byte order mark or XML declaration says.

    Symbolic links are not resolved in the path it is known by. Devices and pipes are refused, which may
    never end; `from_pipe`, `/dev/stdin` and `/dev/fd/N` may be a pipe that a shell has made.

    Raises:
        DescriptionError: F001 missing, F002 a directory, F003 not readable or not a regular file,
            F004 too large, F005 not text in its encoding.
    """
    name = os.fspath(path)
    if not name:
        raise _unreadable(name, "F001", "a file name is empty")
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
        raise _unreadable(name, "F002", f"{name} is a directory, not a file", _within(name)) from None
    except (OSError, ValueError) as error:
        if getattr(error, "errno", None) == errno.EFBIG:
            raise _unreadable(name, "F004", f"{name} is larger than {max_bytes} bytes") from None
        reason = getattr(error, "strerror", None) or str(error)
        raise _unreadable(name, "F003", f"{name} cannot be read: {reason}") from None
    try:
        return Source(name, decode(data))
    except BadEncoding as error:
        raise _unreadable(name, "F005", f"{name} {error}") from None


def read_bytes(path: str | os.PathLike[str], max_bytes: int = MAX_BYTES, *, from_pipe: bool = True) -> bytes:
    """Read a file that may be anything. Never waits for a device or a pipe that does not end.

    Raises:
        OSError: it is missing, a directory, a device, a pipe or a socket, not readable, or too large.
        ValueError: its name holds a null character.
    """
    name = os.fspath(path)
    status = os.stat(name)
    is_pipe = from_pipe and stat.S_ISFIFO(status.st_mode) and _STDIN.fullmatch(name) is not None
    if not is_pipe:
        check_regular(name, status)
        if status.st_size > max_bytes:
            raise _too_large(name, max_bytes)
    descriptor = os.open(name, os.O_RDONLY | _AT_ONCE)
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
    return b"".join(parts)


def _too_large(name: str, max_bytes: int) -> OSError:
    return OSError(errno.EFBIG, f"it is larger than {max_bytes} bytes", name)


def read_text(path: str | os.PathLike[str]) -> str:
    """Read a file of settings: text in UTF-8, within the bounds of `read_bytes`.

    Raises:
        KbotError: it cannot be read, or is not text in UTF-8.
    """
    try:
        return read_bytes(path).decode("utf-8")
    except UnicodeDecodeError as error:
        raise KbotError(f"{path} is not text in UTF-8: {error.reason} at byte {error.start}") from None
    except (OSError, ValueError) as error:
        raise KbotError(f"{path} cannot be read: {getattr(error, 'strerror', None) or error}") from None


def check_regular(path: str | os.PathLike[str], status: os.stat_result | None = None) -> None:
    """Make sure that a path names a regular file, which reading comes to the end of.

    Raises:
        OSError: it is missing, a directory, a device, a pipe or a socket.
    """
    mode = (status or os.stat(path)).st_mode
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, "it is a directory, not a file", os.fspath(path))
    if not stat.S_ISREG(mode):
        raise OSError(errno.EINVAL, "it is not a regular file", os.fspath(path))


def _missing(name: str, search: bool) -> tuple[str, str]:
    """The message and hint for a missing file. An included file is not searched for (`search`): a description
    may include hundreds of missing files, and each search takes time."""
    folder, last = os.path.split(name)
    siblings: list[str] = []
    with suppress(OSError):  # what is in /proc may disappear meanwhile, and some of its links name nothing
        if os.path.islink(name):
            return f"{name} is a symbolic link to {os.readlink(name)}, which does not exist", ""
        siblings = os.listdir(folder or ".")
    hint = str(did_you_mean(last, siblings))
    if search and last and not folder and not hint:
        found = _beneath(last)
        hint = f"there is {found[0]}" if len(found) == 1 else ""
    return f"{name} does not exist", hint


def _beneath(name: str) -> list[str]:
    """Up to two files of a name beneath the working directory: a command is often typed in the wrong folder.
    The nearest folders come first, hidden ones and links are skipped."""
    folders, found = [""], list[str]()
    for folder in folders:  # grows in the loop
        try:
            with os.scandir(folder or ".") as entries:
                for entry in entries:
                    if entry.name == name and entry.is_file():
                        found.append(os.path.join(folder, name))
                    elif (
                        len(folders) < _MOST_FOLDERS
                        and not entry.name.startswith(".")
                        and entry.is_dir(follow_symlinks=False)
                    ):
                        folders.append(os.path.join(folder, entry.name))
        except OSError:  # not readable, or gone meanwhile
            continue
        if len(found) > 1:
            break
    return found


def _within(folder: str) -> str:
    """The hint for a package that stands where its description is expected."""
    urdf = os.path.join(folder, "urdf")
    try:
        names = sorted(n for n in os.listdir(urdf) if n.endswith((".xacro", ".urdf")))
    except OSError:
        return ""
    return "name a file in it: " + ", ".join(os.path.join(urdf, n) for n in names[:8]) if names else ""


def from_file_uri(rest: str, *, windows: bool = os.name == "nt") -> str:
    """The path of a `file://` address, whose scheme is gone: on Windows `/C:/robot.stl` is `C:/robot.stl`."""
    return rest[1:] if windows and _DRIVE.match(rest) else rest


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write text as `write_bytes` does, and raise as it does: XML in the encoding it declares, else UTF-8."""
    write_bytes(path, encode(text))


def write_bytes(path: str | os.PathLike[str], data: bytes) -> None:
    """Write a file beside its target and rename it into place, so that nobody sees half of it.

    Raises:
        KbotError: the folder is missing or not writable.
    """
    from pathlib import Path  # it costs more to import than all of this package

    if not os.fspath(path):
        raise KbotError("the name of a file to write is empty")
    try:
        if Path(path).exists() and not Path(path).is_file():
            Path(path).write_bytes(data)  # a device or a pipe, as /dev/stdout: nothing to replace
            return
        with ExitStack() as scratches:
            os.replace(_beside(path, data, scratches), os.path.realpath(path))  # a link stays a link
    except OSError as error:
        raise KbotError(f"{path} cannot be written: {error.strerror}") from None


def rewrite(texts: Mapping[str, tuple[str, str]]) -> None:
    """Put texts in the place of others, by path that before and that after: in all of the files or in none.

    Each file keeps its encoding and byte order mark.

    Raises:
        KbotError: a file holds another text than that before, or cannot be written; then none is.
    """
    path, others = "", ", and nothing else was" if len(texts) > 1 else ""
    try:
        with ExitStack() as scratches:
            ready: list[tuple[str, bytes, str]] = []
            for path, (before, after) in texts.items():
                check_regular(path)
                was = read_bytes(path)
                if not _holds(was, before):
                    raise _changed(path)
                if not os.access(path, os.W_OK):
                    raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
                ready.append((path, was, _beside(path, encode(after, was), scratches)))
            for path, was, _ in ready:
                if read_bytes(path) != was:
                    raise _changed(path)
            others = ""
            for path, _, scratch in ready:
                os.replace(scratch, os.path.realpath(path))
    except OSError as error:
        raise KbotError(f"{path} cannot be written{others}: {error.strerror}") from None


def _holds(data: bytes, text: str) -> bool:
    try:
        return decode(data) == text
    except BadEncoding:
        return False


def _changed(path: str) -> KbotError:
    return KbotError(f"{path} changed meanwhile: nothing was written, try again")


def _beside(path: str | os.PathLike[str], data: bytes, scratches: ExitStack) -> str:
    """The data in a file beside a path's, with its mode; it goes with `scratches` unless it was moved."""
    import tempfile  # slow to import; most runs write no file

    folder, name = os.path.split(os.path.realpath(path))
    descriptor, scratch = tempfile.mkstemp(prefix=f".{name}.", dir=folder)
    scratches.callback(_remove, scratch)
    with os.fdopen(descriptor, "wb") as stream:
        stream.write(data)
    os.chmod(scratch, os.stat(path).st_mode & 0o777 if os.path.exists(path) else 0o666 & ~_umask())
    return scratch


def _remove(path: str) -> None:
    with suppress(FileNotFoundError):
        os.unlink(path)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
