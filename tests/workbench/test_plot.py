"""Plots as SVG: curves are where their numbers are."""

import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest

from kbot.cli.main import run
from kbot.record import Recorder
from kbot.record.feed import Feed
from kbot.render.plot import Curve, plot_svg, round_ticks
from kbot.sim import Simulation

SVG = "{http://www.w3.org/2000/svg}"


def points(svg: str, name: str) -> np.ndarray:
    """Return the points of a curve in pixels, (n, 2)."""
    path = next(p for p in ElementTree.fromstring(svg).iter(f"{SVG}path") if p.get("id") == name)
    return np.array(re.findall(r"[ML]([-\d.]+) ([-\d.]+)", str(path.get("d"))), dtype=float)


def ticks(svg: str, axis: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the numbers at an axis, and their positions in pixels."""
    texts = ElementTree.fromstring(svg).iter(f"{SVG}text")
    anchor, place = {"x": ("middle", "x"), "y": ("end", "y")}[axis]
    found = [
        (float(str(t.text)), float(str(t.get(place))))
        for t in texts
        if t.get("text-anchor") == anchor and t.text != "time [s]"
    ]
    numbers, places = np.array(found).T
    return numbers, places


def test_a_curve_matches_its_axes() -> None:
    time = np.linspace(0.0, 6.0, 61)
    svg = plot_svg(time.tolist(), [Curve("sine [m]", np.sin(time).tolist())], 800, 400)
    drawn = points(svg, "sine [m]")
    numbers, places = ticks(svg, "x")
    assert np.allclose(drawn[:, 0], np.interp(time, numbers, places), atol=0.1)
    numbers, places = ticks(svg, "y")
    slope, start = np.polyfit(numbers, places, 1)
    assert np.allclose(drawn[:, 1], start + slope * np.sin(time), atol=0.1)
    assert slope < 0  # larger values are higher


def test_a_curve_breaks_at_missing_values_and_where_time_goes_back() -> None:
    svg = plot_svg([0, 1, 2, 3, 0, 1], [Curve("a", [1, 2, None, 2, 1, 1])], 300, 200)
    assert re.search(r'id="a"[^>]* d="M[^ML]*L[^ML]*M[^ML]*M[^ML]*L[^ML]*"', svg)


@pytest.mark.parametrize("values", [[], [None, None], [5.0, 5.0], [0.0, 0.0], [1e300, -1e300]])
def test_plots_of_few_or_equal_values_are_valid(values: list[float | None]) -> None:
    svg = plot_svg([float(n) for n in range(len(values))], [Curve('<a> & "b"', values)], 300, 200)
    assert ElementTree.fromstring(svg).find(f"{SVG}title").text == '<a> & "b" against time'
    assert "nan" not in svg


@pytest.mark.parametrize(
    ("low", "high", "most", "expected"),
    [
        (0.0, 10.0, 5, [0, 2, 4, 6, 8, 10]),
        (-0.31, 0.3, 6, [-0.2, 0, 0.2]),
        (99.0, 101.0, 4, [99, 99.5, 100, 100.5, 101]),
    ],
)
def test_ticks_are_round(low: float, high: float, most: float, expected: list[float]) -> None:
    assert round_ticks(low, high, most) == pytest.approx(expected)


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("run") / "run.mcap"
    sim = Simulation("kbot")
    sim.cmd_vel(0.2, 0.0)
    with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), str(path)):
        sim.run(2.0)
    return path


def test_a_topic_of_a_recording_is_plotted(recording: Path, tmp_path: Path) -> None:
    out = tmp_path / "way.svg"
    words = ["--topic", "/odom", "--field", "pose.pose.position.x", "-o", str(out)]
    assert run(["bag", "export", str(recording), *words]) == 0
    svg = out.read_text()
    drawn = points(svg, "pose.pose.position.x")
    numbers, places = ticks(svg, "y")
    slope, start = np.polyfit(numbers, places, 1)
    way = (drawn[:, 1] - start) / slope
    assert len(drawn) == 100
    assert way[0] == pytest.approx(0.0, abs=0.01)
    assert way[-1] == pytest.approx(0.2 * 2.0, abs=0.04)  # less the acceleration
    assert (np.diff(way) > -1e-3).all()


def test_a_table_can_have_selected_columns(recording: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["bag", "export", str(recording), "--topic", "/odom", "--field", "pose.pose.position.x"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "time,pose.pose.position.x"
    assert {len(line.split(",")) for line in lines} == {2}


@pytest.mark.parametrize(
    ("words", "reported"),
    [
        (["--to", "svg"], "a plot needs --field NAME. The numeric fields of /odom: "),
        (["--field", "pose.pose.positon.x"], "did you mean 'pose.pose.position.x'"),
        (["--field", "header.frame_id", "--to", "svg"], "is text: only numbers can be plotted"),
        (
            ["--field", "pose.pose.position.x", "--to", "svg", "--size", "wide"],
            "1280x720, not 'wide'",
        ),
        (["--field", "pose.pose.position.x", "--to", "svg", "--size", "900x20"], "at least 200 pixels"),
    ],
)
def test_an_impossible_plot_is_one_clear_error(
    recording: Path, capsys: pytest.CaptureFixture[str], words: list[str], reported: str
) -> None:
    assert run(["bag", "export", str(recording), "--topic", "/odom", *words]) == 2
    assert reported in capsys.readouterr().err
