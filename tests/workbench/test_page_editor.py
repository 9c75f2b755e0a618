"""The text editor of the page, as a user types in it."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from kbot.workbench.serve import open_session

from .axe import violations
from .conftest import until
from .pictures import blue, screenshot
from .served import served

OpenPage = Callable[..., Any]

FOCUS = "document.querySelector('.source-text').shadowRoot?.activeElement?.classList.contains('cm-content')"


def open_editor(page: Any) -> Any:
    """Click Edit, and return the text that then has the focus."""
    page.get_by_role("button", name="Edit", exact=True).click()
    until(lambda: page.evaluate(FOCUS))
    return page.get_by_role("textbox", name="Source text")


def go_to(page: Any, line: int, column: int = 1) -> None:
    """Move the cursor by keys."""
    page.keyboard.press("Control+Home")
    for _ in range(line - 1):
        page.keyboard.press("ArrowDown")
    page.keyboard.press("Home")
    page.keyboard.press("Home")
    for _ in range(column - 1):
        page.keyboard.press("ArrowRight")


def leave_editor(page: Any) -> None:
    """Move the focus from the text to its tab. The first Escape may close a list of completions."""
    while page.evaluate(FOCUS):
        page.keyboard.press("Escape")


def unsaved(page: Any) -> bool:
    return page.locator("#source .tabs .unsaved").count() > 0


@pytest.fixture
def empty(tmp_path: Path) -> Iterator[tuple[Path, str]]:
    """An empty description, and the address of its page."""
    file = tmp_path / "robot.urdf"
    file.write_text("")
    with served(open_session(str(file), simulate=False)) as address:
        yield file, address


def test_a_robot_is_typed_into_an_empty_file(empty: tuple[Path, str], open_page: OpenPage) -> None:
    file, address = empty
    page = open_page(address)
    notice = page.get_by_role("alert").filter(has_text="the file is empty")
    until(notice.is_visible)
    assert "robot.urdf:1: the file is empty" in notice.inner_text()
    assert "The robot appears when you save a version without errors." in notice.inner_text()
    assert page.locator("#links [data-link]").count() == 0
    before = blue(screenshot(page)).sum()
    open_editor(page)
    page.keyboard.insert_text(
        '<robot name="r">\n<material name="b"><color rgba="0 0 1 1"/></material>\n</robot>'
    )
    until(lambda: unsaved(page))
    assert file.read_text() == ""
    page.keyboard.press("Control+s")
    until(lambda: file.read_text().startswith('<robot name="r">'))
    until(lambda: "the robot has no link" in page.locator(".notices .error").inner_text())
    assert not unsaved(page)
    go_to(page, 3)
    page.keyboard.insert_text(
        '<link name="base"><visual><geometry><box size="1 1 1"/></geometry>'
        '<material name="b"/></visual></link>\n'
    )
    page.keyboard.press("Control+s")
    until(lambda: page.locator("#links [data-link=base]").count() == 1)
    until(page.locator(".notices .error").is_hidden)
    until(lambda: blue(screenshot(page)).sum() > before + 1000)


def test_a_broken_file_opens_with_its_errors(tmp_path: Path, open_page: OpenPage) -> None:
    file = tmp_path / "robot.urdf"
    file.write_text('<robot name="r">\n  <link name="a">\n</robot>\n')
    with served(open_session(str(file), simulate=True, world="boxes:count=3")) as address:
        page = open_page(address)
        card = page.locator("#findings li[data-code=P001]")
        until(lambda: card.count() == 1)
        assert "there is no robot yet" in page.locator("#drive").inner_text()
        page.get_by_role("button", name="not well-formed").first.click()
        until(lambda: page.locator(".cm-line.here").count() == 1)
        until(lambda: page.locator(".cm-lintRange-error").count() > 0)


def test_tags_attributes_and_names_are_completed(viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    open_editor(page)
    options = page.locator(".cm-tooltip-autocomplete li")
    line = page.locator(".cm-activeLine")

    def complete(typed: str, label: str, text: str) -> None:
        page.keyboard.type(typed)
        chosen = page.locator(".cm-tooltip-autocomplete li[aria-selected]")
        until(lambda: chosen.count() == 1 and label in chosen.inner_text())
        page.wait_for_timeout(100)  # CodeMirror ignores keys just after its list has opened
        page.keyboard.press("Enter")
        until(lambda: line.inner_text().strip() == text)

    go_to(page, 6)
    complete("<jo", "joint", "<joint")
    complete(" ty", "type", '<joint type=""')
    until(lambda: options.count() > 0)
    complete("pri", "prismatic", '<joint type="prismatic"')
    page.keyboard.press("End")
    page.keyboard.type("><pa")
    complete("r", "parent", '<joint type="prismatic"><parent')
    complete(" l", "link", '<joint type="prismatic"><parent link=""')
    until(lambda: options.count() > 0)
    complete("base_l", "base_link", '<joint type="prismatic"><parent link="base_link"')
    page.keyboard.press("End")
    page.keyboard.press("Enter")
    complete("<xacro:whe", "xacro:wheel", "<xacro:wheel")


def test_unsaved_text_is_checked_and_fixed(xacro: Path, viewing: str, open_page: OpenPage) -> None:
    page, text = open_page(viewing), xacro.read_text()
    open_editor(page)
    go_to(page, text[: text.index("<link")].count("\n") + 1)
    page.keyboard.insert_text('<material name="q"><color rgba="1 1 1 1" alpha="2"/></material>')
    card = page.locator("#findings li[data-code=U202]")
    until(lambda: card.count() == 1)
    assert xacro.read_text() == text
    page.locator(".cm-lintRange-info").first.hover()
    tooltip = page.locator(".cm-tooltip")
    until(lambda: "'alpha' is not an attribute of <color>" in tooltip.inner_text())
    tooltip.get_by_role("button", name="remove alpha").click()
    until(lambda: card.count() == 0)
    assert '<color rgba="1 1 1 1"/>' in page.locator(".cm-content").inner_text()
    assert xacro.read_text() == text
    page.locator(".cm-content").focus()
    page.keyboard.press("Control+z")
    until(lambda: card.count() == 1)
    card.locator(".finding").click()
    until(lambda: page.locator(".caret").filter(has_text="alpha").count() == 1)
    card.locator(".fix").click()
    until(lambda: card.count() == 0)
    page.locator(".cm-content").focus()
    page.keyboard.press("Control+z")
    until(lambda: card.count() == 1)
    page.keyboard.press("Control+.")
    until(lambda: card.count() == 0)
    while unsaved(page):
        page.keyboard.press("Control+z")
    assert xacro.read_text() == text


def type_while_another_program_saves(page: Any, xacro: Path) -> str:
    """Type a comment before line 2 while another program changes another line. Returns the text it saves."""
    open_editor(page)
    go_to(page, 2)
    page.keyboard.insert_text("<!-- mine -->\n")
    changed = xacro.read_text().replace('"base_len" default="0.16"', '"base_len" default="0.26"')
    xacro.write_text(changed)
    return changed


def test_a_save_keeps_the_changes_of_another_editor(xacro: Path, viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    changed = type_while_another_program_saves(page, xacro)
    until(lambda: "Another program has changed kbot.xacro" in page.locator(".source-note").inner_text())
    assert "<!-- mine -->" in page.locator(".cm-content").inner_text()
    page.get_by_role("button", name="Save", exact=True).click()
    first, rest = changed.split("\n", 1)
    merged = f"{first}\n<!-- mine -->\n{rest}"
    until(lambda: xacro.read_text() == merged)
    until(lambda: not unsaved(page))
    until(lambda: 'default="0.26"' in page.locator(".cm-content").inner_text())
    until(page.locator(".source-note").is_hidden)


def test_undo_after_a_merged_save_keeps_the_other_program_s_change(
    xacro: Path, viewing: str, open_page: OpenPage
) -> None:
    page = open_page(viewing)
    changed = type_while_another_program_saves(page, xacro)
    until(lambda: page.locator(".source-note").is_visible())
    page.keyboard.press("Control+s")
    until(lambda: "<!-- mine -->" in xacro.read_text())
    until(lambda: 'default="0.26"' in page.locator(".cm-content").inner_text())
    page.keyboard.press("Control+z")
    until(lambda: unsaved(page))
    page.keyboard.press("Control+s")
    until(lambda: xacro.read_text() == changed)


def test_undo_after_an_outside_change_makes_no_text_that_was_not_typed(
    xacro: Path, viewing: str, open_page: OpenPage
) -> None:
    page, text = open_page(viewing), xacro.read_text()
    open_editor(page)
    for line, comment in ((6, "<!-- A -->"), (10, "<!-- B -->")):
        go_to(page, line)
        page.keyboard.press("End")
        page.keyboard.insert_text(comment)
        page.keyboard.press("Control+s")
        until(lambda comment=comment: comment in xacro.read_text())
        until(lambda: not unsaved(page))
    changed = text.replace('name="kbot">', 'name="mine">')
    assert changed != text
    xacro.write_text(changed)
    until(lambda: 'name="mine"' in page.locator(".cm-content").inner_text())
    page.keyboard.press("Control+z")
    page.keyboard.insert_text("<!-- C -->")
    page.keyboard.press("Control+s")
    until(lambda: "<!-- C -->" in xacro.read_text())
    assert xacro.read_text().replace("<!-- C -->", "") == changed


@pytest.mark.parametrize("mine", ["", "<!-- mine -->"])
@pytest.mark.parametrize("by", ["button", "key"])
def test_a_deleted_file_is_saved_again(
    xacro: Path, viewing: str, open_page: OpenPage, mine: str, by: str
) -> None:
    page, text = open_page(viewing), xacro.read_text()
    open_editor(page)
    page.keyboard.insert_text(mine)
    xacro.unlink()
    until(lambda: "does not exist" in page.locator(".notices .error").inner_text())
    note = page.locator(".source-note")
    until(lambda: "kbot.xacro was deleted. Save writes it again." in note.inner_text())
    until(lambda: "Save in the editor writes it again." in page.locator(".notices .error").inner_text())
    assert page.locator(".notice:visible").count() == 1
    assert not xacro.exists()
    if by == "key":
        page.keyboard.press("Control+s")
    else:
        page.get_by_role("button", name="Save", exact=True).click()
    until(lambda: xacro.exists() and xacro.read_text() == f"{mine}{text}")
    until(lambda: not unsaved(page))
    until(note.is_hidden)


@pytest.mark.parametrize("choice", ["Keep my text", "Use the text of the file"])
def test_a_conflict_shows_both_choices(xacro: Path, viewing: str, open_page: OpenPage, choice: str) -> None:
    page, text = open_page(viewing), xacro.read_text()
    open_editor(page)
    line = text[: text.index('<xacro:arg name="base_len"')].count("\n") + 1
    go_to(page, line)
    page.keyboard.insert_text("<!-- mine -->")
    theirs = text.replace('"base_len" default="0.16"', '"base_len" default="0.26"')
    xacro.write_text(theirs)
    until(lambda: page.locator(".source-note").is_visible())
    page.keyboard.press("Control+s")
    until(page.get_by_role("button", name=choice).is_visible)
    assert xacro.read_text() == theirs, "nothing is written before the choice"
    page.get_by_role("button", name=choice).click()
    until(lambda: not unsaved(page))
    mine = "\n".join(
        f"<!-- mine -->{row}" if number == line else row for number, row in enumerate(text.split("\n"), 1)
    )
    until(lambda: xacro.read_text() == (mine if choice == "Keep my text" else theirs))
    shown = page.locator(".cm-content")
    until(lambda: ("<!-- mine -->" in shown.inner_text()) is (choice == "Keep my text"))
    if choice != "Keep my text":
        shown.focus()
        page.keyboard.press("Control+z")
        until(lambda: "<!-- mine -->" in shown.inner_text())  # the refused text is not lost


def test_an_external_save_keeps_cursor_and_scroll(xacro: Path, viewing: str, open_page: OpenPage) -> None:
    page, text = open_page(viewing), xacro.read_text()
    open_editor(page)
    go_to(page, 40, 3)
    top = page.locator(".cm-scroller").evaluate("e => e.scrollTop")
    assert top > 0
    xacro.write_text(text.replace('"base_len" default="0.16"', '"base_len" default="0.26"'))
    until(lambda: page.get_by_label("base_len, as a number").input_value() == "0.26")
    assert not unsaved(page)
    assert page.locator(".cm-scroller").evaluate("e => e.scrollTop") == pytest.approx(top, abs=2)
    page.keyboard.insert_text("|")
    lines = xacro.read_text().split("\n")
    until(lambda: page.locator(".cm-activeLine").inner_text().startswith(lines[39][:2] + "|"))


def test_leaving_with_unsaved_text_is_questioned(viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    asked: list[str] = []
    page.once("dialog", lambda dialog: (asked.append(dialog.type), dialog.accept()))
    open_editor(page)
    page.keyboard.insert_text("<!-- -->")
    until(lambda: unsaved(page))
    page.reload()
    until(lambda: asked == ["beforeunload"])


def test_typing_does_not_reach_the_page(driving: tuple[str, Any], open_page: OpenPage) -> None:
    address, session = driving
    page = open_page(address)
    open_editor(page)
    page.keyboard.type("wasd pr 1234 lyt?")
    assert "wasd pr 1234 lyt?" in page.locator(".cm-activeLine").inner_text()
    page.keyboard.down("w")
    page.keyboard.up("w")
    assert session.state().command == (0.0, 0.0)
    assert not session.paused
    assert page.locator("dialog[open]").count() == 0
    assert page.locator("#plots").is_hidden()
    page.keyboard.press("Delete")
    leave_editor(page)
    until(lambda: page.evaluate("document.activeElement.getAttribute('role')") == "tab")
    assert page.locator("#source").is_visible()
    page.keyboard.press("Escape")
    until(page.locator("#source").is_hidden)
    assert page.locator(".edit-source").is_visible()


def test_keys_alone_open_the_editor_and_find_a_word(viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    page.get_by_role("button", name="Edit", exact=True).focus()
    page.keyboard.press("Enter")
    until(lambda: page.evaluate(FOCUS))
    page.keyboard.press("Control+f")
    until(lambda: page.locator(".cm-search").count() == 1)
    page.keyboard.type("base_len")
    page.keyboard.press("Enter")
    until(lambda: page.locator(".cm-searchMatch-selected").count() == 1)
    page.keyboard.press("Escape")
    until(lambda: page.evaluate(FOCUS) and page.locator(".cm-search").count() == 0)


def test_a_file_of_an_include_is_edited_in_its_tab(xacro: Path, viewing: str, open_page: OpenPage) -> None:
    page, macros = open_page(viewing), xacro.with_name("kbot_macros.xacro")
    text = macros.read_text()
    open_editor(page)
    page.keyboard.insert_text("<!-- a -->")
    leave_editor(page)
    page.keyboard.press("ArrowRight")
    tab = page.get_by_role("tab", name="kbot_macros.xacro")
    until(lambda: tab.get_attribute("aria-selected") == "true")
    until(lambda: "macro" in page.locator(".cm-content").inner_text())
    page.locator(".cm-content").focus()
    page.keyboard.press("Control+End")
    page.keyboard.insert_text("<!-- b -->")
    until(lambda: page.locator("#source .tabs .unsaved").count() == 2)
    page.get_by_role("tab", name="kbot.xacro").click()
    until(lambda: "<!-- a -->" in page.locator(".cm-content").inner_text())
    page.locator("#links").click()
    page.keyboard.press("Control+s")
    until(lambda: macros.read_text() == f"{text}<!-- b -->")
    until(lambda: not unsaved(page))


def test_the_text_of_an_include_that_is_no_longer_used_is_saved(
    xacro: Path, viewing: str, open_page: OpenPage
) -> None:
    page, macros = open_page(viewing), xacro.with_name("kbot_macros.xacro")
    text = macros.read_text()
    open_editor(page)
    page.get_by_role("tab", name="kbot_macros.xacro").click()
    until(lambda: "macro" in page.locator(".cm-content").inner_text())
    page.locator(".cm-content").focus()
    page.keyboard.press("Control+Home")
    page.keyboard.insert_text("<!-- mine -->")
    xacro.write_text('<robot name="r"><link name="alone"/></robot>')
    until(lambda: page.locator("#links [data-link=alone]").count() == 1)
    page.keyboard.press("Control+s")
    until(lambda: macros.read_text() == f"<!-- mine -->{text}")
    until(lambda: not unsaved(page))


def test_a_message_below_a_long_line_is_visible(xacro: Path, viewing: str, open_page: OpenPage) -> None:
    page, name = open_page(viewing), "n" * 400
    color = f'<color rgba="1 1 1 1" alpha="2" {name}="1"/>'
    xacro.write_text(xacro.read_text().replace("<link", f'<material name="q">{color}</material><link', 1))
    cards = page.locator("#findings li[data-code=U202]")
    until(lambda: cards.count() == 2)
    text, message = page.locator(".cm-scroller"), page.locator(".caret .finding-message")
    for card in cards.all():
        card.locator(".finding").click()
        finding = card.locator(".finding").inner_text()
        until(lambda finding=finding: message.count() == 1 and message.inner_text() in finding)
        outer, inner = text.bounding_box(), message.bounding_box()
        assert outer["x"] < inner["x"]
        assert inner["x"] + inner["width"] <= outer["x"] + outer["width"]


def test_the_built_in_robot_is_read_only(open_page: OpenPage) -> None:
    with served(open_session("kbot", simulate=False)) as address:
        page = open_page(address)
        open_editor(page)
        until(lambda: "Read only: this robot ships with KBot" in page.locator(".source-note").inner_text())
        page.keyboard.type("x")
        assert not unsaved(page)
        assert page.get_by_role("button", name="Save", exact=True).is_hidden()


def test_why_and_fix_of_a_rule_open_beside_a_finding(xacro: Path, viewing: str, open_page: OpenPage) -> None:
    page, macros = open_page(viewing), xacro.with_name("kbot_macros.xacro")
    macros.write_text(macros.read_text().replace('<axis xyz="0 1 0"/>', '<axis xyz="0 1 0" rpy="0 0 0"/>'))
    card = page.locator("#findings li[data-code=U202]")
    until(lambda: card.count() == 1)
    card.locator(".finding").click()
    card.get_by_text("Why?").click()
    until(lambda: "URDF parsers ignore it" in card.locator(".rule-page").inner_text())
    assert "Correct the name of the attribute" in card.locator(".rule-page").inner_text()


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_the_editor_is_accessible(viewing: str, xacro: Path, open_page: OpenPage, theme: str) -> None:
    page = open_page(viewing, color_scheme=theme)
    open_editor(page)
    go_to(page, 6)
    page.keyboard.type("<li")
    until(lambda: page.locator(".cm-tooltip-autocomplete").count() == 1)
    until(lambda: page.locator(".cm-lintRange-error").count() > 0)
    assert violations(page, "#source") == []
    page.keyboard.press("Escape")
    page.keyboard.press("Control+f")
    until(lambda: page.locator(".cm-search").count() == 1)
    assert violations(page, "#source") == []
