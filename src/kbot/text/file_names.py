"""Makes file names from names of descriptions, nodes and topics."""

from __future__ import annotations

import re

MOST = 100
"""Characters of a name; with a date, a number and an ending it stays below the 255 bytes of file systems,
also where each takes two."""

_REFUSED = re.compile(r'[\x00-\x1f\x7f-\x9f\ud800-\udfff<>:"/\\|?*]')
_DEVICE = re.compile(r"(con|prn|aux|nul|conin\$|conout\$|com[0-9¹²³]|lpt[0-9¹²³])\s*(\..*)?", re.IGNORECASE)


def plain_file_name(name: str) -> str:
    """What a name is called as a file in any folder, on any system: without separators, a dot in front or
    characters that Windows refuses, no name of its devices, and of bounded length; never empty.

    https://learn.microsoft.com/windows/win32/fileio/naming-a-file
    """
    plain = _REFUSED.sub("_", name)
    dots = len(plain) - len(plain.lstrip(". "))
    plain = ("_" * dots + plain[dots:])[:MOST].rstrip(". ")
    while len(plain.encode()) > 2 * MOST:
        plain = plain[:-1]
    return f"_{plain}" if not plain or _DEVICE.fullmatch(plain) else plain
