"""The encodings that XML may be written in, as expat knows them."""

from __future__ import annotations

import codecs
import re

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
