"""The tools of the page, used like a user does: by mouse, touch and keyboard."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kbot.messages.navigation import PoseWithCovarianceStamped
from kbot.messages.visualization import PointStamped
from kbot.workbench.serve import open_session
from kbot.workbench.session.session import Session

from .conftest import until
from .pictures import blue, middle, screenshot
from .served import collect, served, state_of

OpenPage = Callable[..., Any]
FROM_ABOVE = "kbot.look([0.6, 0.5999, 3.6], [0.6, 0.6, 0])"
ARROW = (46, 204, 113)


@pytest.fixture
def maze(xacro: Path) -> Iterator[tuple[str, Session]]:
    session = open_session(str(xacro), simulate=True, world="maze:size=3,seed=3", seed=1)
    with served(session) as address:
        yield address, session


def from_above(page: Any, look: str = FROM_ABOVE) -> None:
    """Set a fixed view from above. A view of a whole maze does not follow the robot from the start."""
    if page.locator("[data-option=follow]").get_attribute("aria-pressed") == "true":
        page.keyboard.press("8")
    page.evaluate("document.querySelector('.drive-hint')?.remove()")  # it covers a part of the picture
    page.evaluate(look)
    page.evaluate("kbot.drawn()")


def at(page: Any, x: float, y: float, z: float = 0.0) -> tuple[float, float]:
    """Return where a place of the world is on the page."""
    camera = page.evaluate("kbot.camera()")
    seen = np.array(camera["clipFromWorld"]).reshape(4, 4) @ (x, y, z, 1.0)
    box = page.locator(".picture canvas").bounding_box()
    return (
        box["x"] + (seen[0] / seen[3] + 1) / 2 * box["width"],
        box["y"] + (1 - seen[1] / seen[3]) / 2 * box["height"],
    )


def drag(page: Any, start: tuple[float, float], end: tuple[float, float]) -> None:
    page.mouse.move(*start)
    page.mouse.down()
    page.mouse.move(*end, steps=4)
    page.mouse.up()


def tool(page: Any, name: str) -> Any:
    return page.get_by_role("button", name=name, exact=True)


def pose(session: Session) -> tuple[float, float, float]:
    """Return the position of the robot's root, and its heading."""
    x, y, _, _, _, qz, qw = state_of(session).poses[:7]
    return x, y, 2 * float(np.arctan2(qz, qw))


def test_a_clicked_goal_is_reached_through_a_maze(maze: tuple[str, Session], open_page: OpenPage) -> None:
    address, session = maze
    page = open_page(address)
    from_above(page)
    tool(page, "2D goal").click()
    goal = at(page, 1.2, 1.2)
    page.mouse.move(*goal)
    page.mouse.down()
    page.mouse.move(*at(page, 1.2, 1.5), steps=4)
    # the goal's heading
    until(lambda: (np.abs(screenshot(page).astype(int) - ARROW).max(axis=2) < 60).sum() > 100)
    page.mouse.up()
    until(lambda: tool(page, "Interact").get_attribute("aria-pressed") == "true")
    until(lambda: page.locator(".goal").inner_text().startswith("Driving to the goal"))
    for kind in ("Path", "Pose"):
        until(lambda kind=kind: page.locator(f".display[data-display={kind}] .lamp[data-level=ok]").count())
    session.speed = 5.0
    until(lambda: page.locator(".goal").inner_text().startswith("Goal reached"), seconds=300)
    x, y, yaw = pose(session)
    assert np.hypot(x - 1.2, y - 1.2) < 0.03
    assert abs(yaw - np.pi / 2) < 0.1
    wait_for_current_picture(page, session)
    column, row = middle(blue(screenshot(page)))
    box = page.locator(".picture").bounding_box()
    # and the picture shows it there
    assert np.hypot(box["x"] + column - goal[0], box["y"] + row - goal[1]) < 12


