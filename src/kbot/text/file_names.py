"""Converts names of robots, nodes and topics to file names."""

from __future__ import annotations

import re

MOST = 100
"""Characters of a name. With a date, a number and a suffix it stays below the 255 bytes of file systems, even
if each character takes two bytes."""

_REFUSED = re.compile(r'[\x00-\x1f\x7f-\x9f\ud800-\udfff<>:"/\\|?*]')
_DEVICE = re.compile(r"(con|prn|aux|nul|conin\$|conout\$|com[0-9¹²³]|lpt[0-9¹²³])\s*(\..*)?", re.IGNORECASE)


def plain_file_name(name: str) -> str:
    """A file name for `name` that is valid in any folder and on any system.

    It has no separators, leading dots or characters that Windows rejects. It is not the name of a Windows
    device, not too long, and never empty.

    https://learn.microsoft.com/windows/win32/fileio/naming-a-file
    """
    plain = _REFUSED.sub("_", name)
    dots = len(plain) - len(plain.lstrip(". "))
    plain = ("_" * dots + plain[dots:])[:MOST].rstrip(". ")
    while len(plain.encode()) > 2 * MOST:
        plain = plain[:-1]
    return f"_{plain}" if not plain or _DEVICE.fullmatch(plain) else plain
