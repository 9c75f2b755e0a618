"""The keys that drive and stop, for every focused element."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from kbot.messages import Header, Point, Pose, Quaternion
from kbot.messages.navigation import PoseStamped
from kbot.workbench.serve import open_session
from kbot.workbench.session.session import Session

from .conftest import until
from .served import Speaker, served, state_of

OpenPage = Callable[..., Any]

INERTIA = '<inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/>'
MAST = f"""
  <link name="mast"><inertial><mass value="0.05"/>{INERTIA}</inertial></link>
  <joint name="mast_joint" type="revolute">
    <origin xyz="0 0 0.1"/><parent link="base_link"/><child link="mast"/>
    <axis xyz="0 0 1"/><limit lower="-1.5" upper="1.5" effort="5" velocity="3"/>
  </joint>
  <gazebo><plugin filename="gz-sim-joint-position-controller-system"
    name="gz::sim::systems::JointPositionController"><joint_name>mast_joint</joint_name></plugin></gazebo>
</robot>"""


@pytest.mark.parametrize("focus", ["toggle", "list", "link"])
def test_space_stops_for_every_focus(driving: tuple[str, Session], open_page: OpenPage, focus: str) -> None:
    address, session = driving
    page = open_page(address)
    place = {"toggle": "[data-option=grid]", "list": "[aria-label=Speed]", "link": "#links button"}[focus]
    page.locator(place).first.focus()
    pressed = page.get_attribute("[data-option=grid]", "aria-pressed")
    page.evaluate("dispatchEvent(new KeyboardEvent('keydown', { code: 'KeyW', key: 'w' }))")
    until(lambda: state_of(session).command[0] > 0.05)
    page.keyboard.press("Space")
    until(lambda: state_of(session).command == (0.0, 0.0))
    assert page.get_attribute("[data-option=grid]", "aria-pressed") == pressed


def test_arrows_drive_after_a_click_in_the_tree(driving: tuple[str, Session], open_page: OpenPage) -> None:
    address, session = driving
    page = open_page(address)
    page.locator("#links button[data-link=base_link]").click()
    page.keyboard.down("ArrowUp")
    until(lambda: state_of(session).command[0] > 0.05)
    page.keyboard.up("ArrowUp")
    until(lambda: state_of(session).command == (0.0, 0.0))


def test_arrows_navigate_the_tree_after_keyboard_focus(viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    page.locator("#links button[data-link=base_footprint]").focus()
    page.keyboard.press("ArrowDown")
    assert page.evaluate("document.activeElement.dataset.link") == "base_link"


def test_sliders_and_lists_keep_keyboard_focus(driving: tuple[str, Session], open_page: OpenPage) -> None:
    address, session = driving
    page = open_page(address)
    page.keyboard.press("Tab")
    limit = page.get_by_label("Speed limit in percent")
    limit.focus()
    for _ in range(3):
        page.keyboard.press("ArrowRight")
    assert limit.input_value() == "75"  # from 60 in steps of 5
    size = page.get_by_label("base_len", exact=True)
    size.focus()
    for _ in range(5):
        page.keyboard.press("ArrowRight")
    # each step is a hundredth of its range, from 0 to twice the written 0.16
    number = page.get_by_label("base_len, as a number")
    until(lambda: float(number.input_value()) == pytest.approx(0.176))
    speed = page.get_by_label("Speed", exact=True)
    speed.focus()
    for _ in range(2):
        page.keyboard.press("ArrowDown")
    until(lambda: state_of(session).speed == 5.0)


def drag(page: Any, slider: Any, part: float) -> None:
    """Drag a slider's thumb to a part of its line, and release it above that."""
    slider.scroll_into_view_if_needed()
    box = slider.bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] * part, box["y"] - 40)
    page.mouse.up()


def commanded(page: Any, session: Session) -> tuple[float, ...]:
    """Return the commanded speed once all messages of the page are processed."""
    page.keyboard.press("p")
    until(lambda: state_of(session).paused)
    return state_of(session).command


def dragged(driving: tuple[str, Session], open_page: OpenPage) -> tuple[Any, Session, Any]:
    """A page whose speed limit slider was just dragged: the page, its session, the slider."""
    address, session = driving
    page = open_page(address)
    limit = page.get_by_label("Speed limit in percent")
    drag(page, limit, 0.7)
    return page, session, limit


