"""Access to the server: check Host, Origin and token, and set the headers of every response."""

from __future__ import annotations

import hmac
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from urllib.parse import parse_qs, urlsplit

from kbot.net.hosts import accepts_host, host_and_port

HTTP_PORT = 80
"""The port of a Host header without one."""


@dataclass(frozen=True, slots=True)
class Access:
    """The served address, and the token that is needed if other machines can reach it."""

    host: str
    port: int
    token: str | None

    def refuses(self, path: str, host: str | None, origins: Sequence[str], secret: bool) -> str | None:
        """Return why a request is refused, or None if it is accepted.

        `secret` resources need the token. `host` is None for a request without exactly one Host header.
        Without a token, Host has to be one of this machine's names, because a foreign name can resolve here
        (DNS rebinding). A page of another site is always refused.
        """
        if host is None:
            return "a request needs exactly one Host header"
        if self.token is None and not self._is_served(host):
            return f"the Host header names {host[:80]!r}, which is not served here"
        for origin in origins:
            if origin != f"http://{host}":
                return f"the page {origin[:80]!r} may not use this server"
        if secret and self.token is not None and not self._has_token(path):
            return "the address needs the token that was printed with it"
        return None

    def _is_served(self, host: str) -> bool:
        port = host_and_port(host)[1]
        return accepts_host(host, self.host) and self.port == (HTTP_PORT if port is None else port)

    def _has_token(self, path: str) -> bool:
        given = parse_qs(urlsplit(path).query).get("token", [""])[0]
        return hmac.compare_digest(given.encode(), (self.token or "").encode())


def is_used_by_another_site(headers: Mapping[str, str]) -> bool:
    """Return whether a page of another site loads something from here, as an image or in a frame.

    Browsers send no Origin for that. A link to the page is allowed. See the W3C's Fetch Metadata.
    """
    if headers.get("Sec-Fetch-Site") != "cross-site":
        return False
    return (headers.get("Sec-Fetch-Mode"), headers.get("Sec-Fetch-Dest")) != ("navigate", "document")


def bracketed(host: str) -> str:
    """Return the host as it is written in a URL: IPv6 in brackets."""
    return f"[{host}]" if ":" in host else host


def security_headers(host: str, scripts: Iterable[str] = ()) -> dict[str, str]:
    """Return headers that restrict the page to this server: it loads from and connects to nothing else.

    `scripts` are the digests of inline scripts, as `sha256-...`.
    """
    # No Cross-Origin-Opener-Policy: the page ignores messages from its opener, and the header makes browsers
    # start another process after the first bytes, which takes a tenth of the time to the first picture.
    known = "".join(f" '{digest}'" for digest in scripts)
    policy = (
        f"default-src 'none'; script-src 'self'{known}; style-src 'self'; font-src 'self'; "
        f"img-src 'self' data: blob:; connect-src 'self'{f' ws://{host}' if host else ''}; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )
    return {
        "Content-Security-Policy": policy,
        "X-Content-Type-Options": "nosniff",
        "Referrer-Policy": "no-referrer",
        "Cross-Origin-Resource-Policy": "same-origin",
    }
