"""The displayed world: its parameters, notices, and falling objects."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kbot.text import KbotError
from kbot.workbench.protocol import Delete, MoveModel, Spawn
from kbot.workbench.serve import open_session
from kbot.workbench.session.session import Session

from .conftest import until
from .served import do, served, state_of

OpenPage = Callable[..., Any]


@pytest.fixture
def boxes() -> Iterator[tuple[str, Session]]:
    session = open_session("kbot", simulate=True, world="boxes:count=20")
    with served(session) as address:
        yield address, session


def test_the_world_menu_shows_the_parameters_of_the_run(
    boxes: tuple[str, Session], open_page: OpenPage
) -> None:
    page = open_page(boxes[0])
    menu = page.locator("#world-menu")
    page.get_by_role("button", name="World and faults").click()
    until(lambda: menu.get_by_label("count").input_value() == "20")
    assert menu.get_by_label("spread").input_value() == "1.6"  # the default
    menu.get_by_label("count").fill("3")
    menu.get_by_role("button", name="Restart", exact=True).click()
    until(lambda: len(boxes[1].scene.bodies) == 3)
    until(lambda: menu.get_by_label("count").input_value() == "3")
    page.get_by_label("World", exact=True).select_option("maze")
    until(lambda: menu.get_by_label("size").count() == 1)
    page.get_by_label("World", exact=True).select_option("boxes")
    until(lambda: menu.get_by_label("count").count() == 1)
    assert menu.get_by_label("count").input_value() == "12"


@pytest.mark.parametrize("width", [390, 960, 1280])
def test_notices_cover_no_button(viewing: str, open_page: OpenPage, width: int) -> None:
    page = open_page(viewing, viewport={"width": width, "height": 700})
    sheet = page.locator(".sheets").get_by_role("button", name="Displays")
    if sheet.is_visible():
        sheet.click()
    with page.expect_download():
        page.get_by_label("Display settings").select_option("kbot")
    notice = page.locator(".notices .info")
    until(notice.is_visible)
    box = notice.bounding_box()
    for button in page.locator(".centre button:visible, .centre summary:visible").all():
        other = button.bounding_box()
        apart = any(
            entry[along] + entry[size] <= two[along]
            for along, size in (("x", "width"), ("y", "height"))
            for entry, two in ((box, other), (other, box))
        )
        assert apart, button.get_attribute("aria-label") or button.inner_text()


ISLAND = """<sdf version="1.7"><world name="island">
<model name="floor"><static>true</static><link name="link">
  <pose>0 0 -0.05 0 0 0</pose>
  <collision name="c"><geometry><box><size>2 2 0.1</size></box></geometry></collision>
  <visual name="v"><geometry><box><size>2 2 0.1</size></box></geometry></visual>
