"""The HTML report of trials in a browser: it loads nothing, obeys its own policy, and is accessible."""

import io
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from kbot.trials import Bound, Command, NeverTouches, Reaches, RobotSource, Scenario, Step, run_trial
from kbot.trials.reports.html import write_html

from .axe import violations


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_browser_shows_the_report(scheme: str, tmp_path: Path, browser: Any) -> None:
    file = tmp_path / "report.html"
    steps = [Step(Command(0.3))]
    expect = [NeverTouches(), Reaches(1.8, 0.2, 0.1), Bound("max_speed", 0.2, 0.29)]
    kbot = RobotSource("kbot")
    crash = run_trial(Scenario("crash", 6.0, steps, expect, kbot, "corridor:length=2"), with_trace=True)
    passing = run_trial(Scenario("straight", 1.0, steps, [Bound("final_x", min=0.1)], kbot), with_trace=True)
    packed = io.BytesIO()
    red, blue = (Image.new("RGB", (16, 12), colour) for colour in ("red", "blue"))
    red.save(packed, "WEBP", save_all=True, append_images=[blue], duration=100)
    write_html(str(file), [replace(crash, film=packed.getvalue()), passing])
    context = browser.new_context(color_scheme=scheme, viewport={"width": 1280, "height": 900})
    page = context.new_page()
    complaints: list[str] = []
    requested: list[str] = []
    page.on("console", lambda message: complaints.append(message.text))
    page.on("request", lambda request: requested.append(request.url))
    page.goto(file.as_uri())
    assert page.get_by_role("heading", name="crash", exact=True).is_visible()
    summary = page.locator("article.passed summary")
    chart = page.locator("article.passed figure svg").first
    assert not chart.is_visible()
    summary.focus()
    page.keyboard.press("Enter")
    assert chart.is_visible()
    assert page.locator("img.moving").is_visible()
    assert not page.locator("img.still").is_visible()
    background = page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert (max(map(int, re.findall(r"\d+", background))) < 64) == (scheme == "dark")
    assert violations(page) == []
    page.emulate_media(media="print")
    assert page.locator("img.still").is_visible()
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    page.emulate_media(media="screen")
    page.set_viewport_size({"width": 360, "height": 640})
    assert page.evaluate("document.documentElement.scrollWidth") <= 360
    assert [url for url in requested if not url.startswith(("file:", "data:"))] == []
    assert complaints == []
    context.close()
