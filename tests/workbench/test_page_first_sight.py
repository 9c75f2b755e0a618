"""What a person sees first: the view of the world, the hint how to drive, the tools and the lists."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kbot.workbench.serve import open_session
from kbot.workbench.session.session import Session
from kbot.world import load_world

from .axe import violations
from .conftest import until, wait_for_page
from .pictures import id_image
from .served import served

OpenPage = Callable[..., Any]
SIZES = [(1440, 900), (1280, 720), (1024, 600), (390, 844)]
PHONE = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}
COVERING = ".tools, .toolbar > .chips, .transport, .drive-hint"
"""What lies over the view."""


@pytest.fixture(scope="module")
def playground() -> Iterator[str]:
    """The address of what `kbot` serves."""
    with served(open_session("kbot", simulate=True, world="playground")) as address:
        yield address


def corners(world: str) -> np.ndarray:
    """Return the corners of all walls of a world, (n, 3)."""
    signs = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    walls = [body for body in load_world(world).bodies if body.name.startswith("wall")]
    return np.concatenate(
        [[body.pose.apply(sign * body.parts[0].shape.size) for sign in signs] for body in walls]
    )


def on_page(page: Any, points: np.ndarray) -> np.ndarray:
    """Return where points of the world are on the page in CSS pixels, (n, 2)."""
    camera = page.evaluate("kbot.camera()")
    clip = np.array(camera["clipFromWorld"]).reshape(4, 4)
    seen = np.column_stack([points, np.ones(len(points))]) @ clip.T
    box = page.locator(".picture").bounding_box()
    x = box["x"] + (1 + seen[:, 0] / seen[:, 3]) / 2 * box["width"]
    y = box["y"] + (1 - seen[:, 1] / seen[:, 3]) / 2 * box["height"]
    return np.column_stack([x, y])


@pytest.mark.parametrize("size", SIZES)
def test_a_walled_world_is_shown_whole_and_uncovered(size: tuple[int, int], open_page: OpenPage) -> None:
    with served(open_session("kbot", simulate=True, world="maze")) as address:
        page = open_page(address, viewport={"width": size[0], "height": size[1]})
        page.evaluate("sessionStorage.clear()")
        page.reload()
        wait_for_page(page)
        places = on_page(page, corners("maze"))
        view = page.locator(".picture").bounding_box()
        low, high = places.min(axis=0), places.max(axis=0)
        assert (low > (view["x"], view["y"])).all()
        assert (high < (view["x"] + view["width"], view["y"] + view["height"])).all()
        robot = on_page(page, np.zeros((1, 3)))[0]
        for element in page.locator(COVERING).all():
            box = element.bounding_box()
            if box is not None:
                right, bottom = box["x"] + box["width"], box["y"] + box["height"]
                assert not (box["x"] < robot[0] < right and box["y"] < robot[1] < bottom)
        ids, links = id_image(page)
        assert (ids == links.index("base_link")).sum() >= 12
        # the camera stays until the user wants to see the robot
        follow = page.locator("[data-option=follow]")
        assert follow.get_attribute("aria-pressed") == "false"
        page.keyboard.press("f")
        assert follow.get_attribute("aria-pressed") == "true"


def test_another_world_is_framed_again(driving: tuple[str, Session], open_page: OpenPage) -> None:
    page = open_page(driving[0], viewport={"width": 1280, "height": 720})
    page.get_by_label("World", exact=True).select_option("rooms")
    until(lambda: page.locator("[data-option=follow]").get_attribute("aria-pressed") == "false")
    page.evaluate("kbot.drawn()")
    places = on_page(page, corners("rooms"))
    view = page.locator(".picture").bounding_box()
    assert (places > (view["x"], view["y"])).all()
    assert (places < (view["x"] + view["width"], view["y"] + view["height"])).all()


def test_the_playground_shows_the_robot_and_objects_around_it(playground: str, open_page: OpenPage) -> None:
    page = open_page(playground, viewport={"width": 1440, "height": 900})
    ids, links = id_image(page)
    assert (ids == links.index("base_link")).mean() > 0.002
    middles = np.array([body.pose.translation for body in load_world("playground").bodies[1:]])
    places, view = on_page(page, middles), page.locator(".picture").bounding_box()
    inside = (places > (view["x"], view["y"])) & (
        places < (view["x"] + view["width"], view["y"] + view["height"])
    )
    assert inside.all(axis=1).sum() >= 6


def test_the_hint_how_to_drive_stays_until_the_robot_is_driven(playground: str, open_page: OpenPage) -> None:
    page = open_page(playground)
    page.evaluate("sessionStorage.clear()")
    page.reload()
    wait_for_page(page)
    hint = page.locator(".drive-hint")
    assert hint.inner_text().split() == ["Hold", "W", "A", "S", "D", "to", "drive"]
    page.keyboard.press("1")  # not a key that drives
    assert hint.is_visible()
    page.keyboard.press("w")
    until(hint.is_hidden)
    page.reload()
    wait_for_page(page)
    assert hint.is_hidden()


def test_the_hint_names_the_pad_on_a_touch_screen(playground: str, open_page: OpenPage) -> None:
    page = open_page(playground, **PHONE)
    page.evaluate("sessionStorage.clear()")
    page.reload()
    wait_for_page(page)
    hint = page.locator(".drive-hint")
    assert hint.inner_text() == "Drag the pad below to drive"
    pad = page.locator(".pad").bounding_box()
    page.touchscreen.tap(pad["x"] + pad["width"] / 2, pad["y"] + 10)
    until(hint.is_hidden)


def test_a_robot_that_is_only_shown_has_no_hint(viewing: str, open_page: OpenPage) -> None:
    assert open_page(viewing).locator(".drive-hint").is_hidden()


def test_the_tools_have_labels_where_there_is_room(playground: str, open_page: OpenPage) -> None:
    label = "[data-tool=measure] span"
    assert open_page(playground, viewport={"width": 1280, "height": 720}).locator(label).is_visible()
    narrow = open_page(playground, viewport={"width": 1024, "height": 600})
    assert narrow.locator(label).is_hidden()
    assert narrow.get_attribute("[data-tool=measure]", "title") == "Measure (M)"


def test_the_list_of_displays_leaves_out_those_with_nothing_to_show(
    viewing: str, driving: tuple[str, Session], open_page: OpenPage
) -> None:
    def listed(page: Any) -> list[str]:
        names = page.locator("#displays .display .name")
        return [name.inner_text() for name in names.all() if name.is_visible()]

    page = open_page(viewing)
    assert listed(page) == ["Global options", "Grid", "RobotModel", "TF"]
    page.get_by_label("Add a display").select_option("LaserScan")  # it exists already, and is now listed
    assert listed(page) == ["Global options", "Grid", "RobotModel", "TF", "LaserScan"]
    page = open_page(driving[0])
    assert listed(page) == ["Global options", "Grid", "RobotModel", "TF", "Trail"]
    page.get_by_label("World", exact=True).select_option("boxes")
    until(lambda: listed(page)[-1] == "World")


def findings_robot(folder: Path) -> Path:
    """A description of six links with many findings."""
    links = "".join(
        f"<link name='part_{i}'><inertial><mass value='1'/>"
        "<inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='9'/></inertial></link>"
        f"<joint name='j_{i}' type='fixed'><parent link='base'/><child link='part_{i}'/></joint>"
        for i in range(5)
    )
    file = folder / "r.urdf"
    file.write_text(f"<robot name='r'><link name='base'/>{links}</robot>")
    return file


@pytest.mark.parametrize("size", SIZES[:3])
def test_findings_leave_room_for_five_links(
    size: tuple[int, int], tmp_path: Path, open_page: OpenPage
) -> None:
    with served(open_session(str(findings_robot(tmp_path)), simulate=False)) as address:
        page = open_page(address, viewport={"width": size[0], "height": size[1]})
        until(lambda: page.locator(".finding").count() >= 5)
        body = page.locator("#links .panel-body").bounding_box()
        rows = [row.bounding_box() for row in page.locator("#links button[data-link]").all()]
        assert len(rows) == 6
        seen = [row for row in rows if row["y"] + row["height"] <= body["y"] + body["height"]]
        assert len(seen) >= 5
        findings = page.locator("#findings").bounding_box()
        assert findings["y"] + findings["height"] <= size[1]
        assert findings["height"] >= 96


@pytest.mark.parametrize("theme", ["dark", "light"])
@pytest.mark.parametrize("size", SIZES)
def test_axe_reports_no_violations_at_first_sight(
    playground: str, tmp_path: Path, open_page: OpenPage, size: tuple[int, int], theme: str
) -> None:
    options = {"viewport": {"width": size[0], "height": size[1]}, "color_scheme": theme}
    page = open_page(playground, **options)
    page.evaluate("sessionStorage.clear()")
    page.reload()
    wait_for_page(page)
    assert page.locator(".drive-hint").is_visible()
    assert violations(page) == []
    with served(open_session(str(findings_robot(tmp_path)), simulate=False)) as address:
        page = open_page(address, **options)
        until(lambda: page.locator(".finding").count() >= 5)
        assert violations(page) == []


def test_parameters_show_their_unit(viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    assert page.locator("[data-parameter=wheel_radius] .unit").inner_text() == "m"
    assert page.locator("[data-parameter=max_speed] .unit").count() == 0
