"""Topics, plots of their fields, the log, and the world menu."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from kbot.messages import Header, Point, Pose, Quaternion
from kbot.messages.navigation import PoseStamped
from kbot.workbench.session.session import Session

from .conftest import until
from .served import Speaker, state_of

OpenPage = Callable[..., Any]


def opened(page: Any, topic: str) -> Any:
    """Open a topic's row, and return it with its fields."""
    page.get_by_role("button", name="Topics and log", exact=True).click()
    row = page.locator(f"[data-topic='{topic}']")
    until(lambda: row.count() == 1)
    row.locator(".head").click()
    until(lambda: row.locator("dt button").count() > 3)
    return row


def shown(row: Any, field: str) -> float:
    at = row.locator("dt").all_inner_texts().index(field)
    return float(row.locator("dd").nth(at).inner_text() or "nan")


def test_a_topic_shows_its_rate_and_live_fields(driving: tuple[str, Session], open_page: OpenPage) -> None:
    page = open_page(driving[0], viewport={"width": 1200, "height": 900})
    row = opened(page, "/odom")
    assert "Odometry" in row.locator(".type").inner_text()
    until(lambda: row.locator(".rate").inner_text().endswith("Hz"))
    page.keyboard.down("w")
    until(lambda: shown(row, "pose.pose.position.x") > 0.1)
    page.keyboard.up("w")
    until(lambda: abs(shown(row, "twist.twist.linear.x")) < 1e-3)
    until(lambda: abs(shown(row, "pose.pose.position.x") - state_of(driving[1]).odometry[0]) < 1e-3)


ENDS_SEEN = """fields => [...fields.querySelectorAll("bdi")].every((name) => {
  const text = name.firstChild, last = document.createRange();
  last.setStart(text, text.length - 1);
  last.setEnd(text, text.length);
  const [end, cell] = [last.getBoundingClientRect(), name.closest("dt").getBoundingClientRect()];
  return cell.width > 0 && end.left >= cell.left - 1 && end.right <= cell.right + 1;
})"""


def test_long_field_names_are_distinct_beside_the_plots(
    driving: tuple[str, Session], open_page: OpenPage
) -> None:
    page = open_page(driving[0], viewport={"width": 1280, "height": 800})
    row = opened(page, "/odom")
    page.keyboard.press("l")
    until(lambda: page.locator("#plots canvas").count() == 1)
    until(lambda: page.locator(".topics").bounding_box()["width"] >= 16 * 16)
    until(lambda: row.locator(".fields").evaluate(ENDS_SEEN))
    assert row.get_by_title("Plot twist.twist.linear.x:").count() == 1


@pytest.mark.parametrize("how", ["click", "drag"])
def test_a_field_of_a_topic_is_plotted(driving: tuple[str, Session], open_page: OpenPage, how: str) -> None:
    page = open_page(driving[0], viewport={"width": 1200, "height": 900})
    row = opened(page, "/odom")
    field = row.get_by_role("button", name="twist.twist.linear.x", exact=True)
    if how == "click":
        field.click()
    else:
        page.keyboard.press("l")
        field.drag_to(page.locator("#plots .plot"))
    until(lambda: page.get_by_role("button", name="/odom twist.twist.linear.x").count() == 1)
    page.keyboard.down("w")
    until(lambda: state_of(driving[1]).twist[0] > 0.1)
    page.keyboard.up("w")
    until(lambda: state_of(driving[1]).twist[0] == 0.0)
    with page.expect_download() as saved:
        page.get_by_role("button", name="Save the plot").click()
        page.get_by_role("button", name="Save as CSV").click()
    lines = [line.split(",") for line in saved.value.path().read_text().splitlines()]
    column = lines[0].index('"/odom twist.twist.linear.x"')
    own = lines[0].index('"forward speed [m/s]"')
    reported = np.array([[float(line[i]) for i in (0, column, own)] for line in lines[1:]])
    received = reported[~np.isnan(reported[:, 1])]
    assert received[:, 1].max() > 0.1
    for time, value, _ in received:  # the page's own value, current or as of its last message
        near = reported[(reported[:, 0] > time - 0.3) & (reported[:, 0] <= time), 2]
        assert near.min() - 0.01 < value < near.max() + 0.01


