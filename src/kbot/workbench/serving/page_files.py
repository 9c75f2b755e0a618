"""The built page, held in memory: only these files are served, whatever path is asked for."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from kbot.text import KbotError

FOLDER = Path(__file__).parent.parent / "page"

_TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".woff2": "font/woff2",
    ".svg": "image/svg+xml",
}

_GREETING = b'id="greeting">'


def load_page(folder: Path = FOLDER) -> dict[str, tuple[str, bytes]]:
    """Content type and bytes of every file of the page by its path in the address.

    Raises:
        KbotError: the page was not built.
    """
    files = {
        "/" + file.relative_to(folder).as_posix(): (_TYPES[file.suffix], file.read_bytes())
        for file in sorted(folder.rglob("*"))
        if file.suffix in _TYPES and file.parent.name != "offline"
    }
    if "/index.html" not in files:
        raise KbotError("the page is not built: run `python hatch_build.py` in the checkout")
    files["/"] = files["/index.html"]
    return files


def with_greeting(page: bytes, messages: Iterable[str]) -> bytes:
    """The page's HTML with what a page is told first, each as JSON text, so that it can draw at once."""
    greeting = f"[{','.join(messages)}]".replace("<", "\\u003c").encode()
    return page.replace(_GREETING, _GREETING + greeting, 1)
