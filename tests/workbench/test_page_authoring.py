"""Changing the description in the page, as a user does."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import kbot
from kbot.record import Recorder
from kbot.record.feed import Feed
from kbot.sim import Simulation
from kbot.workbench.driving.sliders import Sliders
from kbot.workbench.notebook import LoadedReader, reading_of
from kbot.workbench.session.played_session import played_session
from kbot.workbench.session.session import Session

from .conftest import until
from .pictures import blue, screenshot
from .served import served

OpenPage = Callable[..., Any]


def length_in_source(page: Any) -> Any:
    """Open the source, and return the element of the number `base_len` in it."""
    page.locator("[data-parameter=base_len] .name").click()
    number = page.locator(".cm-line.here .t-number")
    until(lambda: number.count() == 1)
    return number


def test_a_parameter_is_dragged_kept_and_undone(xacro: Path, viewing: str, open_page: OpenPage) -> None:
    page, text = open_page(viewing), xacro.read_text()
    before = blue(screenshot(page)).sum()
    page.get_by_label("base_len", exact=True).fill("0.26")
    until(lambda: blue(screenshot(page)).sum() > 1.3 * before)
    assert xacro.read_text() == text
    page.get_by_role("button", name="Keep").click()
    until(lambda: '"base_len" default="0.26"' in xacro.read_text())
    page.locator("#parameters").get_by_role("button", name="Undo").click()
    until(lambda: xacro.read_text() == text)
    until(lambda: page.get_by_label("base_len, as a number").input_value() == "0.16")
    until(lambda: abs(blue(screenshot(page)).sum() - before) < 0.02 * before)


def test_a_boolean_has_a_check_mark(xacro: Path, viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    length = '<xacro:property name="base_len" value='
    choice = '<xacro:property name="long" value="false"/>'
    text = xacro.read_text().replace(
        f'{length}"$(arg base_len)"', f'{choice}{length}"${{0.26 if long else 0.16}}"'
    )
    xacro.write_text(text)
    box = page.get_by_role("checkbox", name="long", exact=True)
    until(lambda: box.count() == 1 and not box.is_checked())
    before = blue(screenshot(page)).sum()
    box.check()
    until(lambda: blue(screenshot(page)).sum() > 1.3 * before)
    assert xacro.read_text() == text
    page.get_by_role("button", name="Keep").click()
    until(lambda: '"long" value="true"' in xacro.read_text())
    until(page.locator("#parameters").get_by_role("button", name="Undo").is_visible)
    page.keyboard.press("Control+z")
    until(lambda: xacro.read_text() == text)
    until(lambda: not box.is_checked())


def test_a_number_in_the_source_can_be_typed(xacro: Path, viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    number = length_in_source(page)
    assert xacro.read_text().startswith('<?xml version="1.0"')
    assert page.locator(".cm-line").filter(has_text="<?xml").locator(".t-number").count() == 0, (
        "the version of XML is no number"
    )
    before = blue(screenshot(page)).sum()
    number.dblclick()
    page.keyboard.type("0.26")
    page.keyboard.press("Enter")
    until(lambda: '"base_len" default="0.26"' in xacro.read_text())
    until(lambda: blue(screenshot(page)).sum() > 1.3 * before)
    until(page.locator("#source").get_by_role("button", name="Undo").is_visible)
    page.keyboard.press("Control+z")
    until(lambda: '"base_len" default="0.16"' in xacro.read_text())


def test_a_number_is_changed_undone_and_redone_by_keyboard(
    xacro: Path, viewing: str, open_page: OpenPage
) -> None:
    page = open_page(viewing)
    text = xacro.read_text()
    name = page.locator("[data-parameter=base_len] .name")
    name.focus()
    name.press("Enter")
    until(lambda: page.locator(".cm-line.here").count() == 1)
    page.get_by_role("textbox", name="Source text").focus()  # its cursor is at the number
    page.keyboard.press("Control+ArrowUp")
    until(lambda: '"base_len" default="0.17"' in xacro.read_text())
    changed = xacro.read_text()
    source = page.locator("#source")
    until(source.get_by_role("button", name="Undo").is_visible)
    page.keyboard.press("Control+z")
    until(lambda: xacro.read_text() == text)
    until(source.get_by_role("button", name="Redo").is_visible)
    page.keyboard.press("Control+Shift+z")
    until(lambda: xacro.read_text() == changed)
    until(source.get_by_role("button", name="Redo").is_hidden)


def test_undo_works_after_an_editor_saved_another_line(
    xacro: Path, viewing: str, open_page: OpenPage
) -> None:
    page = open_page(viewing)
    number = length_in_source(page)
    number.dblclick()
    page.keyboard.type("0.26")
    page.keyboard.press("Enter")
    until(lambda: '"base_len" default="0.26"' in xacro.read_text())
    saved = xacro.read_text().replace('"base_height" default="0.01"', '"base_height" default="0.02"')
    assert saved != xacro.read_text()
    xacro.write_text(saved)
    until(lambda: page.get_by_label("base_height, as a number").input_value() == "0.02")
    page.keyboard.press("Control+z")
    until(
        lambda: xacro.read_text() == saved.replace('"base_len" default="0.26"', '"base_len" default="0.16"')
    )


def test_invalid_numbers_are_refused_and_the_old_one_is_kept(
    xacro: Path, viewing: str, open_page: OpenPage
) -> None:
    page, text = open_page(viewing), xacro.read_text()
    number = length_in_source(page)
    number.dblclick()
    page.keyboard.type("abc")
    page.keyboard.press("Enter")
    until(lambda: "'abc' is not a number" in page.locator(".notices").inner_text())
    assert number.inner_text() == "0.16"
    number.dblclick()
    page.keyboard.type("${0.1 + 0.16}")
    page.keyboard.press("Enter")
    until(
        lambda: (
            xacro.read_text()
            == text.replace('"base_len" default="0.16"', '"base_len" default="${0.1 + 0.16}"')
        )
    )


def test_the_robot_of_a_recording_is_read_only(tmp_path: Path, open_page: OpenPage) -> None:
    sim = Simulation(kbot.load("kbot"))
    with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), str(tmp_path / "run.mcap")):
        sim.run(0.5)
    session = played_session(str(tmp_path / "run.mcap"))
    with served(session) as address:
        page = open_page(address)
        until(
            lambda: (
                "Read only: the robot is part of a recording and cannot be changed."
                in page.locator("#parameters").inner_text()
            )
        )
        page.locator("#links").get_by_role("button", name="left_wheel").click()
        number = page.locator("#source .t-number").first
        until(lambda: number.count() == 1)
        number.dblclick()
        assert page.locator("#source .edit").count() == 0
        assert number.evaluate("e => getComputedStyle(e).cursor") != "ew-resize"


def test_the_robot_of_a_program_is_read_only(xacro: Path, open_page: OpenPage) -> None:
    session = Session(LoadedReader(reading_of(kbot.load(str(xacro)))), "view", Sliders)
    with served(session) as address:
        page = open_page(address)
        assert "Read only: the program loaded this robot." in page.locator("#parameters").inner_text()


def test_expressions_have_their_values_beside_them(viewing: str, open_page: OpenPage) -> None:
    """While a parameter is dragged, the values are those in the picture."""
    page = open_page(viewing)
    page.locator("#links").get_by_role("button", name="base_link").click()
    line = page.locator(".cm-line").filter(has_text='<box size="${')
    until(lambda: line.first.count() == 1)
    hint = line.first.locator(".value-hint")
    until(lambda: hint.count() == 1 and hint.inner_text().startswith("= 0.16 "))
    assert "0.16 " in line.first.locator(".has-value").first.get_attribute("title")
    page.get_by_label("base_len", exact=True).fill("0.26")
    until(lambda: "0.26 " in hint.inner_text())


def test_a_number_in_the_source_is_dragged(xacro: Path, viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    number = length_in_source(page)
    number.hover()  # hover waits until the element stands still
    box = number.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    for far in range(0, 61, 12):
        page.mouse.move(x + far, y)
    page.mouse.up()
    until(lambda: '"base_len" default="0.26"' in xacro.read_text())
    until(lambda: page.locator(".cm-line.here .t-number").inner_text() == "0.26")
    page.locator("#source").get_by_role("button", name="Undo").click()
    until(lambda: '"base_len" default="0.16"' in xacro.read_text())


LEFT_OF_CARET = """caret => {
  const range = document.createRange(), at = caret.firstChild.data.indexOf("^");
  range.setStart(caret.firstChild, at);
  range.setEnd(caret.firstChild, at + 1);
  return range.getBoundingClientRect().left;
}"""


def test_a_caret_is_below_its_column_in_a_line_with_tabs(
    xacro: Path, viewing: str, open_page: OpenPage
) -> None:
    page, macros = open_page(viewing), xacro.with_name("kbot_macros.xacro")
    macros.write_text(macros.read_text().replace('<axis xyz="0 1 0"/>', '\t<axis xyz="0 1 0"\trpy="0 0 0"/>'))
    card = page.locator("#findings li[data-code]").filter(has_text="rpy").first
    until(lambda: card.count() == 1)
    card.locator(".finding").click()
    until(lambda: page.locator(".caret").count() == 1)
    caret = page.locator(".caret").evaluate(LEFT_OF_CARET)
    rpy = page.locator(".cm-line.here .t-name").nth(1)  # after xyz
    assert caret == pytest.approx(rpy.bounding_box()["x"], abs=1.0)


def test_a_click_applies_a_fix(xacro: Path, viewing: str, open_page: OpenPage) -> None:
    page, macros = open_page(viewing), xacro.with_name("kbot_macros.xacro")
    good = macros.read_text()
    macros.write_text(good.replace('<axis xyz="0 1 0"/>', '<axis xyz="0 1 0" rpy="0 0 0"/>'))
    card = page.locator("#findings li[data-code]").filter(has_text="rpy").first
    until(lambda: card.count() == 1)
    card.locator(".finding").click()
    card.locator(".fix").click()
    until(lambda: macros.read_text() == good)
    until(lambda: page.locator("#findings li[data-code]").filter(has_text="rpy").count() == 0)


def test_long_words_of_findings_are_not_clipped(xacro: Path, viewing: str, open_page: OpenPage) -> None:
    page, name = open_page(viewing), "length_of_the_body_without_its_front_and_rear_bumper"
    text = xacro.read_text().replace("${base_mass}", "${" + name[:-2] + "re}", 1)
    first = text.index("<xacro:property")
    xacro.write_text(f'{text[:first]}<xacro:property name="{name}" value="0.2"/>\n{text[first:]}')
    card = page.locator("#findings li[data-severity=error]").filter(has_text=name)
    until(lambda: card.locator(".fix").count() == 1)
    card.locator(".finding").click()
    right = page.locator("#findings").bounding_box()["x"] + page.locator("#findings").bounding_box()["width"]
    for part in (".message", ".hint", ".fix"):
        box = card.locator(part).first.bounding_box()
        assert box["x"] + box["width"] <= right, part
        assert card.locator(part).first.evaluate("e => e.scrollWidth <= e.clientWidth || e.clientWidth === 0")
