"""Writes findings as SARIF 2.1.0, GitHub annotations or JUnit XML."""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from xml.etree import ElementTree

from kbot.checks.former_codes import former_codes
from kbot.checks.registry import all_rules
from kbot.text import Diagnostic, Origin, Severity, Span
from kbot.text.escapes import with_escapes
from kbot.text.render import encodable
from kbot.text.xml_text import xml_document

_LEVEL = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.INFO: "note"}
_GITHUB = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.INFO: "notice"}
_SCHEMA = "https://json.schemastore.org/sarif-2.1.0.json"


def sarif(found: Sequence[Diagnostic], version: str) -> dict[str, object]:
    """A SARIF 2.1.0 log with one run. The macro calls and includes of a finding become its code flow."""
    codes = sorted({d.code for d in found})
    return {
        "$schema": _SCHEMA,
        "version": "2.1.0",
        "runs": [
            {
                "tool": {"driver": {"name": "kbot", "version": version, "rules": [_rule(c) for c in codes]}},
                "columnKind": "unicodeCodePoints",
                "results": [_result(d, codes.index(d.code)) for d in found],
            }
        ],
    }


def _rule(code: str) -> dict[str, object]:
    rule = all_rules().get(code)
    if rule is None:
        return {"id": code}
    former = former_codes(code)
    return {
        "id": code,
        **({"deprecatedIds": former} if former else {}),
        "name": "".join(word.capitalize() for word in rule.name.split("-")),
        "shortDescription": {"text": rule.summary},
        "fullDescription": {"text": rule.page},
        "help": {"text": rule.page},
        "defaultConfiguration": {"level": _LEVEL[rule.severity]},
    }


def _result(diagnostic: Diagnostic, index: int) -> dict[str, object]:
    text = diagnostic.message + (f"\n{diagnostic.hint}" if diagnostic.hint else "")
    result: dict[str, object] = {
        "ruleId": diagnostic.code,
        "ruleIndex": index,
        "level": _LEVEL[diagnostic.severity],
        "message": {"text": encodable(text)},
    }
    origin = diagnostic.origin
    if origin is None:
        return result
    result["locations"] = [_location(origin.span)]
    if diagnostic.related:
        result["relatedLocations"] = [
            {"id": i, **_location(r.origin.span, r.message)} for i, r in enumerate(diagnostic.related, 1)
        ]
    if origin.stack:
        result["codeFlows"] = [{"threadFlows": [{"locations": _flow(origin, diagnostic.message)}]}]
    if diagnostic.fix:
        result["fixes"] = [_fix(diagnostic)]
    return result


def _flow(origin: Origin, message: str) -> list[dict[str, object]]:
    """The code flow: the outermost call first, the place of the finding last."""
    words = {"macro": "macro '{}' is called", "include": "'{}' is included"}
    steps = [_location(c.span, words[c.kind].format(c.name)) for c in reversed(origin.stack)]
    return [{"location": step} for step in (*steps, _location(origin.span, message))]


def _fix(diagnostic: Diagnostic) -> dict[str, object]:
    edits: dict[str, list[dict[str, object]]] = defaultdict(list)
    fix = diagnostic.fix
    for edit in fix.edits if fix else ():
        edits[edit.span.file].append(
            {"deletedRegion": _region(edit.span), "insertedContent": {"text": encodable(edit.replacement)}}
        )
    changes = [{"artifactLocation": {"uri": _uri(f)}, "replacements": r} for f, r in edits.items()]
    return {"description": {"text": encodable(fix.title) if fix else ""}, "artifactChanges": changes}


def _location(span: Span, message: str = "") -> dict[str, object]:
    location: dict[str, object] = {
        "physicalLocation": {"artifactLocation": {"uri": _uri(span.file)}, "region": _region(span)}
    }
    if message:
        location["message"] = {"text": encodable(message)}
    return location


def _region(span: Span) -> dict[str, int]:
    line, column = span.source.line_column(span.start)
    end_line, end_column = span.source.line_column(span.end)
    return {"startLine": line, "startColumn": column, "endLine": end_line, "endColumn": end_column}


def relative(path: str) -> str:
    """A path with forward slashes, relative to the working directory if it is inside."""
    return _relative_to(os.getcwd(), path)


@lru_cache(maxsize=256)  # thousands of findings, with all their calls, may be in one file
def _relative_to(folder: str, path: str) -> str:
    absolute = Path(os.path.abspath(path))
    return (absolute.relative_to(folder) if absolute.is_relative_to(folder) else absolute).as_posix()


def _uri(path: str) -> str:
    from urllib.parse import quote  # imported lazily: only SARIF needs it

    name = relative(path)
    return Path(name).as_uri() if os.path.isabs(name) else quote(os.fsencode(name))


def github(found: Sequence[Diagnostic]) -> str:
    """GitHub workflow commands, one per line, that annotate the xacro lines of a pull request."""
    lines = []
    for diagnostic in found:
        title = f"title=kbot {diagnostic.code}"
        place = title
        if diagnostic.origin is not None:
            region = _region(diagnostic.origin.span)
            end = max(region["endLine"], region["startLine"])
            file = _property(relative(diagnostic.origin.span.file))
            place = f"file={file},line={region['startLine']},endLine={end},col={region['startColumn']}"
            if end == region["startLine"]:
                place += f",endColumn={region['endColumn']}"
            place += f",{title}"
        text = diagnostic.message + (f"\n{diagnostic.hint}" if diagnostic.hint else "")
        lines.append(f"::{_GITHUB[diagnostic.severity]} {place}::{_data(text)}")
    return "".join(line + "\n" for line in lines)


def _data(text: str) -> str:
    """A text of one line. A line end would begin another command, so it is escaped, as GitHub defines, and
    so are all other characters that a terminal does not print."""
    return with_escapes(text, "\r\n").replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _property(text: str) -> str:
    return _data(text).replace(":", "%3A").replace(",", "%2C")


def junit(found: Sequence[Diagnostic], files: Sequence[str]) -> str:
    """JUnit XML: a suite for each checked file, a failed case for each finding."""
    groups: dict[str, list[Diagnostic]] = {relative(f): [] for f in files}
    for diagnostic in found:
        name = relative(diagnostic.origin.span.file) if diagnostic.origin else "kbot"
        groups.setdefault(name, []).append(diagnostic)
    root = ElementTree.Element("testsuites", name="kbot check", failures=str(len(found)))
    for name, diagnostics in groups.items():
        cases = max(len(diagnostics), 1)
        suite = ElementTree.SubElement(
            root, "testsuite", name=name, tests=str(cases), failures=str(len(diagnostics)), errors="0"
        )
        if not diagnostics:
            ElementTree.SubElement(suite, "testcase", name="clean", classname=name)
        for d in diagnostics:
            line = d.origin.span.line if d.origin else 0
            case = ElementTree.SubElement(suite, "testcase", name=f"{d.code} line {line}", classname=name)
            failure = ElementTree.SubElement(case, "failure", type=d.code, message=d.message)
            failure.text = f"{d}\n{d.hint}".strip()
    return xml_document(root)
