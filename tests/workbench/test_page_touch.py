"""The page with one finger and with two."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from kbot.messages.navigation import PoseStamped
from kbot.workbench.session.session import Session

from .conftest import until
from .served import collect, state_of
from .test_page_tools import at, from_above, tool

OpenPage = Callable[..., Any]
Point = tuple[float, float]
PHONE = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}


class Fingers:
    """Fingers on the page, as events of a touch screen."""

    def __init__(self, page: Any) -> None:
        self._session = page.context.new_cdp_session(page)

    def down(self, *points: Point) -> None:
        self._send("touchStart", points)

    def move(self, *points: Point) -> None:
        self._send("touchMove", points)

    def up(self) -> None:
        self._send("touchEnd", ())

    def tap(self, point: Point) -> None:
        self.down(point)
        self.up()

    def _send(self, kind: str, points: tuple[Point, ...]) -> None:
        touches = [{"x": x, "y": y, "id": number} for number, (x, y) in enumerate(points)]
        self._session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": touches})


@pytest.fixture
def phone(driving: tuple[str, Session], open_page: OpenPage) -> tuple[Any, Fingers, Session]:
    page = open_page(driving[0], **PHONE)
    return page, Fingers(page), driving[1]


def eye(page: Any) -> np.ndarray:
    """Return the position of a perspective camera in the world."""
    page.evaluate("kbot.drawn()")
    clip = np.array(page.evaluate("kbot.camera()")["clipFromWorld"]).reshape(4, 4)
    # the eye has no place in the picture: x, y and w are 0 there
    place: np.ndarray = np.linalg.solve(clip[[0, 1, 3], :3], -clip[[0, 1, 3], 3])
    return place


def test_a_goal_is_set_by_touch(phone: tuple[Any, Fingers, Session]) -> None:
    page, fingers, session = phone
    received = collect(session, "goal_pose", PoseStamped)
    from_above(page, "kbot.look([0, -0.001, 2], [0, 0, 0])")
    tool(page, "2D goal").tap()
    fingers.down(at(page, 0.1, 0.1))
    fingers.move(at(page, 0.1, 0.0))
    fingers.move(at(page, 0.1, -0.1))
    fingers.up()
    until(lambda: received)
    pose = received[0].pose
    assert (pose.position.x, pose.position.y) == pytest.approx((0.1, 0.1), abs=0.01)
    yaw = 2 * np.arctan2(pose.orientation.z, pose.orientation.w)
    assert yaw == pytest.approx(-np.pi / 2, abs=0.05)
    until(lambda: page.locator(".goal").is_visible())


def test_two_taps_measure_a_distance(phone: tuple[Any, Fingers, Session]) -> None:
    page, fingers, session = phone
    session.paused = True
    from_above(page, "kbot.look([0, -0.001, 2], [0, 0, 0])")
    tool(page, "Measure").tap()
    fingers.tap(at(page, -0.1, 0.2))
    fingers.tap(at(page, 0.2, 0.2))
    label = page.locator(".measure")
    until(lambda: label.count() == 1)
    assert float(label.inner_text().removesuffix(" m")) == pytest.approx(0.3, rel=0.02)


def test_one_finger_turns_the_view_and_two_zoom(phone: tuple[Any, Fingers, Session]) -> None:
    page, fingers, session = phone
    session.paused = True
    from_above(page, "kbot.look([1, -1, 1], [0, 0, 0])")
    box = page.locator(".picture canvas").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] * 0.7
    before = eye(page)
    fingers.down((x, y))
    for step in range(1, 6):
        fingers.move((x - 12 * step, y))
    fingers.up()

    def turned() -> float:
        now = eye(page)
        return float(np.degrees(np.arctan2(now[1], now[0]) - np.arctan2(before[1], before[0])))

    until(lambda: turned() > 10)  # dragging left shows more of its right side
    assert np.linalg.norm(eye(page)) == pytest.approx(np.linalg.norm(before), rel=0.05)
    far = np.linalg.norm(eye(page))
    fingers.down((x - 20, y), (x + 20, y))
    for step in range(1, 6):
        fingers.move((x - 20 - 8 * step, y), (x + 20 + 8 * step, y))
    fingers.up()
    until(lambda: np.linalg.norm(eye(page)) < 0.6 * far)


def test_the_pad_drives_while_it_is_touched(phone: tuple[Any, Fingers, Session]) -> None:
    page, fingers, session = phone
    pad = page.locator(".pad")
    pad.scroll_into_view_if_needed()
    box = pad.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    fingers.down((x, y))
    fingers.move((x, y - box["height"] * 0.4))
    until(lambda: state_of(session).command[0] > 0)
    assert state_of(session).command[1] == 0
    fingers.move((x - box["width"] * 0.4, y))
    until(lambda: state_of(session).command[1] > 0 and state_of(session).command[0] == 0)  # turning left
    fingers.up()
    until(lambda: state_of(session).command == (0.0, 0.0))
    assert page.evaluate("scrollY") == 0
