"""Quick steps add up, and the last request wins, however late the answers are."""

import asyncio
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from kbot.workbench.protocol import AskSeries, Timeline
from kbot.workbench.serving.hub import Client
from kbot.workbench.serving.plotting import Plotting, Request
from kbot.workbench.session.session import Session

from .conftest import until
from .served import run_between_steps, served, state_of
from .test_page_authoring import length_in_source
from .test_page_plot_recording import played
from .test_page_plot_time import WIDE, at_line, is_past, line, open_plots, page, plot, shown, table

__all__ = ["page", "played"]

OpenPage = Callable[..., Any]


def test_quick_key_presses_in_the_plot_add_up(page: Any) -> None:
    shown(page, page.began + 0.2)
    line(page).focus()
    page.keyboard.press("Home")
    until(lambda: is_past(page))
    low, high = at_line(page), float(line(page).get_attribute("aria-valuemax"))
    for _ in range(5):  # each by a tenth of the displayed range
        page.keyboard.press("PageUp")
    until(lambda: at_line(page) == pytest.approx((low + high) / 2, abs=0.02))
    until(
        lambda: (
            state_of(page.session).at - page.evaluate("kbot.time") == pytest.approx((high - low) / 2, abs=0.2)
        )
    )


def test_a_double_click_in_the_plot_stays_in_the_present(page: Any) -> None:
    shown(page, page.began + 0.2)
    page.keyboard.press("p")
    until(lambda: page.inner_text(".rate") != "paused")
    box = plot(page)
    page.mouse.dblclick(box["x"] + box["width"] / 2, box["y"] + 20)
    time = state_of(page.session).time
    until(lambda: page.evaluate("kbot.time") > time + 0.5)
    assert not is_past(page)


def test_a_step_back_works_with_a_late_timeline(
    driving: tuple[str, Session], open_page: OpenPage, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = open_page(driving[0])
    slider = page.get_by_role("slider", name="Time shown")
    until(lambda: float(slider.evaluate("s => s.max")) > 0.5)
    put_timeline = Client.put_timeline

    def put_answers_alone(self: Client, timeline: Timeline) -> None:
        if timeline.asked is not None:
            put_timeline(self, timeline)

    monkeypatch.setattr(Client, "put_timeline", put_answers_alone)
    now = page.evaluate("kbot.time")
    until(lambda: page.evaluate("kbot.time") > now + 1.0)
    slider.press("ArrowLeft")
    until(lambda: is_past(page))


def test_a_slow_answer_is_awaited_while_time_continues(
    driving: tuple[str, Session], open_page: OpenPage, monkeypatch: pytest.MonkeyPatch
) -> None:
    address = driving[0]
    answer = Plotting._answer

    async def answer_late(self: Plotting, client: Client, what: Request) -> None:
        if isinstance(what, AskSeries):
            await asyncio.sleep(3.0)
        await answer(self, client, what)

    monkeypatch.setattr(Plotting, "_answer", answer_late)
    page = open_page(address, viewport=WIDE)
    open_plots(page)
    until(lambda: len(table(page)) > 20)


def test_a_step_starts_from_the_playback_position(played: Session, open_page: OpenPage) -> None:
    played.speed = 0.5
    with served(played) as address:
        page = open_page(address, viewport=WIDE)
        page.keyboard.press("p")
        until(lambda: page.get_by_role("button", name="Pause").is_visible())
        slider = page.get_by_role("slider", name="Time shown")
        box = slider.bounding_box()
        page.mouse.click(box["x"] + box["width"] * 0.2, box["y"] + box["height"] / 2)
        until(lambda: 1.6 < run_between_steps(played, played.timeline).at < 5.0)
        played.paused = True
        at = run_between_steps(played, played.timeline).at
        until(lambda: slider.evaluate("s => s.valueAsNumber") == pytest.approx(at, abs=0.01))
        page.keyboard.press("ArrowRight")
        until(lambda: run_between_steps(played, played.timeline).at == pytest.approx(at + 0.1, abs=0.02))


def test_quick_key_presses_on_a_joint_add_up(viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    slider = page.get_by_label("left_wheel_joint", exact=True)
    degrees = page.get_by_label("left_wheel_joint in degrees")
    slider.focus()
    page.keyboard.press("ArrowRight")
    entry = until(lambda: float(degrees.input_value()))
    page.keyboard.press("ArrowLeft")
    until(lambda: float(degrees.input_value()) == 0.0)
    for _ in range(20):
        page.keyboard.press("ArrowRight")
    until(lambda: float(degrees.input_value()) == pytest.approx(20 * entry, abs=1.1))
    until(
        lambda: (
            slider.evaluate("s => s.valueAsNumber")
            == pytest.approx(float(degrees.input_value()) * 0.0174533, abs=2e-3)
        )
    )


def test_typed_text_is_kept_when_another_tab_changes_something(
    xacro: Path, viewing: str, open_page: OpenPage
) -> None:
    page, other = open_page(viewing), open_page(viewing)
    number = length_in_source(page)
    number.dblclick()
    page.keyboard.type("0.2")
    revision = page.evaluate("kbot.revision")
    other.get_by_label("wheel_radius", exact=True).fill("0.05")
    until(lambda: page.evaluate("kbot.revision") > revision)
    page.keyboard.type("6")
    page.keyboard.press("Enter")
    until(lambda: '"base_len" default="0.26"' in xacro.read_text())
