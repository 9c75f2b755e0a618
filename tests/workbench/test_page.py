"""The page in a real browser: user actions, and what is visible."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from kbot.workbench.session.session import Session

from .conftest import until, wait_for_page
from .pictures import blue, id_image, screenshot
from .test_page_driving import reading, standing

OpenPage = Callable[..., Any]


def test_choosing_another_world_changes_every_tab(driving: tuple[str, Session], open_page: OpenPage) -> None:
    page, other = open_page(driving[0]), open_page(driving[0])
    page.get_by_role("combobox", name="World").select_option("boxes")
    for tab in (page, other):
        until(lambda tab=tab: tab.evaluate("kbot.revision") == 2)
        assert tab.get_by_role("combobox", name="World").input_value() == "boxes"
        until(lambda tab=tab: others(tab).sum() > 100)  # the picture shows boxes


def test_a_slider_turns_the_wheel_in_every_tab(viewing: str, open_page: OpenPage) -> None:
    page, other = open_page(viewing), open_page(viewing)
    for tab in (page, other):
        assert tab.get_by_label("left_wheel_joint", exact=True).input_value() == "0"
    page.get_by_label("left_wheel_joint", exact=True).fill("1.5")
    for tab in (page, other):
        until(lambda tab=tab: tab.get_by_label("left_wheel_joint in degrees").input_value() == "85.9")
    page.get_by_role("button", name="Zero").click()
    until(lambda: other.get_by_label("left_wheel_joint in degrees").input_value() == "0.0")


def test_a_slider_changes_the_picture(xacro: Path, viewing: str, open_page: OpenPage) -> None:
    # an arm in place of the wheel, so that its rotation is visible
    macros = xacro.with_name("kbot_macros.xacro")
    text = macros.read_text().replace('<cylinder radius="${wheel_radius}" length="${wheel_width}"/>', "", 1)
    text = text.replace("<geometry>\n          \n", '<geometry>\n          <box size="0.07 0.01 0.01"/>\n', 1)
    page = open_page(viewing)
    macros.write_text(text)
    until(lambda: page.evaluate("kbot.revision") >= 2)
    before = mask(page, "left_wheel")
    page.get_by_label("left_wheel_joint", exact=True).fill("1.57")
    until(lambda: page.get_by_label("left_wheel_joint in degrees").input_value() == "90.0")
    after = mask(page, "left_wheel")
    assert before.any()
    assert after.any()
    assert (before & after).sum() < 0.6 * (before | after).sum()


def test_a_save_shows_the_new_robot_in_the_same_view(xacro: Path, viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    page.get_by_label("left_wheel_joint", exact=True).fill("1")
    until(lambda: page.get_by_label("left_wheel_joint in degrees").input_value() == "57.3")
    page.evaluate("kbot.look([0.3, 0.4, 0.5], [0, 0, 0])")
    camera, before = page.evaluate("kbot.camera()"), blue(screenshot(page))
    xacro.write_text(
        xacro.read_text().replace('name="base_len" default="0.16"', 'name="base_len" default="0.26"')
    )
    until(lambda: page.evaluate("kbot.revision") >= 2)
    after = blue(screenshot(page))
    assert np.allclose(page.evaluate("kbot.camera()")["clipFromWorld"], camera["clipFromWorld"], atol=1e-9)
    assert page.get_by_label("left_wheel_joint in degrees").input_value() == "57.3"
    assert after.sum() > 1.3 * before.sum()


def test_a_driven_robot_keeps_its_pose_when_its_file_is_saved(
    xacro: Path, driving: tuple[str, Session], open_page: OpenPage
) -> None:
    page = open_page(driving[0])
    page.keyboard.down("w")
    until(lambda: reading(page, "x") > 0.1)
    page.keyboard.up("w")
    until(lambda: standing(page))
    x = reading(page, "x")
    xacro.write_text(
        xacro.read_text().replace('"base_height" default="0.01"', '"base_height" default="0.03"')
    )
    until(lambda: page.evaluate("kbot.revision") >= 2)
    assert abs(reading(page, "x") - x) < 0.002
    page.keyboard.down("w")
    until(lambda: reading(page, "x") > x + 0.05)
    page.keyboard.up("w")


def test_a_broken_file_keeps_the_last_valid_robot_and_is_reported(
    xacro: Path, viewing: str, open_page: OpenPage
) -> None:
    page = open_page(viewing)
    good = xacro.read_text()
    whole = blue(screenshot(page)).sum()
    xacro.write_text(good.replace("${base_mass}", "${base_mas}", 1))
    line = 1 + good[: good.index("${base_mass}")].count("\n")
    until(lambda: page.locator(".notice.error").is_visible())
    message = page.locator("#findings li[data-severity=error] .message >> nth=0")
    assert "base_mas" in message.inner_text()
    until(lambda: blue(screenshot(page)).sum() < 0.05 * whole)
    assert mask(page, "base_link").sum() > 1000
    first = page.locator(".notice.error .first-error")
    assert f"kbot.xacro:{line}: " in first.inner_text()
    assert "base_mas" in first.inner_text()
    first.click()
    here = until(lambda: page.locator(".cm-line.here").count() and page.locator(".cm-line.here"))
    assert here.get_attribute("data-line") == str(line)
    caret = page.locator(".caret").inner_text()
    assert "^" in caret
    assert "base_mas" in caret
    xacro.write_text(good)
    until(lambda: not page.locator(".notice.error").is_visible())
    page.keyboard.press("Escape")
    until(lambda: abs(blue(screenshot(page)).sum() - whole) < 0.02 * whole)


def test_an_unclosed_tag_links_to_its_opening(xacro: Path, viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    good = xacro.read_text()
    opened = good.index("<robot")
    xacro.write_text(good[:opened] + "<group>\n" + good[opened:])
    card = page.locator("#findings li[data-severity=error]").first
    until(lambda: "is not closed" in card.inner_text())
    card.get_by_role("button").first.click()
    card.get_by_role("button", name="<group> is opened").click()
    until(lambda: "<group>" in page.locator(".cm-line.here").inner_text())
    here = until(lambda: page.locator(".cm-line.here").count() and page.locator(".cm-line.here"))
    assert here.get_attribute("data-line") == str(1 + good[:opened].count("\n"))


def test_a_finding_shows_its_line_and_highlights_its_link(
    xacro: Path, viewing: str, open_page: OpenPage
) -> None:
    page = open_page(viewing)
    macros = xacro.with_name("kbot_macros.xacro")
    macros.write_text(macros.read_text().replace('izz="${2.0*m*(r*r)/5.0}"', 'izz="${9.0*m*(r*r)}"'))
    card = page.locator("#findings li[data-code]").filter(has_text="caster_wheel").first
    until(lambda: card.count() == 1)
    page.evaluate("kbot.look([-0.3, 0.0, 0.05], [-0.08, 0, 0.02])")
    before = screenshot(page)
    card.get_by_role("button").first.click()
    until(lambda: page.locator(".cm-line.here").count() == 1)
    assert page.locator("[role=tab][aria-selected=true]").inner_text() == "kbot_macros.xacro"
    assert page.locator(".caret").count() == 1
    assert page.locator("#links [aria-selected=true]").inner_text().startswith("caster_wheel")
    page.keyboard.press("Escape")  # closes the source, and deselects the link
    until(lambda: page.locator("#source").is_hidden())
    card.get_by_role("button").first.click()
    page.get_by_role("button", name="Close the source").click()
    until(lambda: page.locator("#source").is_hidden())
    caster = mask(page, "caster_wheel")
    until(lambda: screenshot(page).shape == before.shape)
    until(lambda: screenshot(page)[caster, 1].mean() > before[caster, 1].mean() + 30)  # red turns amber


def test_a_link_shows_its_line(viewing: str, xacro: Path, open_page: OpenPage) -> None:
    page = open_page(viewing)
    page.locator("#links").get_by_role("button", name="base_link").click()
    here = until(lambda: page.locator(".cm-line.here").count() and page.locator(".cm-line.here"))
    assert 'name="base_link"' in here.inner_text()
    line = xacro.read_text().splitlines().index('  <link name="base_link">') + 1
    assert here.get_attribute("data-line") == str(line)


def test_a_click_in_the_picture_selects_the_link(viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    page.evaluate("kbot.look([0, -0.001, 1.0], [0, 0, 0])")
    at = page.evaluate("kbot.where('base_link')")
    page.mouse.move(at["x"], at["y"])
    until(lambda: page.locator(".tip").is_visible())
    assert "base_link" in page.locator(".tip").inner_text()
    page.mouse.click(at["x"], at["y"])
    until(lambda: page.locator("#links [aria-selected=true]").count() == 1)
    assert page.locator("#links [aria-selected=true]").inner_text().startswith("base_link")


def test_displays_change_the_picture_and_are_stored(viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    whole = mask(page, "base_link").sum()
    for option in ("collision", "inertia", "frames", "names", "grid"):
        before = screenshot(page).astype(int)
        page.locator(f"[data-option={option}]").click()
        until(lambda before=before: (np.abs(screenshot(page).astype(int) - before) > 24).sum() > 200)
    page.locator("[data-option=visual]").click()
    page.locator("[data-option=collision]").click()
    assert whole > 1000
    assert mask(page, "base_link").sum() == 0
    page.reload()
    wait_for_page(page)
    assert page.locator("[data-option=visual]").get_attribute("aria-pressed") == "false"


def test_the_theme_can_be_dark_or_light(viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing, color_scheme="dark")
    dark = screenshot(page).mean()
    page.keyboard.press("t")
    assert dark < 70
    until(lambda: screenshot(page).mean() > 180)
    assert (
        open_page(viewing, color_scheme="light").evaluate("document.documentElement.dataset.theme") == "light"
    )


def mask(page: Any, link: str) -> np.ndarray:
    """Return where a link is in the picture, by the page's id buffer; (height, width)."""
    page.evaluate("kbot.drawn()")
    ids, links = id_image(page)
    result: np.ndarray = ids == links.index(link)
    return result


def others(page: Any) -> np.ndarray:
    """Return where the picture shows something that is not a link, (height, width)."""
    page.evaluate("kbot.drawn()")
    ids, links = id_image(page)
    result: np.ndarray = ids >= len(links)
    return result
