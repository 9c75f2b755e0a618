"""`sim.plot`, `sim.draw` and printed lines: their topics, their limits, and recordings of them."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kbot.messages.control import Float64
from kbot.messages.log import Log
from kbot.messages.visualization import DELETE_ALL, LINE_STRIP, SPHERE_LIST, TEXT_VIEW_FACING, MarkerArray
from kbot.record import Recorder, Recording
from kbot.record.feed import Feed
from kbot.sim import Simulation
from kbot.sim.drawings import MOST_DRAWINGS, MOST_POINTS
from kbot.sim.plots import MOST
from kbot.text import KbotError


@pytest.fixture
def sim() -> Simulation:
    return Simulation("kbot")


def received(sim: Simulation, topic: str, kind: type) -> list[Any]:
    messages: list[Any] = []
    sim.bus.subscribe(topic, kind, messages.append)
    return messages


def test_a_plotted_value_is_published_on_its_own_topic(sim: Simulation) -> None:
    sim.plot("wall/left", np.float32(0.5))
    values = received(sim, "/plot/wall/left", Float64)
    sim.plot("wall/left", 2)
    assert values == [Float64(0.5), Float64(2.0)]  # the first one is latched


def test_the_distance_to_nothing_is_plotted(sim: Simulation) -> None:
    sim.plot("ahead", math.inf)
    assert received(sim, "/plot/ahead", Float64) == [Float64(math.inf)]


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("a", "fast", "plot 'a': the value must be a number, not 'fast'"),
        ("a", None, "the value must be a number"),
        ("a", 10**400, "is too large"),
        ("to the wall", 1.0, "a plot cannot be called 'to the wall'"),
        ("/a", 1.0, "a plot cannot be called '/a'"),
        ("a/", 1.0, "a plot cannot be called"),
        ("", 1.0, "a plot cannot be called"),
        (3, 1.0, "a plot cannot be called 3"),
    ],
)
def test_invalid_plots_are_refused(sim: Simulation, name: Any, value: Any, message: str) -> None:
    with pytest.raises(KbotError, match=message):
        sim.plot(name, value)


def test_the_number_of_plots_is_limited(sim: Simulation) -> None:
    for number in range(MOST):
        sim.plot(f"a{number}", 1.0)
    with pytest.raises(KbotError, match=f"the limit of {MOST} plots"):
        sim.plot("another", 1.0)


def test_drawings_are_published_together_after_a_step_and_replace_those_of_the_same_name(
    sim: Simulation,
) -> None:
    arrays = received(sim, "/draw", MarkerArray)
    sim.draw.points("goal", [(1.0, 2.0)], color="#ff0000", size=0.1)
    sim.draw.line("way", np.array([[0.0, 0.0, 0.5], [1.0, 1.0, 0.5]]), color=(0.0, 1.0, 0.0, 0.5), width=0.02)
    sim.draw.text("label", (0.0, 0.0, 1.0), 3.5, size=0.2)
    assert arrays == []
    sim.step()
    (array,) = arrays
    clear, goal, way, label = array.markers
    assert clear.action == DELETE_ALL
    assert (goal.ns, goal.type, goal.scale.x, goal.color.r, goal.color.a) == (
        "goal",
        SPHERE_LIST,
        0.1,
        1.0,
        1.0,
    )
    assert [(p.x, p.y, p.z) for p in goal.points] == [(1.0, 2.0, 0.01)]
    assert goal.header.frame_id == "world"
    assert (way.type, way.scale.x, way.color.a, len(way.points)) == (LINE_STRIP, 0.02, 0.5, 2)
    assert (label.type, label.text, label.pose.position.z, label.scale.z) == (
        TEXT_VIEW_FACING,
        "3.5",
        1.0,
        0.2,
    )
    sim.draw.points("goal", (5.0, 5.0, 5.0))
    sim.draw.clear("way")
    sim.draw.clear("unknown")
    sim.step()
    assert [marker.ns for marker in arrays[-1].markers] == ["", "goal", "label"]
    assert arrays[-1].markers[1].points[0].x == 5.0
    sim.step(50)
    assert len(arrays) == 2  # nothing changed
    sim.reset()
    sim.step()
    assert [marker.ns for marker in arrays[-1].markers] == [""]


@pytest.mark.parametrize(
    ("draw", "message"),
    [
        (lambda d: d.points("a", [(math.nan, 0.0)]), "draw 'a': positions must be finite"),
        (lambda d: d.points("a", [(1.0,)]), r"must have the shape \(n, 3\) or \(n, 2\), not \(1, 1\)"),
        (lambda d: d.points("a", "here"), "positions must be x, y, z or a list of them"),
        (lambda d: d.points("a", [(0, 0), (0, 0, 0)]), "positions must be x, y, z or a list of them"),
        (lambda d: d.points("a", np.zeros((MOST_POINTS + 1, 2))), f"the limit is {MOST_POINTS}"),
        (lambda d: d.points("a", [(0, 0)], size=0), "draw 'a': the size must be a finite number above 0"),
        (lambda d: d.points("a", [(0, 0)], color="rd"), "draw 'a': unknown color 'rd'"),
        (lambda d: d.points("a", [(0, 0)], color="ornage"), "did you mean 'orange'"),
        (lambda d: d.points("a", [(0, 0)], color=(2, 0, 0)), "numbers from 0 to 1"),
        (lambda d: d.points("", [(0, 0)]), "a drawing needs a name"),
        (lambda d: d.points(["a"], [(0, 0)]), "a drawing needs a name"),
        (lambda d: d.line("a", [(0, 0)], width=math.inf), "the width must be a finite number"),
        (lambda d: d.text("a", [(0, 0), (1, 1)], "x"), "a text needs one position, not 2"),
        (lambda d: d.text("a", (0, 0), "x" * 501), "at most 500 characters"),
    ],
)
def test_invalid_drawings_are_refused(sim: Simulation, draw: Callable[..., None], message: str) -> None:
    with pytest.raises(KbotError, match=message):
        draw(sim.draw)


def test_the_number_of_drawings_is_limited(sim: Simulation) -> None:
    for number in range(MOST_DRAWINGS):
        sim.draw.points(f"a{number}", [])
    sim.draw.points("a0", [(0, 0)])
    with pytest.raises(KbotError, match=f"the limit is {MOST_DRAWINGS} drawings"):
        sim.draw.points("another", [])


def test_a_recording_contains_all_values_from_the_first_on(sim: Simulation, tmp_path: Path) -> None:
    path = str(tmp_path / "run.mcap")
    with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), path):
        for number in range(3):
            sim.plot("count", number)
            sim.printed.add(f"line {number}")
            sim.step()
    entries = list(Recording(path).entries())
    assert [entry.message().data for entry in entries if entry.topic == "/plot/count"] == [0.0, 1.0, 2.0]
    assert [entry.message().msg for entry in entries if entry.topic == "/log"] == [
        "line 0",
        "line 1",
        "line 2",
    ]


def test_only_one_plot_is_recorded(sim: Simulation, tmp_path: Path) -> None:
    path = str(tmp_path / "run.mcap")
    feed = Feed(sim.bus, lambda: sim.clock.nanoseconds)
    with Recorder(sim, feed, path, topics=["/plot/count"]):
        sim.plot("other", 1.0)
        sim.plot("count", 2.0)
        sim.step()
    assert {entry.topic for entry in Recording(path).entries()} >= {"/plot/count"}
    assert "/plot/other" not in {entry.topic for entry in Recording(path).entries()}


def test_a_printed_line_has_the_simulated_time(sim: Simulation) -> None:
    sim.step(500)
    sim.printed.add("x" * 3000)
    (line,) = received(sim, "/log", Log)
    assert (line.stamp.sec, line.level, len(line.msg)) == (1, 20, 2000)


def test_an_unknown_robot_is_reported_with_the_names(sim: Simulation) -> None:
    with pytest.raises(KbotError, match="unknown robot 'kbt': did you mean 'kbot'") as caught:
        sim.robots["kbt"]
    assert str(caught.value).startswith("unknown robot")
    assert "other" not in sim.robots
    assert sim.robots.get("other") is None
