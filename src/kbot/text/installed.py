"""Finds files of packages that were never built, through `install(DIRECTORY …)` in CMakeLists.txt."""

from __future__ import annotations

import os
import re

from kbot.text.files import read_bytes

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator

_COMMENT = re.compile(r"#[^\n]*")
_INSTALL = re.compile(
    r'\binstall\s*\(\s*(?:DIRECTORY|FILES)\s([^()]*?)\bDESTINATION\s+"?([^\s)"]+)', re.IGNORECASE
)
_SHARE = re.compile(r"share/[^/]+/?")
_MOST_BYTES = 1_000_000
"""Size of the largest CMakeLists.txt that is read."""


def find_file(path: str) -> str | None:
    """`path` if it exists, or else its source in the enclosing package. None if there is neither."""
    if not path or os.path.exists(path):
        return path or None
    package = os.path.dirname(os.path.abspath(path))
    while not os.path.isfile(os.path.join(package, "package.xml")):
        above = os.path.dirname(package)
        if above == package:
            return None
        package = above
    inner = os.path.relpath(os.path.abspath(path), package).replace(os.sep, "/")
    for source, place in _installed(package):
        if inner == place or not place or inner.startswith(f"{place}/"):
            found = os.path.normpath(os.path.join(package, source, inner[len(place) :].lstrip("/")))
            if os.path.exists(found):
                return found
    return None


def _installed(package: str) -> Iterator[tuple[str, str]]:
    """The installed files and folders, each with its path in the share folder, without outer slashes."""
    try:
        data = read_bytes(os.path.join(package, "CMakeLists.txt"), _MOST_BYTES)
    except OSError:
        return
    text = _COMMENT.sub("", data.decode("utf-8", "replace"))
    for sources, destination in _INSTALL.findall(text):
        share = _SHARE.match(destination)
        if share is None:
            continue
        for source in sources.replace('"', "").split():
            # as in CMake: with a trailing slash the content of the folder is installed, else the folder
            name = source.rsplit("/", 1)[-1]
            yield source.rstrip("/"), f"{destination[share.end() :]}/{name}".strip("/")
