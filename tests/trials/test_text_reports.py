"""The table, JUnit XML and grades, from results."""

from __future__ import annotations

import csv
import math
import re
from dataclasses import replace
from datetime import UTC, datetime
from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kbot.text import Diagnostic, Severity
from kbot.trials.reports.grades import grades
from kbot.trials.reports.html import html_report
from kbot.trials.reports.junit import junit
from kbot.trials.reports.table import summary, table
from kbot.trials.results import MeasureResult, TrialResult

PASSED = TrialResult(
    "straight", 0, (MeasureResult("final_x", 1.60001, "m", 1.0, 2.0),), robot="kbot", wall=0.5
)
FAILED = TrialResult(
    "turn",
    3,
    (MeasureResult("contacts", 1.0, "", None, 0.0, "wall"),),
    recording="keep it/turn.mcap",
    failed_at=4.25,
    wall=0.25,
)
BROKEN = TrialResult("slope", 0, error="robot.urdf:3:1: error: \x1b[2Jno link")


def test_the_table_has_a_line_for_each_trial() -> None:
    assert table([PASSED, FAILED, BROKEN]).splitlines() == [
        "✓ straight      final_x 1.6 m",
        "✗ turn, seed 3  contacts is 1, above 0 (wall)",
        "    kbot view 'keep it/turn.mcap' --at 3.2",
        r"✗ slope         robot.urdf:3:1: error: \x1b[2Jno link",
    ]
    found = Diagnostic("W301", Severity.WARNING, "odometry is 14 % off")
    assert (
        table([replace(FAILED, findings=(found,) * 4)]).splitlines()[2:]
        == ["    warning: odometry is 14 % off [W301]"] * 3
    )
    assert table([replace(PASSED, findings=(found,))]).count("\n") == 1
    assert table([BROKEN, replace(BROKEN, name="step")]).splitlines()[1] == "✗ step   the same error"
    assert table([]) == ""
    assert "\x1b[32m✓\x1b[0m" in table([PASSED], color=True)


@pytest.mark.parametrize(
    ("results", "text"),
    [
        ([PASSED, PASSED], "2 passed in 1.5 s"),
        ([PASSED, FAILED, BROKEN], "1 passed, 2 failed in 1.5 s"),
        ([FAILED], "1 failed in 1.5 s"),
        ([], "0 passed in 1.5 s"),
    ],
)
def test_the_last_line_counts(results: list[TrialResult], text: str) -> None:
    assert summary(results, 1.5) == text


@pytest.mark.parametrize(
    ("value", "text"), [(-1e-9, "a 0 m"), (12345.67891, "a 12345.6789 m"), (math.inf, "a inf m")]
)
def test_a_number_is_as_exact_as_a_robot(value: float, text: str) -> None:
    result = TrialResult("own", 0, (MeasureResult("a", value, "m"),))
    assert table([result]) == f"✓ own  {text}\n"


def test_a_count_says_less_than_another_measure() -> None:
    contacts, tilt = MeasureResult("contacts", 0.0, ""), MeasureResult("max_tilt", 0.25, "rad")
    assert table([TrialResult("own", 0, (contacts, tilt))]) == "✓ own  max_tilt 0.25 rad\n"
    assert table([TrialResult("own", 0, (contacts,))]) == "✓ own  contacts 0\n"


def test_a_run_in_real_time_is_labelled() -> None:
    result = TrialResult("own", 0, is_deterministic=False)
    assert table([result]) == "✓ own    (ran in real time: not deterministic)\n"


def test_junit_has_a_case_for_each_trial_with_its_measures() -> None:
    begun = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)
    suite = ElementTree.fromstring(junit([PASSED, FAILED, BROKEN], begun))[0]
    assert {name: suite.get(name) for name in ("name", "tests", "failures", "errors", "skipped", "time")} == {
        "name": "kbot", "tests": "3", "failures": "1", "errors": "1", "skipped": "0", "time": "0.750",
    }  # fmt: skip
    passed, failed, broken = suite
    assert (passed.get("classname"), passed.get("name")) == ("kbot", "straight")
    assert [each.tag for each in passed] == ["properties"]
    assert passed[0][0].attrib == {"name": "final_x", "value": "1.60001"}
    assert [each.tag for each in failed] == ["properties", "failure", "system-out"]
    assert failed[1].get("message") == "contacts is 1, above 0 (wall)"
    assert failed[2].text == "recording: keep it/turn.mcap"
    assert [each.tag for each in broken] == ["error"]
    assert r"\x1b[2Jno link" in broken[0].get("message", "")


def test_grades_have_a_row_for_each_robot() -> None:
    trials = [("ann", PASSED), ("ann", FAILED), ("=cmd()", BROKEN)]
    rows = list(csv.reader(grades(trials).splitlines()))
    assert rows == [
        ["path", "robot", "passed", "failed", "score", "straight", "turn, seed 3", "slope"],
        ["ann", "kbot", "1", "1", "0.50", "pass", "contacts is 1, above 0 (wall)", ""],
        ["'=cmd()", "", "0", "1", "0.00", "", "", BROKEN.error],
    ]


TEXTS = st.text(
    st.one_of(
        st.characters(exclude_categories=()),
        st.sampled_from("]><&'\"\0\x01\x1b\x85\r\n\ud800\udcff\ufffe\uffff"),
    ),
    max_size=12,
)


@given(name=TEXTS, error=TEXTS, robot=TEXTS, recording=TEXTS, measure=TEXTS, message=TEXTS)
def test_junit_and_the_page_take_any_text(
    name: str, error: str, robot: str, recording: str, measure: str, message: str
) -> None:
    result = TrialResult(
        name, 0, (MeasureResult(measure, 1.0, "", None, 0.0, "wall"),), error=error, robot=robot,
        recording=recording, findings=(Diagnostic("W301", Severity.WARNING, message),),
    )  # fmt: skip
    root = ElementTree.fromstring(junit([result], datetime.now(UTC)).encode("utf-8"))
    assert len(root.findall("./testsuite/testcase")) == 1
    page = html_report([result], name).encode("utf-8").decode("utf-8")
    assert not re.search(r"[^\t\n\r -\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]", page)
    # only KBot's own elements: none that the texts contain
    tags = set(re.findall(r"<([a-z]\w*)", page))
    assert tags <= set(re.findall(r"<([a-z]\w*)", html_report([replace(result, name="x")], "x")))
