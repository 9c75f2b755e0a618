"""The reports of a comparison: JSON, text and Markdown."""

from __future__ import annotations

import math
from dataclasses import replace

from kbot.trials.compare.causes import Cause, Change
from kbot.trials.compare.comparison import NO_RESULT, Comparison, to_markdown, to_text
from kbot.trials.compare.declarations import DeclaredDifference
from kbot.trials.compare.edits import Edit
from kbot.trials.compare.significance import Difference

LEFT = Difference("straight", "final_left", "m", 0.0, 0.0312, 0.001)
TURN = Difference("circle", "final_turn", "rad", 6.28, 6.91, 0.0628)
SAME = Difference("straight", "energy", "J", 3.2, 3.21, 0.064)
WHEEL = Edit("urdf/robot.xacro", 14, 42, 'radius="0.035"', 'radius="0.038"', ("", ""), ("", ""), ())
GAP = Edit("urdf/robot.xacro", 20, 7, "", "<gap>`1`</gap>", ("", ""), ("", ""), ())


def test_the_strongest_cause_and_measure_come_first() -> None:
    weak = Cause((Change((GAP,)),), {LEFT.key: LEFT})
    strong = Cause((Change((WHEEL,)),), {TURN.key: TURN, LEFT.key: LEFT})
    result = Comparison("main:", ".", (LEFT, TURN, SAME), (strong, weak)).to_json()
    assert result["schema"] == 1
    assert result["changed"] is True
    assert [m["significant"] for m in result["measures"]] == [True, True, False]
    first, second = result["causes"]
    assert first == {
        "file": "urdf/robot.xacro",
        "line": 14,
        "column": 42,
        "before": 'radius="0.035"',
        "after": 'radius="0.038"',
        "measures": ["final_left", "final_turn"],
        "declared": [],
    }
    assert second["line"] == 20


def test_equal_descriptions_have_no_measures() -> None:
    same = Comparison("a.xacro", "b.xacro")
    assert same.to_json() == NO_RESULT
    assert to_text(same) == "no change: b.xacro behaves as a.xacro, because their descriptions are equivalent"
    assert "behaves as before" in to_markdown(same)


def test_the_text_shows_the_change_and_the_edit() -> None:
    comparison = Comparison("a", "b", (LEFT, SAME), (Cause((Change((WHEEL,)),), {LEFT.key: LEFT}),))
    assert to_text(comparison).splitlines() == [
        "1 of 2 measures changed",
        "",
        "scenario  measure     before     after     change",
        "straight  final_left     0 m  0.0312 m  +0.0312 m",
        "",
        "cause 1: changes straight final_left",
        "  urdf/robot.xacro:14:42",
        '    - radius="0.035"',
        '    + radius="0.038"',
    ]


def test_markdown_escapes_what_a_description_contains() -> None:
    strange = Difference("a|b", "final_left", "m", 0.0, math.nan, 0.001)
    text = to_markdown(Comparison("a", "b", (strange,), (Cause((Change((GAP,)),), {strange.key: strange}),)))
    assert "a\\|b" in text
    assert "```diff\n+ <gap>`1`</gap>\n```" in text


def test_a_value_that_a_run_does_not_show_is_a_dash() -> None:
    appears = Difference("straight", "slip", "", math.nan, 0.5, 0.001)
    row = to_text(Comparison("a", "b", (appears,))).splitlines()[3]
    assert row.split() == ["straight", "slip", "-", "0.5", "-"]


def test_edits_that_act_together_are_named_as_such() -> None:
    together = Cause((Change((WHEEL,)), Change((GAP,))), {LEFT.key: LEFT})
    comparison = Comparison("a", "b", (LEFT,), (together,))
    assert "act only together" in to_text(comparison)
    assert [cause["line"] for cause in comparison.to_json()["causes"]] == [14, 20]


def test_the_rows_show_every_scenario_before_a_second_measure_of_one() -> None:
    pushes = [Difference("push", f"support/{n}", "N", 0.0, 100.0 + n, 0.05) for n in range(20)]
    rows = to_text(Comparison("a", "b", (*pushes, LEFT))).splitlines()[3:]
    assert rows[0].startswith("push")
    assert rows[1].startswith("straight")
    assert "… 9 more (-v)" in rows


def test_a_cause_of_many_edits_is_cut_in_reports() -> None:
    edits = (GAP, *(replace(GAP, line=line) for line in range(21, 60)))
    many = Cause((Change(edits),), {LEFT.key: LEFT})
    comparison = Comparison("a", "b", (LEFT,), (many,))
    assert len(comparison.to_json()["causes"]) == 40
    for report in (to_text(comparison), to_markdown(comparison)):
        assert report.count("urdf/robot.xacro:") == 10
        assert "… 30 more edits" in report


YAW = DeclaredDifference("sensor scan", "yaw", "rad", -0.0, math.pi / 2.0)
FRAME = DeclaredDifference("topic /odom", "frame", "", "odom", None)


def test_a_declared_difference_is_a_change_after_the_measured_ones() -> None:
    turned = Cause((Change((GAP,)),), {YAW.key: YAW})
    comparison = Comparison("a", "b", (SAME,), (turned,), (YAW, FRAME))
    assert to_text(comparison).splitlines() == [
        "0 of 1 measures changed",
        "",
        "declared     setting  before      after",
        "sensor scan  yaw       0 rad  1.571 rad",
        "topic /odom  frame      odom          -",
        "",
        "cause 1: changes sensor scan yaw",
        "  urdf/robot.xacro:20:7",
        "    + <gap>`1`</gap>",
    ]
    text = to_markdown(comparison)
    assert text.startswith("### ⚠️ The robot behaves differently: 2 declared settings changed")
    assert "| sensor scan | yaw | 0 rad | 1.571 rad |" in text
    result = comparison.to_json()
    assert result["changed"] is True
    assert result["declared"][1] == {
        "part": "topic /odom",
        "setting": "frame",
        "unit": "",
        "before": "odom",
        "after": None,
    }
    assert result["causes"][0]["measures"] == []
    assert result["causes"][0]["declared"] == ["sensor scan yaw"]


def test_edits_without_an_effect_are_listed_and_are_no_change() -> None:
    comparison = Comparison("a", "b", (SAME,), without_effect=(Change((WHEEL,)),))
    assert to_text(comparison).splitlines() == [
        "no measured change: b behaves as a (1 measures of 1 scenario)",
        "",
        "edits that change no measure and no declared setting:",
        "  urdf/robot.xacro:14:42",
        '    - radius="0.035"',
        '    + radius="0.038"',
    ]
    assert comparison.to_json()["changed"] is False
    assert "Edits that change no measure and no declared setting:" in to_markdown(comparison)


def test_scans_that_no_scenario_shows_are_named() -> None:
    unseen = Difference("straight", "scan_difference/scan", "m", math.nan, math.nan, 0.02)
    comparison = Comparison("a", "b", (unseen,), (), (YAW,))
    assert "not measured: the scans of 'scan'" in to_text(comparison)
    seen = Difference("rooms", "scan_difference/scan", "m", 0.0, 0.3, 0.02)
    assert "not measured" not in to_text(Comparison("a", "b", (unseen, seen), (), (YAW,)))