def test_the_log_has_refusals_and_results_of_goals(driving: tuple[str, Session], open_page: OpenPage) -> None:
    page = open_page(driving[0], viewport={"width": 1200, "height": 900})
    page.keyboard.press("y")
    log = page.get_by_role("log")
    until(lambda: "World: empty." in log.inner_text())
    page.keyboard.press("b")
    page.get_by_label("What to add").select_option("crate")
    page.locator(".picture canvas").focus()
    page.keyboard.press("Enter")  # at the middle of the picture, where the robot is
    page.keyboard.press("Enter")  # and releases
    until(lambda: "'crate' cannot be placed there: robot 'kbot' is in the way" in log.inner_text())
    page.keyboard.press("g")
    page.locator(".picture canvas").focus()
    page.keyboard.press("Enter")
    page.keyboard.press("Enter")
    until(lambda: "Goal reached" in log.inner_text(), seconds=300)


def test_the_path_to_the_goal_of_another_program_is_shown(
    driving: tuple[str, Session], open_page: OpenPage
) -> None:
    address, session = driving
    page = open_page(address)
    until(lambda: session.topics._wanted.get("/navigation_status"))
    goal = PoseStamped(Header(frame_id="map"), Pose(Point(2.0, 0.0, 0.0), Quaternion()))
    Speaker(session).publish("goal_pose", goal)
    until(lambda: page.locator(".display[data-display=Path] .lamp[data-level=ok]").count() == 1)


def test_a_refused_goal_of_another_program_is_shown_only_in_open_pages(
    driving: tuple[str, Session], open_page: OpenPage
) -> None:
    address, session = driving
    page = open_page(address)
    goal = PoseStamped(Header(frame_id="nowhere"))
    until(lambda: "/navigation_status" in [entry.name for entry in session.topics.topics().topics])
    until(lambda: session.topics._wanted.get("/navigation_status"))
    Speaker(session).publish("goal_pose", goal)  # at once, as the first message to the page
    shown = page.locator(".goal")
    until(
        lambda: (
            shown.is_visible() and "Goal refused: the goal is in the frame 'nowhere'" in shown.inner_text()
        )
    )
    later = open_page(address)
    later.keyboard.press("y")
    until(lambda: "World: empty." in later.get_by_role("log").inner_text())
    until(lambda: later.locator("[data-topic='/navigation_status']").count() == 1)
    assert later.locator(".goal").is_hidden()
    assert "refused" not in later.get_by_role("log").inner_text()


def test_a_topic_has_a_rate_before_it_is_opened(driving: tuple[str, Session], open_page: OpenPage) -> None:
    page = open_page(driving[0], viewport={"width": 1200, "height": 900})
    page.keyboard.press("y")
    rate = page.locator("[data-topic='/odom'] .rate")
    until(lambda: rate.count() == 1 and rate.inner_text() == "50 Hz")
    assert page.locator("[data-topic='/cmd_vel'] .rate").inner_text() == "in"
    assert page.locator("[data-topic='/plan'] .rate").inner_text() == "latched"
    assert "/odom" not in driving[1].topics._subscriptions


def test_a_world_starts_with_other_parameters(driving: tuple[str, Session], open_page: OpenPage) -> None:
    page = open_page(driving[0])
    page.get_by_role("combobox", name="World").select_option("boxes")
    until(lambda: len(driving[1].scene.bodies) == 12)
    page.get_by_role("button", name="World and faults").click()
    page.get_by_label("count", exact=True).fill("5")
    page.get_by_label("seed", exact=True).fill("7")
    page.get_by_role("button", name="Restart", exact=True).click()
    until(lambda: len(driving[1].scene.bodies) == 5)


def test_a_fault_from_the_menu_is_injected(driving: tuple[str, Session], open_page: OpenPage) -> None:
    page, session = open_page(driving[0]), driving[1]
    page.get_by_role("button", name="World and faults").click()
    page.get_by_label("Fault", exact=True).select_option("blocked")
    page.get_by_label("Target", exact=True).select_option("left_wheel_joint")
    page.get_by_label("Seconds", exact=True).fill("600")
    page.get_by_role("button", name="Inject").click()
    page.keyboard.press("Escape")
    until(lambda: not page.locator("#world-menu").is_visible())
    page.keyboard.down("w")
    until(lambda: abs(state_of(session).positions[1]) > 0.5)  # the right wheel turns
    page.keyboard.up("w")
    assert abs(state_of(session).positions[0]) < 0.1