def test_a_goal_is_cancelled(maze: tuple[str, Session], open_page: OpenPage) -> None:
    page = open_page(maze[0])
    from_above(page)
    page.keyboard.press("g")
    page.mouse.click(*at(page, 1.2, 1.2))
    until(lambda: page.locator(".goal").inner_text().startswith("Driving"))
    page.locator(".goal").get_by_role("button", name="Cancel").click()
    until(lambda: "Goal cancelled: cancelled by its sender" in page.locator(".goal").inner_text())
    until(lambda: state_of(maze[1]).command == (0.0, 0.0))


def test_a_pose_estimate_by_touch_moves_the_robot(driving: tuple[str, Session], open_page: OpenPage) -> None:
    address, session = driving
    page = open_page(address, viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True)
    received = collect(session, "initialpose", PoseWithCovarianceStamped)
    from_above(page, "kbot.look([0.2, 0.1999, 2], [0.2, 0.2, 0])")
    tool(page, "2D pose estimate").tap()
    touch = page.context.new_cdp_session(page)
    for kind, place in (("touchStart", (0.3, 0.2)), ("touchMove", (0.1, 0.2)), ("touchEnd", None)):
        points = [dict(zip("xy", at(page, *place), strict=True))] if place else []
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    until(lambda: len(received) == 1)
    _, y, yaw = until(lambda: pose(session) if abs(pose(session)[0] - 0.3) < 0.02 else None)
    assert abs(y - 0.2) < 0.02
    assert abs(abs(yaw) - np.pi) < 0.15
    assert received[0].header.frame_id == "world"


def test_a_clicked_point_is_on_the_surface(maze: tuple[str, Session], open_page: OpenPage) -> None:
    address, session = maze
    session.paused = True
    page = open_page(address, viewport={"width": 1180, "height": 720})  # nothing covers the robot
    received = collect(session, "clicked_point", PointStamped)
    from_above(page)
    for place in ((0.6, 0.6, 0.0), (0.0, 0.0, top_of_plate(session))):
        page.keyboard.press("u")
        page.mouse.click(*at(page, *place))
    until(lambda: len(received) == 2)
    assert (received[0].point.x, received[0].point.y, received[0].point.z) == pytest.approx(
        (0.6, 0.6, 0.0), abs=0.008
    )
    assert received[1].point.z == pytest.approx(top_of_plate(session), abs=1e-3)


def wait_for_current_picture(page: Any, session: Session) -> None:
    """Wait until the picture shows the current state."""
    now = state_of(session).time
    until(lambda: page.evaluate("kbot.time") >= round(now, 6))
    page.evaluate("kbot.drawn()")


def top_of_plate(session: Session) -> float:
    (plate,) = (link for link in session.scene.links if link.name == "base_link")
    index = [link.name for link in session.scene.links].index("base_link")
    shape = plate.visuals[0]
    return state_of(session).poses[index * 7 + 2] + shape.position[2] + shape.size[2] / 2


def test_distances_and_an_angle_are_measured_and_drawn(
    driving: tuple[str, Session], open_page: OpenPage
) -> None:
    address, session = driving
    session.paused = True
    page = open_page(address)
    from_above(page, "kbot.look([0.5, 0.4999, 3], [0.5, 0.5, 0])")
    before = screenshot(page).astype(int)
    page.keyboard.press("m")
    for place in ((0.2, 0.6), (0.8, 0.6), (0.8, 0.2)):
        page.mouse.click(*at(page, *place))
    labels = until(
        lambda: page.locator(".measure").count() == 3 and page.locator(".measure").all_inner_texts()
    )
    numbers = [float(re.sub(r"[^\d.]", "", text)) for text in labels]
    assert numbers == pytest.approx([0.6, 0.4, 90.0], rel=0.02)
    assert labels[0].endswith(" m")
    assert labels[2].endswith("°")
    box = page.locator(".picture").bounding_box()
    x, y = at(page, 0.35, 0.6)
    row, column = round(y - box["y"]), round(x - box["x"])
    line = screenshot(page).astype(int)[row - 2 : row + 3, column]
    assert np.abs(line - before[row - 2 : row + 3, column]).max() > 80
    tool(page, "Interact").click()
    until(lambda: page.locator(".measure").count() == 0)
    assert (
        np.abs(
            screenshot(page).astype(int)[row - 2 : row + 3, column] - before[row - 2 : row + 3, column]
        ).max()
        < 10
    )


