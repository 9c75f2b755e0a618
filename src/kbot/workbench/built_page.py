"""The files of the built page, in memory. The server serves only these."""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from kbot.text import KbotError

FOLDER = Path(__file__).parent / "page"
LICENCES = "third-party-licences.txt"
"""The licences of the npm packages and fonts in the page. `hatch_build.py` writes it."""

_TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".woff2": "font/woff2",
    ".svg": "image/svg+xml",
    ".txt": "text/plain; charset=utf-8",
}

_SCRIPT = re.compile(rb"<script>(.*?)(?:</script>|\Z)", re.DOTALL)
_GREETING = b'id="greeting">'


@dataclass(frozen=True, slots=True)
class PageFile:
    """A file as it is sent.

    `packed` is the gzip file beside it, if there is one. `scripts` are the digests of its inline scripts, as
    a Content-Security-Policy names them.
    """

    kind: str
    body: bytes
    packed: bytes | None
    scripts: tuple[str, ...]


def load_page(folder: Path = FOLDER) -> dict[str, PageFile]:
    """Return every file of the page by its path in the address.

    Raises:
        KbotError: the page is not built.
    """
    files = {
        "/" + file.relative_to(folder).as_posix(): _load(file)
        for file in sorted(folder.rglob("*"))
        if file.suffix in _TYPES and file.parent.name != "offline"
    }
    if "/index.html" not in files:
        raise KbotError("the page is not built: run `python hatch_build.py` in the checkout")
    files["/"] = files["/index.html"]
    return files


def _load(file: Path) -> PageFile:
    packed = file.with_name(f"{file.name}.gz")
    body = file.read_bytes()
    scripts = tuple(map(_digest, _SCRIPT.findall(body))) if file.suffix == ".html" else ()
    return PageFile(_TYPES[file.suffix], body, packed.read_bytes() if packed.exists() else None, scripts)


def _digest(script: bytes) -> str:
    return f"sha256-{base64.b64encode(hashlib.sha256(script).digest()).decode()}"


def with_greeting(page: bytes, messages: Iterable[str]) -> bytes:
    """Insert the first messages, as JSON text, into the page's HTML, so that the page can draw at once."""
    greeting = f"[{','.join(messages)}]".replace("<", "\\u003c").encode()
    return page.replace(_GREETING, _GREETING + greeting, 1)


def takes_gzip(accepted: Iterable[str]) -> bool:
    """Return whether a client with these Accept-Encoding headers accepts gzip. A quality of 0 means that it
    does not."""
    for coding in ",".join(accepted).lower().split(","):
        name, _, quality = coding.partition(";")
        if name.strip() == "gzip":
            return quality.replace(" ", "").rstrip("0.") != "q="
    return False
