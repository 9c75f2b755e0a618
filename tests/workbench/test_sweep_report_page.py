"""The HTML report of a sweep in a browser: it loads nothing, obeys its own policy, and is accessible."""

import re
import sys
from pathlib import Path
from typing import Any

import pytest

from kbot.sweep.objectives import Objective
from kbot.sweep.report.html import write_report

from .axe import violations

sys.path.insert(0, str(Path(__file__).parents[1] / "sweep"))
from test_sweep_report import sweep  # the sweep of the report's other tests


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_browser_shows_the_report(scheme: str, tmp_path: Path, browser: Any) -> None:
    file = tmp_path / "report.html"
    with sweep(tmp_path, Objective("energy"), Objective("goal_time")) as made:
        write_report(str(file), made.results())
    context = browser.new_context(color_scheme=scheme, viewport={"width": 1280, "height": 900})
    page = context.new_page()
    complaints: list[str] = []
    requested: list[str] = []
    page.on("console", lambda message: complaints.append(message.text))
    page.on("request", lambda request: requested.append(request.url))
    page.goto(file.as_uri())
    assert page.get_by_role("img", name="Parallel coordinates: one line for each design").is_visible()
    assert page.get_by_role("img", name="goal_time [s] against energy [J]").is_visible()
    background = page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert (max(map(int, re.findall(r"\d+", background))) < 64) == (scheme == "dark")
    assert violations(page) == []
    page.set_viewport_size({"width": 360, "height": 640})
    assert page.evaluate("document.documentElement.scrollWidth") <= 360
    assert [url for url in requested if not url.startswith(("file:", "data:"))] == []
    assert complaints == []
    context.close()
