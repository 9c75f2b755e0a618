"""The formats of findings, whatever characters the names and texts have."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path
from xml.etree import ElementTree

import jsonschema
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kbot.checks.formats import github, junit, relative, sarif
from kbot.text import Diagnostic, Edit, Fix, Origin, Severity, Source, Span

SCHEMA = json.loads((Path(__file__).parent / "schemas" / "sarif-schema-2.1.0.json").read_text("utf-8"))
TEXTS = st.text(
    st.one_of(
        st.characters(exclude_categories=()),  # also surrogates, as names that are not UTF-8 have
        st.sampled_from("]><&'\"%:,;\0\x01\x1b\x7f\x85\r\n\t\u2028\u202e\ud800\udcff\ufffe\uffff"),
    ),
    max_size=12,
)


@st.composite
def findings(draw: st.DrawFn) -> tuple[Diagnostic, str]:
    """A finding, and the name of its file."""
    name = draw(TEXTS).replace("\0", "") or "r"
    source = Source(name, draw(TEXTS))
    origin = Origin(Span(source, 0, len(source.data)))
    fix = Fix(draw(TEXTS), (Edit(origin.span, draw(TEXTS)),), safe=True)
    return Diagnostic("U202", Severity.ERROR, draw(TEXTS), origin, draw(TEXTS), fix=fix), name


def shown(text: str) -> str:
    """What XML shows of a text: escapes for what is not a character of XML 1.0, section 2.2."""
    is_character = re.compile("[\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]").fullmatch
    return "".join(c if is_character(c) else c.encode("ascii", "backslashreplace").decode()
                   if ord(c) > 0xFF else f"\\x{ord(c):02x}" for c in text)  # fmt: skip


@given(findings())
def test_junit_is_xml_with_all_texts(found: tuple[Diagnostic, str]) -> None:
    finding, name = found
    root = ElementTree.fromstring(junit([finding], [name]).encode("utf-8"))
    (suite,) = root
    assert suite.get("name") == shown(relative(name))
    (case,) = suite
    (failure,) = case
    assert failure.get("message") == shown(finding.message)
    # a parser reads each line end as \n (XML 1.0, section 2.11)
    assert shown(finding.message).replace("\r\n", "\n").replace("\r", "\n") in str(failure.text)


@settings(max_examples=30, deadline=None)
@given(findings())
def test_sarif_is_unicode_and_keeps_its_schema(found: tuple[Diagnostic, str]) -> None:
    finding, _ = found
    log = json.loads(json.dumps(sarif([finding], "1.0"), ensure_ascii=False).encode("utf-8"))
    jsonschema.Draft4Validator(SCHEMA).validate(log)
    place = log["runs"][0]["results"][0]["locations"][0]["physicalLocation"]["artifactLocation"]
    assert re.fullmatch(r"[\w/.~:%-]*", place["uri"], re.ASCII)


@given(st.lists(findings(), max_size=3))
def test_github_gets_one_command_for_each_finding(found: list[tuple[Diagnostic, str]]) -> None:
    text = github([finding for finding, _ in found])
    text.encode("utf-8")
    lines = text.splitlines()  # also at rare line ends
    assert len(lines) == len(found)
    for line in lines:
        assert re.fullmatch(
            r"::error file=[^:,]*,line=\d+,endLine=\d+,col=\d+(,endColumn=\d+)?,title=kbot U202::.*", line
        )
        assert line.isprintable()


@pytest.mark.parametrize(
    ("name", "uri"),
    [("a b.xacro", "a%20b.xacro"), (os.fsdecode(b"r\xfe.xacro"), "r%FE.xacro"), ("é.xacro", "%C3%A9.xacro")],
)
def test_the_address_in_sarif_has_the_bytes_of_the_name(name: str, uri: str) -> None:
    finding = Diagnostic("U202", Severity.ERROR, "m", Origin(Span(Source(name, ""), 0, 0)))
    log = json.dumps(sarif([finding], "1.0"))
    assert f'"uri": "{uri}"' in log