def test_a_focused_place_is_in_the_middle(viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    from_above(page, "kbot.look([0, -0.5, 1], [0, 0, 0])")
    wanted = (0.1, 0.05, -0.035)
    page.keyboard.press("c")
    page.mouse.click(*at(page, *wanted))
    box = page.locator(".picture canvas").bounding_box()
    middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    until(lambda: np.hypot(*np.subtract(at(page, *wanted), middle)) < 15)


def test_an_object_is_added_selected_moved_and_deleted(
    driving: tuple[str, Session], open_page: OpenPage
) -> None:
    address, session = driving
    page, other = open_page(address), open_page(address)
    from_above(page, "kbot.look([0.3, 0.2999, 3], [0.3, 0.3, 0])")
    revision = page.evaluate("kbot.revision")
    page.keyboard.press("b")
    page.get_by_label("What to add").select_option("crate")
    page.mouse.click(*at(page, 0.4, 0.4))
    for tab in (page, other):
        until(lambda tab=tab: tab.evaluate("kbot.revision") == revision + 1)
    until(lambda: abs(state_of(session).bodies[2]) < 1e-3)  # it has fallen to the ground
    assert state_of(session).bodies[:2] == pytest.approx((0.4, 0.4), abs=0.02)
    page.keyboard.press("v")
    wait_for_current_picture(page, session)
    drag(page, at(page, 0.4, 0.4, 0.2), at(page, 0.7, 0.4, 0.2))
    until(lambda: abs(state_of(session).bodies[0] - 0.7) < 0.03)
    drag(page, at(page, 0.0, 0.0, 0.02), at(page, 0.3, 0.0, 0.02))
    until(lambda: abs(pose(session)[0] - 0.3) < 0.03)
    page.keyboard.press("Escape")
    wait_for_current_picture(page, session)
    page.mouse.click(*at(page, 0.7, 0.4, 0.2))
    until(lambda: page.locator(".chosen").inner_text().startswith("crate_1"))
    page.keyboard.press("Delete")
    until(lambda: not state_of(session).bodies and not page.locator(".chosen").is_visible())


def test_another_robot_is_added_and_deleted(driving: tuple[str, Session], open_page: OpenPage) -> None:
    address, session = driving
    page = open_page(address)
    from_above(page, "kbot.look([0.3, 0.2999, 2.5], [0.3, 0.3, 0])")
    entry = blue(screenshot(page)).sum()
    page.keyboard.press("b")
    page.get_by_label("What to add").select_option("robot")
    page.mouse.click(*at(page, 0.5, 0.5))
    until(lambda: "robot_2/base_link" in [body.name for body in session.scene.bodies])
    until(lambda: abs(blue(screenshot(page)).sum() - 2 * entry) < 0.3 * entry)
    page.keyboard.press("Escape")
    page.mouse.click(*at(page, 0.5, 0.5, 0.02))
    page.locator(".chosen").get_by_role("button", name="Delete").click()
    until(lambda: abs(blue(screenshot(page)).sum() - entry) < 0.1 * entry)


def test_a_tool_works_by_keyboard(driving: tuple[str, Session], open_page: OpenPage) -> None:
    address, session = driving
    session.paused = True
    page = open_page(address)
    received = collect(session, "clicked_point", PointStamped)
    from_above(page, "kbot.look([0.5, 0.2, 2], [0.5, 0.3, 0])")
    page.keyboard.press("u")
    page.locator(".picture canvas").focus()
    page.keyboard.press("Enter")
    until(lambda: len(received) == 1)
    assert (received[0].point.x, received[0].point.y) == pytest.approx((0.5, 0.3), abs=0.01)
    page.keyboard.press("g")
    until(lambda: page.locator(".hint").is_visible())
    page.keyboard.press("Escape")
    until(lambda: not page.locator(".hint").is_visible())
