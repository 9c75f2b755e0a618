"""Reading a source with one clear error, and writing a file whole or not at all."""

from __future__ import annotations

import os

from kbot.text.errors import DescriptionError, KbotError
from kbot.text.span import Origin, Source, Span
from kbot.text.suggest import did_you_mean

MAX_BYTES = 32 * 1024 * 1024


def _unreadable(path: str, code: str, message: str, hint: str = "") -> DescriptionError:
    from kbot.text.diagnostic import Diagnostic, Severity

    origin = Origin(Span(Source(path, ""), 0, 0))
    return DescriptionError([Diagnostic(code, Severity.ERROR, message, origin, hint)])


def read_source(path: str | os.PathLike[str], max_bytes: int = MAX_BYTES) -> Source:
    """Read a UTF-8 text file. Symbolic links are not resolved in the path it is known by.

    Raises:
        DescriptionError: F001 missing, F002 a directory, F003 not readable, F004 too large,
            F005 not UTF-8 text.
    """
    name = os.fspath(path)
    try:
        with open(name, "rb", buffering=0) as stream:  # noqa: PTH123 - no pathlib: this is read thousands of times
            data = (
                stream.read(max_bytes + 1) if os.fstat(stream.fileno()).st_size > max_bytes else stream.read()
            )
    except FileNotFoundError:
        folder, _, last = name.rpartition("/")
        siblings = os.listdir(folder or ".") if os.path.isdir(folder or ".") else []  # noqa: PTH112, PTH208
        raise _unreadable(name, "F001", f"{name} does not exist", did_you_mean(last, siblings)) from None
    except IsADirectoryError:
        raise _unreadable(name, "F002", f"{name} is a directory, not a file") from None
    except (OSError, ValueError) as error:
        if os.path.isdir(name):  # noqa: PTH112
            raise _unreadable(name, "F002", f"{name} is a directory, not a file") from None
        reason = getattr(error, "strerror", None) or str(error)
        raise _unreadable(name, "F003", f"{name} cannot be read: {reason}") from None
    if len(data) > max_bytes:
        raise _unreadable(name, "F004", f"{name} is larger than {max_bytes} bytes")
    try:
        return Source(name, data.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise _unreadable(
            name, "F005", f"{name} is not UTF-8 text: byte 0x{data[error.start]:02x} at offset {error.start}"
        ) from None


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write UTF-8 text as `write_bytes` does. Raises as it does."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: str | os.PathLike[str], data: bytes) -> None:
    """Write a file beside its target and rename it into place, so that nobody sees half of it.

    Raises:
        KbotError: the folder is missing or not writable.
    """
    import tempfile  # this and pathlib cost more to import than all of this package
    from pathlib import Path

    target = Path(os.path.realpath(path))  # a link stays a link
    try:
        if target.exists() and not target.is_file():
            target.write_bytes(data)  # a device or a pipe: nothing to replace
            return
        descriptor, scratch = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
    except OSError as error:
        raise KbotError(f"{path} cannot be written: {error.strerror}") from None
    try:
        with os.fdopen(descriptor, "wb") as stream:
            stream.write(data)
        mode = target.stat().st_mode & 0o777 if target.exists() else 0o666 & ~_umask()
        Path(scratch).chmod(mode)
        Path(scratch).replace(target)
    except OSError as error:
        raise KbotError(f"{path} cannot be written: {error.strerror}") from None
    finally:
        Path(scratch).unlink(missing_ok=True)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
