"""The list of displays: by mouse and keyboard, stored, saved and opened."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from kbot.workbench.displays.display_file import DisplayFile
from kbot.workbench.serve import open_session

from .axe import violations
from .conftest import until, wait_for_page
from .displayed import ASIDE
from .pictures import screenshot
from .rviz_texts import RVIZ1
from .served import served

OpenPage = Callable[..., Any]


def names(page: Any) -> list[str]:
    return list(page.locator("#displays .display:not(.globals) .name").all_inner_texts())


def floor_colours(page: Any, *places: tuple[float, float]) -> np.ndarray:
    """Return the colours at places of the floor, (n, 3) in 0..255."""
    camera = page.evaluate("kbot.camera()")
    seen = [np.array(camera["clipFromWorld"]).reshape(4, 4) @ (x, y, 0.0, 1.0) for x, y in places]
    rows = [int((1 - clip[1] / clip[3]) / 2 * camera["height"]) for clip in seen]
    columns = [int((1 + clip[0] / clip[3]) / 2 * camera["width"]) for clip in seen]
    colours: np.ndarray = screenshot(page)[rows, columns].astype(int)
    return colours


def head(page: Any, name: str) -> Any:
    return page.locator("#displays .head", has_text=name).first


def test_displays_are_moved_renamed_and_removed_by_keyboard(viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    before = names(page)
    assert before[:3] == ["Grid", "RobotModel", "TF"]
    page.keyboard.press("Tab")
    head(page, "TF").focus()
    page.keyboard.press("Alt+ArrowUp")
    assert names(page)[:3] == ["Grid", "TF", "RobotModel"]
    assert page.evaluate("document.activeElement.textContent") == "TF"
    page.keyboard.press("F2")
    page.keyboard.type("Frames of mine")
    page.keyboard.press("Enter")
    assert names(page)[1] == "Frames of mine"
    page.keyboard.press("ArrowDown")
    assert page.evaluate("document.activeElement.textContent") == "RobotModel"
    page.keyboard.press("Delete")
    assert "RobotModel" not in names(page)
    page.reload()
    wait_for_page(page)
    assert names(page)[:2] == ["Grid", "Frames of mine"]
    page.get_by_label("Display settings").select_option("reset")
    assert names(page) == before


def test_a_display_opens_with_its_settings_and_status(viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    page.get_by_label("Add a display").select_option("Map")
    row = page.locator(".display[data-display=Map]")
    until(lambda: row.locator(".head[aria-expanded=true]").count())
    lamp = row.locator(".lamp")
    until(lambda: "no topic of type OccupancyGrid" in lamp.get_attribute("aria-label"))
    row.get_by_label("Show Map").uncheck()
    until(lambda: "hidden" in lamp.get_attribute("aria-label"))
    # a display kind with at most one display cannot be added again
    assert page.locator("[aria-label='Add a display'] option[value=TF]").is_disabled()


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_axe_reports_no_violations_in_opened_displays(viewing: str, open_page: OpenPage, theme: str) -> None:
    page = open_page(viewing, color_scheme=theme)
    for name in ("Global options", "Grid", "RobotModel", "TF"):
        head(page, name).click()
    page.get_by_label("Add a display").select_option("LaserScan")
    for summary in page.locator("#displays summary:visible").all():
        summary.click()
    assert violations(page, "#displays") == []


def test_a_number_is_not_changed_while_it_is_typed(viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    head(page, "Grid").click()
    field = page.get_by_label("Cell size of Grid")
    field.fill("0.25")
    page.evaluate("kbot.drawn()")
    field.press("Enter")
    head(page, "TF").click()
    until(lambda: field.input_value() == "0.25")
    field.fill("1000")
    field.press("Enter")
    head(page, "TF").click()
    until(lambda: field.input_value() == "100")  # the maximum


def test_a_page_opens_and_saves_an_rviz_configuration(
    xacro: Path, tmp_path: Path, open_page: OpenPage
) -> None:
    path = tmp_path / "robot.rviz"
    path.write_text(RVIZ1)
    session = open_session(str(xacro), simulate=False)
    session.display_file = DisplayFile(str(path))
    with served(session) as address:
        page = open_page(address)
        until(lambda: names(page) == ["Grid", "Front lidar", "Eye", "RobotModel", "World"])
        clip = page.evaluate("kbot.camera()")
        assert clip["width"] > 0
        lamp = page.locator(".globals .lamp")
        until(lambda: lamp.get_attribute("aria-label") == "error: frame odom does not exist")
        head(page, "Global options").click()
        page.get_by_text("Not supported in robot.rviz").click()
        assert page.locator(".notes li", has_text="rviz_plugin_tutorials/Imu").is_visible()
        head(page, "Grid").click()
        cell = page.get_by_label("Cell size of Grid")
        cell.fill("0.125")
        cell.press("Enter")
        page.get_by_label("Display settings").select_option("save")
        until(lambda: f"Saved to {path}" in page.inner_text(".notices"))
        grid = yaml.safe_load(path.read_text())["Visualization Manager"]["Displays"][0]
        assert grid["Cell Size"] == 0.125
        assert grid["Line Style"]["Value"] == "Lines"


def test_a_copy_of_the_settings_is_saved_and_opened_again(
    viewing: str, tmp_path: Path, open_page: OpenPage
) -> None:
    page = open_page(viewing)
    page.locator("[data-option=collision]").click()
    with page.expect_download() as waiting:
        page.get_by_label("Display settings").select_option("kbot")
    copy = tmp_path / waiting.value.suggested_filename
    waiting.value.save_as(copy)
    assert copy.name == "displays.kbot.yaml"
    page.get_by_label("Display settings").select_option("reset")
    assert page.get_attribute("[data-option=collision]", "aria-pressed") == "false"
    page.get_by_label("Display file").set_input_files(copy)
    until(lambda: page.get_attribute("[data-option=collision]", "aria-pressed") == "true")
    broken = tmp_path / "broken.kbot.yaml"
    broken.write_text("displays:\n- kind: Gird\n")
    page.get_by_label("Display file").set_input_files(broken)
    until(lambda: "broken.kbot.yaml:2: unknown display kind" in page.inner_text(".notices"))


SLAB = "<visual><origin xyz='0 0 0.1'/><geometry><box size='0.2 0.2 0.01'/></geometry></visual>"


@pytest.mark.parametrize("shape", ["", SLAB], ids=["bare", "slab"])
def test_a_robot_without_shapes_is_reported_and_casts_no_shadow(
    tmp_path: Path, open_page: OpenPage, shape: str
) -> None:
    """A robot with a shape casts one below it: the camera looks under the slab."""
    (tmp_path / "r.urdf").write_text(f"<robot name='r'><link name='a'>{shape}</link></robot>")
    with served(open_session(str(tmp_path / "r.urdf"), simulate=False)) as address:
        page = open_page(address)
        lamp = page.locator(".display[data-display=RobotModel] .lamp")
        until(lambda: ("no link has a visual" in lamp.get_attribute("aria-label")) == (shape == ""))
        for name in ("Grid", "TF"):
            page.get_by_label(f"Show {name}", exact=True).uncheck()
        page.evaluate("kbot.look([0, -0.5, 0.05], [0, 0, 0])")
        page.evaluate(ASIDE)
        beneath, beside = floor_colours(page, (0.0, 0.0), (0.0, 0.4))
        assert (np.abs(beneath - beside).max() <= 1) == (shape == "")
        assert (beneath <= beside).all()
        page.get_by_label("Show RobotModel", exact=True).uncheck()  # its shadow disappears with it
        page.evaluate("kbot.drawn()")
        beneath, beside = floor_colours(page, (0.0, 0.0), (0.0, 0.4))
        assert np.abs(beneath - beside).max() <= 1


def test_the_robot_display_reports_missing_meshes(tmp_path: Path, open_page: OpenPage) -> None:
    file = tmp_path / "arm.urdf"
    file.write_text(
        '<robot name="arm"><link name="base"><visual><geometry><box size="1 1 1"/></geometry></visual></link>'
        '<link name="tool"><visual><geometry><mesh filename="package://gone/t.stl"/></geometry></visual></link>'
        '<joint name="j" type="fixed"><parent link="base"/><child link="tool"/></joint></robot>'
    )
    with served(open_session(str(file), simulate=False)) as address:
        lamp = open_page(address).locator(".display[data-display=RobotModel] .lamp")
        expected = "error: meshes are missing (see Findings): tool"
        until(lambda: lamp.get_attribute("aria-label") == expected)