def test_arrows_move_a_dragged_slider_and_not_the_robot(
    driving: tuple[str, Session], open_page: OpenPage
) -> None:
    page, session, limit = dragged(driving, open_page)
    before = int(limit.input_value())
    page.keyboard.down("ArrowLeft")
    assert int(limit.input_value()) == before - 5  # a step
    assert commanded(page, session) == (0.0, 0.0)
    page.keyboard.up("ArrowLeft")
    page.keyboard.down("w")
    until(lambda: state_of(session).command[0] > 0.05)
    page.keyboard.up("w")


def test_arrows_drive_again_after_a_click_elsewhere(
    driving: tuple[str, Session], open_page: OpenPage
) -> None:
    page, session, limit = dragged(driving, open_page)
    page.get_by_label("Drive: drag").click()
    limited = limit.input_value()
    page.keyboard.down("ArrowUp")
    until(lambda: state_of(session).command[0] > 0.05)
    page.keyboard.up("ArrowUp")
    assert limit.input_value() == limited


@pytest.fixture
def with_mast(xacro: Path) -> Iterator[tuple[str, Session]]:
    """A KBot with a mast that a controller turns."""
    xacro.write_text(xacro.read_text().replace("</robot>", MAST))
    session = open_session(str(xacro), simulate=True, seed=1)
    with served(session) as address:
        yield address, session


def turn_by_arrows(page: Any) -> None:
    """Drag the mast's slider, then press arrow keys until it has moved."""
    slider = page.get_by_role("slider", name="mast_joint", exact=True)
    number = page.get_by_label("mast_joint in degrees", exact=True)
    drag(page, slider, 0.75)
    until(lambda: float(number.input_value()) > 20)
    before = float(number.input_value())
    page.keyboard.down("ArrowLeft")
    for _ in range(20):
        page.keyboard.down("ArrowLeft")  # as a held key repeats
    until(lambda: float(number.input_value()) < before - 10)


def test_arrows_after_a_drag_move_only_the_joint(with_mast: tuple[str, Session], open_page: OpenPage) -> None:
    address, session = with_mast
    page = open_page(address)
    turn_by_arrows(page)
    assert commanded(page, session) == (0.0, 0.0)


def test_arrows_after_a_drag_do_not_cancel_the_goal(
    with_mast: tuple[str, Session], open_page: OpenPage
) -> None:
    address, session = with_mast
    page = open_page(address)
    goal = PoseStamped(Header(frame_id="map"), Pose(Point(40.0, 0.0, 0.0), Quaternion(0.0, 0.0, 0.0, 1.0)))
    Speaker(session).publish("goal_pose", goal)
    until(lambda: page.locator(".goal").inner_text().startswith("Driving"))
    turn_by_arrows(page)
    assert commanded(page, session)[0] > 0.05
    assert page.locator(".goal").inner_text().startswith("Driving")


def test_a_slider_keeps_the_arrows_when_the_file_is_saved(
    xacro: Path, with_mast: tuple[str, Session], open_page: OpenPage
) -> None:
    address, session = with_mast
    page = open_page(address)
    page.get_by_role("slider", name="mast_joint", exact=True).click()
    revision = page.evaluate("kbot.revision")
    xacro.write_text(xacro.read_text().replace('upper="1.5"', 'upper="1.4"'))
    until(lambda: page.evaluate("kbot.revision") > revision)
    turn_by_arrows(page)
    assert commanded(page, session) == (0.0, 0.0)


def test_driving_while_paused_shows_a_notice(driving: tuple[str, Session], open_page: OpenPage) -> None:
    page = open_page(driving[0])
    page.keyboard.press("p")
    until(lambda: page.inner_text(".rate") == "paused")
    page.keyboard.down("w")
    until(lambda: "Press P" in page.inner_text(".notices"))
    page.keyboard.up("w")


def test_an_emptied_field_shows_the_joint_position_again(viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    number = page.get_by_label("left_wheel_joint in degrees")
    number.fill("30")
    number.press("Tab")
    until(lambda: number.input_value() == "30.0")
    number.fill("")
    number.press("Tab")
    until(lambda: number.input_value() == "30.0")
