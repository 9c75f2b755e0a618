"""The HTML report: all results are in it, to scale, and nothing of a stranger is active."""

from __future__ import annotations

import base64
import hashlib
import io
import math
import re
from collections.abc import Iterator
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from kbot.text import Diagnostic, KbotError
from kbot.text.diagnostic import Severity
from kbot.text.span import Origin, Source, Span
from kbot.trials import (
    Bound,
    Check,
    Command,
    MeasureResult,
    NeverTouches,
    PassesThrough,
    Reaches,
    RobotSource,
    Scenario,
    Settles,
    Step,
    TrialResult,
    run_trial,
)
from kbot.trials.measures import measures
from kbot.trials.reports import html as reports
from kbot.trials.reports.charts import QUANTITIES_OF, charts
from kbot.trials.reports.html import html_report, write_html
from kbot.trials.trace import Event

KBOT = RobotSource("kbot")
VOID = {"meta", "img", "br"}
HOSTILE = "<script>alert('1')</script><img src=x onerror=\"alert(2)\">&amp;\x00\u202e\udcff"


class Page(HTMLParser):
    """The elements of a page: every start has its end. `text` is what is visible."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.open: list[str] = []
        self.text = ""
        self.feed(html)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        names = [name for name, _ in attrs]
        assert len(names) == len(set(names)), (tag, names)
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if "style" not in self.open:
            self.text += data

    def of(self, tag: str) -> Iterator[dict[str, str | None]]:
        return (attributes for name, attributes in self.elements if name == tag)


@pytest.fixture(scope="module")
def results() -> list[TrialResult]:
    """A crash with several failures, a trial that passes, and a robot that does not exist."""
    crash = Scenario(
        "crash",
        6.0,
        [Step(Command(0.3)), Step(Command(0.3, -0.1), at=2.0)],
        [
            NeverTouches(),
            Reaches(1.8, 0.2, 0.1),
            Bound("max_speed", 0.2, 0.29),
            Bound("final_left", -0.1, 0.1),
        ],
        KBOT,
        "corridor:length=2",
    )
    straight = Scenario(
        "straight",
        2.0,
        [Step(Command(0.2))],
        [Bound("final_forward", min=0.3), PassesThrough(0.2, 0.0, 0.1)],
        KBOT,
    )
    broken = Scenario("broken", 1.0, robot=RobotSource("/nowhere/robot.urdf"))
    return [
        run_trial(crash, with_trace=True),
        run_trial(straight, 3, with_trace=True),
        run_trial(broken),
    ]


def test_every_result_is_shown_with_its_measures_and_reasons(results: list[TrialResult]) -> None:
    page = Page(html_report(results, "Trials of KBot"))
    assert "Trials of KBot" in page.text
    assert "2 of 3 trials failed." in page.text
    for result in results:
        assert result.title in page.text
        assert result.state_sha256 in page.text
        for measure in result.measures:
            assert measure.name in page.text
            assert measure.passed or measure.failure in page.text
    assert "/nowhere/robot.urdf:1:1: error: /nowhere/robot.urdf does not exist" in page.text
    assert "0.2 to 0.29 m/s" in page.text
    assert "link 'base_link' touches 'end_wall'" in page.text
    assert "kbot.xacro:" in page.text
    # those that failed are open and first, and the one that passed is closed
    articles = [a["class"] for a in page.of("article")]
    assert articles == ["failed", "failed", "passed"]
    assert [a for a in page.of("details") if "open" in a] == []


def test_links_lead_to_the_trials(results: list[TrialResult]) -> None:
    page = Page(html_report(results))
    names = [str(attributes["id"]) for _, attributes in page.elements if "id" in attributes]
    assert len(names) == len(set(names))
    assert [str(a["href"]) for a in page.of("a")] == ["#trial-0", "#trial-1", "#trial-2"]
    assert {"trial-0", "trial-1", "trial-2"} <= set(names)


def test_a_report_refers_to_nothing_outside_and_runs_nothing(results: list[TrialResult]) -> None:
    html = html_report([replace(results[0], film=_film(), recording="runs/crash.mcap"), *results[1:]])
    page = Page(html)
    assert {tag for tag, _ in page.elements} & {
        "script",
        "link",
        "iframe",
        "object",
        "embed",
        "form",
    } == set()
    for tag, attributes in page.elements:
        assert not [name for name in attributes if name.startswith("on") or name == "style"], tag
        for name in ("src", "href", "srcset", "action", "xlink:href"):
            assert str(attributes.get(name) or "#").startswith(("#", "data:image/"))
    (policy,) = (
        str(m["content"]) for m in page.of("meta") if m.get("http-equiv") == "Content-Security-Policy"
    )
    style = re.search(r"<style>(.*?)</style>", html, re.DOTALL)
    assert style is not None
    assert "url(" not in style[1]
    assert "@import" not in style[1]
    digest = base64.b64encode(hashlib.sha256(style[1].encode()).digest()).decode()
    assert policy == (
        f"default-src 'none'; style-src 'sha256-{digest}'; img-src data:; base-uri 'none'; form-action 'none'"
    )
    # the first failure, that of max_speed, is less than a second after the start
    assert "kbot view runs/crash.mcap --at 0.0" in page.text


def test_texts_of_strangers_are_escaped(results: list[TrialResult]) -> None:
    trace, around = results[0].trace, results[0].surroundings
    assert trace is not None
    assert around is not None
    source = Source(HOSTILE, f"<robot>{HOSTILE}</robot>\n")
    finding = Diagnostic(HOSTILE, Severity.WARNING, HOSTILE, Origin(Span(source, 7, 20)), HOSTILE)
    hostile = TrialResult(
        HOSTILE,
        1,
        (
            MeasureResult(HOSTILE, 2.0, HOSTILE, max=1.0, detail=HOSTILE),
            MeasureResult(f"support/{HOSTILE}", 0.0, "N", 1.0),
        ),
        state_sha256=HOSTILE,
        findings=(finding,),
        trace=replace(
            trace,
            events=(Event(1.0, HOSTILE, HOSTILE),),
            touched=(HOSTILE,),
            support={HOSTILE: trace["x"]},
        ),
        robot=HOSTILE,
        recording=HOSTILE,
        surroundings=replace(around, world=HOSTILE, parts=(replace(around.parts[0], name=HOSTILE),)),
        film_problem=HOSTILE,
    )
    error = TrialResult("error", 0, error=HOSTILE)
    plain, attacked = (
        Page(html_report(each, "title")) for each in ([results[0], results[2]], [hostile, error])
    )
    assert {tag for tag, _ in attacked.elements} <= {tag for tag, _ in plain.elements} | {"br"}
    assert not [a for _, a in attacked.elements if "onerror" in a]
    assert "<script>alert('1')</script>" in attacked.text
    assert not re.search("[\x00-\x08\u202e\ud800-\udfff]", attacked.text)
    titled = html_report([error], HOSTILE)
    assert Page(titled).text.count("alert(2)") == 3  # in the title, the heading and the reason
    titled.encode()


def test_plots_show_the_bounds_where_they_are(results: list[TrialResult]) -> None:
    """The bound of 0.29 m/s is between the grid lines of 0.2 and 0.3 m/s, nine tenths of the way."""
    found = {chart.title: chart.svg for chart in charts(results[0], results[0].measures)}
    assert list(found) == ["contacts", "distance_to_target", "max_speed", "final_left"]
    svg = found["max_speed"]
    ticks = {
        float(text): float(y)
        for y, text in re.findall(
            r'<text x="[\d.]+" y="([\d.]+)" dy="0.35em" text-anchor="end">([\d.]+)<', svg
        )
    }
    (bound, lower) = (float(y) for y in re.findall(r'stroke-dasharray="6 4" d="M\d+ ([\d.]+)H', svg))
    assert bound == pytest.approx(ticks[0.2] + 0.9 * (ticks[0.3] - ticks[0.2]), abs=0.11)
    assert lower == pytest.approx(ticks[0.2], abs=0.11)
    assert "at most 0.29 m/s" in svg
    # a highest speed may be below its lower bound most of the time, so only what is above is shaded
    shades = re.findall(r'<rect x="([\d.]+)" y="([\d.]+)" width="([\d.]+)" height="([\d.]+)" fill="var', svg)
    assert [float(width) > 0.0 for _, _, width, _ in shades] == [True, False]
    # the value at the end counts for a final value
    (_, _, wide, _), _ = re.findall(
        r'<rect x="([\d.]+)" y="([\d.]+)" width="([\d.]+)" height="([\d.]+)" fill="var', found["final_left"]
    )
    assert 0.0 < float(wide) < 20.0


def test_every_measure_has_quantities_to_plot() -> None:
    assert set(measures()) - {"joint_overshoot"} <= set(QUANTITIES_OF)


def test_checks_and_times_have_plots() -> None:
    expect = [
        Check("own", lambda trace: 5.0, max=1.0),
        Settles(0.5),
        Reaches(3.0, 0.0, 0.1, yaw=1.0, before=1.0),
        PassesThrough(0.5, 0.5, 0.1),
        Bound("support/left_wheel", min=1000.0),
        Bound("joint_travel/left_wheel_joint", min=1000.0),
        Bound("stopping_distance", max=0.0),
        Bound("joint_overshoot", min=1.0),
    ]
    scenario = Scenario("all", 2.0, [Step(Command(0.2)), Step(Command(0.3), at=1.0)], expect, KBOT)
    result = run_trial(scenario, with_trace=True)
    found = {chart.title: chart.svg for chart in charts(result, result.measures)}
    missing = {measure.name for measure in result.measures} - set(found)
    assert missing == {"joint_overshoot"}  # KBot's joints have no limits
    assert "at most 0.5 s" in found["settling_time"]
    assert "at most 1 s" in found["arrival_time"]
    assert "nan" not in "".join(found.values())


def test_the_map_shows_the_path_to_scale(results: list[TrialResult]) -> None:
    html = html_report(results[:1])
    numbers = re.findall(r'<text x="([-\d.]+)" y="\d+" text-anchor="middle">([-\d.]+)</text>', html)
    at, metres = np.array(
        numbers[: numbers.index(next(n for n in numbers if n[1] == "1.5")) + 1], dtype=float
    ).T
    scale = (at[-1] - at[0]) / (metres[-1] - metres[0])
    path = re.search(r'<polyline stroke="var\(--plot-1\)"[^>]*points="([^"]*)"', html)
    assert path is not None
    points = np.array([point.split(",") for point in path[1].split()], dtype=float)
    trace = results[0].trace
    assert trace is not None
    assert (points[-1, 0] - points[0, 0]) / scale == pytest.approx(trace["x"][-1] - trace["x"][0], abs=0.01)
    assert (points[0, 1] - points[-1, 1]) / scale == pytest.approx(trace["y"][-1] - trace["y"][0], abs=0.01)
    assert at[0] + (points[0, 0] - at[0]) == pytest.approx(np.interp(trace["x"][0], metres, at), abs=0.2)


@pytest.mark.parametrize(
    ("value", "low", "high", "drawn"),
    [
        (0.5, 0.0, 1.0, "circle"),
        (1.2, 0.0, 1.0, "circle"),
        (50.0, 0.0, 1.0, "path"),
        (-50.0, 0.0, 1.0, "path"),
        (0.0, None, 0.0, "circle"),
        (1e300, None, 1e-300, "path"),
        (math.inf, 1.0, 2.0, "path"),
        (math.nan, 1.0, 2.0, ""),
        (3.0, 2.0, 2.0, "path"),
        (-1.0, -2.0, None, "circle"),
    ],
)
def test_a_bar_shows_the_value_within_its_bounds(
    value: float, low: float | None, high: float | None, drawn: str
) -> None:
    result = TrialResult("bar", 0, (MeasureResult("length", value, "m", low, high),))
    page = Page(html_report([result]))
    places = [float(str(c["cx"])) for c in page.of("circle")]
    assert bool(places) == (drawn == "circle")
    assert bool([a for a in page.of("path") if "fill" in a]) == (drawn == "path")
    (allowed,) = (a for a in page.of("rect") if a.get("fill-opacity") == "0.4")
    begin, width = float(str(allowed["x"])), float(str(allowed["width"]))
    assert 0.0 <= begin <= begin + width <= 210.0
    is_within = bool(places) and begin - 0.1 <= places[0] <= begin + width + 0.1
    assert is_within == (result.passed and bool(places))


def test_a_film_is_shown_and_its_last_picture_without_motion(results: list[TrialResult]) -> None:
    page = Page(html_report([replace(results[0], film=_film())]))
    moving, still = page.of("img")
    with Image.open(io.BytesIO(base64.b64decode(str(moving["src"]).partition(",")[2]))) as image:
        assert image.n_frames == 2
    with Image.open(io.BytesIO(base64.b64decode(str(still["src"]).partition(",")[2]))) as image:
        assert image.convert("RGB").getpixel((2, 2)) == pytest.approx((0, 0, 255), abs=40)
    assert (moving["class"], still["class"]) == ("moving", "still")


def test_a_missing_film_has_its_reason(results: list[TrialResult]) -> None:
    page = Page(html_report([replace(results[0], film_problem="there is no OpenGL")]))
    assert "There is no film: there is no OpenGL." in page.text
    assert "Path" in page.text


def test_a_report_of_many_trials_stays_small(
    results: list[TrialResult], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reports, "MOST_FILM_BYTES", 2 * len(_film()))
    monkeypatch.setattr(reports, "MOST_FAILED", 4)
    monkeypatch.setattr(reports, "MOST_PASSED", 1)
    monkeypatch.setattr(reports, "MOST_TRIALS", 5)
    filmed = replace(results[0], film=_film())
    page = Page(html_report([filmed] * 6 + [results[1]] * 2))
    assert len(list(page.of("article"))) == 5
    assert len(list(page.of("img"))) == 4
    assert "The table shows the first 5 of 8 trials." in page.text
    assert "The first 4 of 6 trials that failed are shown in detail." in page.text
    assert "The first 1 of 2 trials that passed are shown in detail." in page.text
    assert "2 films are not shown, to keep the report small." in page.text


def test_long_names_do_not_make_a_large_report(results: list[TrialResult]) -> None:
    long = "n" * 1_000_000
    trace, around = results[0].trace, results[0].surroundings
    assert trace is not None
    assert around is not None
    measures = (MeasureResult(f"support/{long}", 0.0, "N", 1.0, detail=long), results[0].measures[0])
    hostile = replace(
        results[0],
        name=long,
        robot=long,
        measures=measures,
        trace=replace(trace, support={long: trace["x"]}, events=(Event(1.0, long, "step"),) * 10),
        surroundings=replace(around, world=long, parts=(replace(around.parts[0], name=long),) * 100),
    )
    assert len(html_report([hostile])) < 500_000


def test_a_diverged_run_has_a_report(results: list[TrialResult]) -> None:
    trace = results[0].trace
    assert trace is not None
    columns = {name: values.copy() for name, values in trace.columns.items()}
    for name in ("x", "y", "yaw", "speed", "odometry_x", "odometry_y"):
        columns[name][100:] = np.nan
    html = html_report(
        [replace(results[0], error="the simulation diverged", trace=replace(trace, columns=columns))]
    )
    assert "the simulation diverged" in Page(html).text
    assert "nan" not in html.replace("nano", "")


def test_no_trial_and_all_passed() -> None:
    assert "No trial was run." in Page(html_report([])).text
    assert "All 2 trials passed." in Page(html_report([TrialResult("a", 0), TrialResult("b", 0)])).text


def test_a_file_that_cannot_be_written_is_one_error(tmp_path: Path) -> None:
    with pytest.raises(KbotError, match="missing"):
        write_html(str(tmp_path / "missing" / "report.html"), [])


def _film() -> bytes:
    """Two pictures, the last one blue."""
    packed = io.BytesIO()
    red, blue = (Image.new("RGB", (16, 12), colour) for colour in ("red", "blue"))
    red.save(packed, "WEBP", save_all=True, append_images=[blue], duration=100)
    return packed.getvalue()
