"""Recordings in the page: their plots, and the rates of their topics."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kbot.record import Recorder
from kbot.record.feed import Feed
from kbot.sim import Simulation
from kbot.workbench.session.played_session import played_session
from kbot.workbench.session.session import Session

from .conftest import until
from .served import run_between_steps, served
from .test_page_plot_time import WIDE, click, line, once, open_plots, plot

OpenPage = Callable[..., Any]


@pytest.fixture
def played(tmp_path: Path) -> Session:
    """Six seconds: at rest, driving, at rest."""
    sim = Simulation("kbot")
    with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), str(tmp_path / "run.mcap")):
        for speed in (0.0, 0.25, 0.0):
            sim.cmd_vel(speed, 0.0)
            sim.run(2.0)
    session = played_session(str(tmp_path / "run.mcap"))
    session.paused = True
    return session


def test_a_whole_recording_is_plotted(played: Session, open_page: OpenPage) -> None:
    with served(played) as address:
        page = open_page(address, viewport=WIDE)
        open_plots(page)
        page.get_by_label("Plot another field").select_option("left_wheel_joint")
        rows = once(page, lambda rows: len(rows) > 200)
        assert np.ptp(rows[:, 0]) == pytest.approx(6.0, abs=0.1)
        driving = (rows[:, 0] > 2.5) & (rows[:, 0] < 3.9)
        assert np.allclose(rows[driving, 1], 0.25, atol=0.01)
        assert np.allclose(rows[rows[:, 0] < 1.9, 1], 0.0, atol=0.01)
        assert rows[-1, -1] * 0.035 == pytest.approx(0.25 * 2.0, abs=0.03)  # wheel's angle times its radius
        assert page.get_by_role("option", name="commanded forward speed").count() == 0
        slider = page.get_by_role("slider", name="Time shown").bounding_box()
        for part in np.linspace(0.9, 0.25, 12):  # the cursor goes to the last of many clicks
            page.mouse.click(slider["x"] + slider["width"] * part, slider["y"] + slider["height"] / 2)
        until(lambda: run_between_steps(played, played.timeline).at == pytest.approx(1.5, abs=0.1))
        until(lambda: abs(line(page).bounding_box()["x"] - plot(page)["x"] - plot(page)["width"] / 4) < 12)
        click(page, 0.5)
        until(lambda: run_between_steps(played, played.timeline).at == pytest.approx(3.0, abs=0.1))
        until(lambda: abs(line(page).bounding_box()["x"] - plot(page)["x"] - plot(page)["width"] / 2) < 6)


def test_topics_of_a_recording_have_mean_rates_from_the_start(played: Session, open_page: OpenPage) -> None:
    with served(played) as address:
        page = open_page(address, viewport=WIDE)
        page.keyboard.press("y")
        rate = page.locator("[data-topic='/odom'] .rate")
        until(lambda: rate.count() == 1 and rate.inner_text() == "50 Hz")
        once = page.locator("[data-topic='/robot_description'] .rate")
        assert once.inner_text() == "\u2013"
        assert "Published once" in once.get_attribute("title")
        page.locator("[data-topic='/odom'] .head").click()
        moment = page.get_by_role("slider", name="Time shown")
        for _ in range(3):
            moment.press("ArrowRight")
        until(lambda: page.locator("[data-topic='/odom'] dt button").count() > 3)
        assert rate.inner_text() == "50 Hz"