</link></model></world></sdf>"""


@pytest.fixture
def island(tmp_path: Path) -> Iterator[tuple[str, Session]]:
    """A floor of 2 by 2 m with nothing beneath."""
    file = tmp_path / "island.sdf"
    file.write_text(ISLAND)
    session = open_session("kbot", simulate=True, world=str(file))
    with served(session) as address:
        yield address, session


def test_fallen_objects_are_reported_and_the_view_does_not_follow(
    island: tuple[str, Session], open_page: OpenPage
) -> None:
    address, session = island
    page = open_page(address)
    until(lambda: state_of(session).time > 1.0)  # the robot has settled
    start = page.evaluate("kbot.camera().clipFromWorld")
    lamp = page.locator(".display[data-display=World] .lamp")
    assert lamp.get_attribute("aria-label") == "fine"
    do(session, lambda motion: motion.act(Spawn("box", 1.5, 0.0, 0.0, 0.0, 0.2, 0.2, 0.2)))
    reported = page.locator(".notices .info")
    until(lambda: "box_1 fell out of the world at t=" in reported.inner_text())
    until(lambda: re.match(r"warning: box_1 fell .* z=-\d+ m now", lamp.get_attribute("aria-label")))
    robot = page.locator(".display[data-display=RobotModel] .lamp")
    assert robot.get_attribute("aria-label") == "fine"
    do(session, lambda motion: motion.act(MoveModel("kbot", 3.0, 0.0, 0.0, 0.0)))
    until(lambda: "the robot fell out of the world" in robot.get_attribute("aria-label"))

    def seen() -> list[float]:
        return list(page.evaluate("kbot.camera().clipFromWorld"))

    stays = seen()
    until(lambda: state_of(session).fallen[-1].z < -20.0)
    assert np.allclose(seen(), stays, atol=1e-6)  # the view does not follow falling objects
    session.paused = True  # the box starts next to the floor, so it would fall again at once
    page.get_by_label("Reset", exact=True).click()
    until(lambda: robot.get_attribute("aria-label") == "fine" == lamp.get_attribute("aria-label"))
    until(lambda: np.allclose(seen(), start, atol=1e-3))


def test_a_page_opened_after_the_robot_fell_shows_the_world(
    island: tuple[str, Session], open_page: OpenPage
) -> None:
    address, session = island
    do(session, lambda motion: motion.act(MoveModel("kbot", 3.0, 0.0, 0.0, 0.0)))
    until(lambda: state_of(session).fallen and state_of(session).fallen[0].z < -20.0)
    page = open_page(address)

    def seen(*place: float) -> np.ndarray:
        clip = np.array(page.evaluate("kbot.camera().clipFromWorld")).reshape(4, 4) @ (*place, 1.0)
        return np.asarray(clip[:2] / clip[3])

    assert np.abs(seen(0.0, 0.0, 0.0)).max() < 0.1  # its centre is in the centre of the picture
    assert np.ptp([seen(-0.2, 0.0, 0.0), seen(0.2, 0.0, 0.0)], axis=0).max() > 0.3  # and near
    page.get_by_label("Reset", exact=True).click()
    until(lambda: not state_of(session).fallen)
    until(lambda: np.abs(seen(*page.evaluate("kbot.poses().slice(0, 3)"))).max() < 0.3)


def test_only_the_first_world_file_can_be_chosen_again(
    island: tuple[str, Session], open_page: OpenPage, tmp_path: Path
) -> None:
    address, session = island
    page = open_page(address)
    choice = page.get_by_label("World", exact=True)
    until(lambda: choice.locator("option:checked").inner_text() == "island.sdf")
    choice.select_option("boxes")
    until(lambda: len(session.scene.bodies) > 5)
    choice.select_option(label="island.sdf")
    until(lambda: [body.name for body in session.scene.bodies] == ["floor"])
    page.get_by_role("button", name="World and faults").click()
    page.locator("#world-menu").get_by_role("button", name="Restart", exact=True).click()
    until(lambda: state_of(session).time < 1.0)
    other = tmp_path / "other.sdf"
    other.write_text(ISLAND)
    with pytest.raises(KbotError, match="unknown world"):
        session._motion.enter(str(other), 0)


def test_topics_of_a_deleted_robot_disappear(driving: tuple[str, Session], open_page: OpenPage) -> None:
    address, session = driving
    page = open_page(address)
    do(session, lambda motion: motion.act(Spawn("robot", 0.5, 0.5, 0.0, 0.0, 1.0, 1.0, 1.0)))
    adder = page.get_by_label("Add a display")
    of_it = adder.locator("option[value*='/robot_2/']")
    until(lambda: adder.locator("option[value='Odometry /robot_2/odom']").count())
    adder.select_option("Odometry /robot_2/odom")
    lamp = page.locator(".display[data-display=Odometry] .lamp")
    until(lambda: lamp.get_attribute("aria-label").startswith("fine: /robot_2/odom"))
    page.keyboard.press("y")
    listed = page.locator("#traffic")
    until(lambda: "robot_2" in listed.inner_text())
    do(session, lambda motion: motion.act(Delete("robot_2/base_link")))
    until(lambda: "topic /robot_2/odom does not exist" in lamp.get_attribute("aria-label"))
    assert of_it.count() == 0
    until(lambda: "robot_2" not in listed.inner_text())
    do(session, lambda motion: motion.act(Spawn("robot", 0.5, 0.5, 0.0, 0.0, 1.0, 1.0, 1.0)))
    until(lambda: lamp.get_attribute("aria-label").startswith("fine: /robot_2/odom"))
