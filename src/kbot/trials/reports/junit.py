"""The results of trials as JUnit XML, in the form that pytest writes (xunit2)."""

from __future__ import annotations

import platform
from collections.abc import Sequence
from datetime import datetime
from xml.etree import ElementTree

from kbot.text.render import printable
from kbot.text.xml_text import xml_document
from kbot.trials.results import TrialResult

NAME = "kbot try"
MARK = f'<testsuites name="{NAME}"'
"""The element of every report, by which KBot knows that it may overwrite the file."""


def junit(results: Sequence[TrialResult], begun: datetime) -> str:
    """JUnit XML with a test case for each trial. Its measures are properties of the case."""
    errors = sum(bool(result.error) for result in results)
    failures = sum(not result.passed for result in results) - errors
    root = ElementTree.Element("testsuites", name=NAME)
    suite = ElementTree.SubElement(
        root,
        "testsuite",
        name="kbot",
        errors=str(errors),
        failures=str(failures),
        skipped="0",
        tests=str(len(results)),
        time=f"{sum(result.wall for result in results):.3f}",
        timestamp=begun.astimezone().isoformat(),
        hostname=platform.node(),
    )
    for result in results:
        case = ElementTree.SubElement(
            suite,
            "testcase",
            classname=printable(result.robot or "kbot"),
            name=printable(result.title),
            time=f"{result.wall:.3f}",
        )
        _describe(case, result)
    return xml_document(root)


def _describe(case: ElementTree.Element, result: TrialResult) -> None:
    values = [(measure.name, f"{measure.value:g}") for measure in result.measures]
    values += [("state_sha256", result.state_sha256)] if result.state_sha256 else []
    if values:
        properties = ElementTree.SubElement(case, "properties")
        for name, value in values:
            ElementTree.SubElement(properties, "property", name=printable(name), value=value)
    if result.reason is not None:
        kind = "error" if result.error else "failure"
        found = ElementTree.SubElement(case, kind, message=printable(result.reason))
        found.text = "\n".join(
            printable(line)
            for line in (*([result.error] if result.error else result.failures), *map(str, result.findings))
        )
    if result.recording:
        ElementTree.SubElement(case, "system-out").text = f"recording: {printable(result.recording)}"
