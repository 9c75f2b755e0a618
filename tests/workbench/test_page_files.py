"""How the page's files are sent: compressed if possible, and with known scripts only."""

import base64
import gzip
import hashlib
import re
import urllib.request
from http.client import HTTPMessage

import pytest

from kbot.workbench.built_page import takes_gzip


def get(address: str, **headers: str) -> tuple[bytes, HTTPMessage]:
    with urllib.request.urlopen(urllib.request.Request(address, headers=headers)) as answer:
        return answer.read(), answer.headers


@pytest.mark.parametrize(
    ("accepted", "takes"),
    [
        ([], False),
        (["gzip, deflate, br"], True),
        (["br", "GZIP ; q=0.5"], True),
        (["br;q=1.0, gzip;q=0"], False),
        (["gzip; q=0.000"], False),
        (["gzipped, identity"], False),
    ],
)
def test_gzip_is_sent_to_clients_that_accept_it(accepted: list[str], takes: bool) -> None:
    assert takes_gzip(accepted) is takes


def test_a_compressed_script_has_the_same_content(viewing: str) -> None:
    html, _ = get(viewing)
    name = re.search(rb'src="\./(assets/[^"]+\.js)"', html)
    assert name is not None
    plain, reported = get(viewing + name[1].decode())
    packed, expected = get(viewing + name[1].decode(), **{"Accept-Encoding": "gzip"})
    assert reported["Content-Encoding"] is None
    assert expected["Content-Encoding"] == "gzip"
    assert int(expected["Content-Length"]) == len(packed) < len(plain) / 2
    assert gzip.decompress(packed) == plain


def test_the_policy_lists_the_digest_of_each_inline_script(viewing: str) -> None:
    html, reported = get(viewing)
    scripts = re.findall(rb"<script>(.*?)</script>", html, re.DOTALL)
    assert scripts
    allowed = dict(rule.strip().split(" ", 1) for rule in reported["Content-Security-Policy"].split(";"))
    digests = [base64.b64encode(hashlib.sha256(script).digest()).decode() for script in scripts]
    assert allowed["script-src"].split() == ["'self'", *(f"'sha256-{digest}'" for digest in digests)]
