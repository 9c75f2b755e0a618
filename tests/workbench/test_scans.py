"""What lidars see, in the page."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from kbot.workbench.serve import open_session, serving

from .conftest import until
from .pictures import screenshot

OpenPage = Callable[..., Any]

LIDAR = {"lidar": "true"}


def test_every_point_lies_on_something(xacro: Path) -> None:
    session = open_session(str(xacro), simulate=True, world="boxes", arguments=LIDAR)
    for _ in range(5):
        session.advance(0.1)
    (scan,) = session.scans()
    assert session.scans() == []
    assert scan.link == "lidar_link"
    points = np.array(scan.points).reshape(-1, 3)
    assert len(points) > 20
    middles = np.array([body.position for body in session.scene.bodies])
    # the things are at most 0.18 m wide, so that each point is near the middle of one
    away = np.linalg.norm(points[:, None, :2] - middles[None, :, :2], axis=2).min(axis=1)
    assert away.max() < 0.14
    assert np.linalg.norm(points[:, :2], axis=1).min() > 0.3


def test_a_robot_without_a_lidar_sees_nothing(xacro: Path) -> None:
    session = open_session(str(xacro), simulate=True, world="boxes")
    session.advance(0.1)
    assert session.scans() == []


def test_the_points_are_in_the_picture(xacro: Path, open_page: OpenPage) -> None:
    with serving(open_session(str(xacro), simulate=True, world="boxes", arguments=LIDAR)) as address:
        page = open_page(address)
        page.evaluate("kbot.look([0, -0.01, 5], [0, 0, 0])")
        button = page.locator("[data-option=scan]")
        until(button.is_visible)
        assert red(page) > 60
        button.click()
        assert red(page) == 0
        page.close()


def red(page: Any) -> int:
    r, g, b = (screenshot(page)[..., i].astype(int) for i in range(3))
    return int(((abs(r - 255) < 8) & (abs(g - 77) < 12) & (abs(b - 109) < 12)).sum())
