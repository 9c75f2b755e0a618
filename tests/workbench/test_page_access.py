"""Accessibility of the page: axe, the keyboard, a narrow page, a large zoom."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from kbot.workbench.protocol import Notice, ProgramView, Refused
from kbot.workbench.session.session import Session

from .axe import violations
from .conftest import until
from .served import run_between_steps, state_of

OpenPage = Callable[..., Any]

SIZES = {"wide": (1440, 900), "phone": (390, 844), "zoomed": (720, 450)}


@pytest.mark.parametrize("theme", ["dark", "light"])
@pytest.mark.parametrize("size", SIZES)
def test_axe_reports_no_violations(
    driving: tuple[str, Session], open_page: OpenPage, theme: str, size: str
) -> None:
    width, height = SIZES[size]
    page = open_page(driving[0], viewport={"width": width, "height": height}, color_scheme=theme)
    for opened in (False, True):
        if opened:
            page.evaluate("document.querySelector('#links [data-link=left_wheel]').click()")
            until(lambda: page.locator(".cm-line.here").count() == 1)
            page.keyboard.press("l")
            until(lambda: page.locator("#plots canvas").count() == 1)
        assert violations(page) == []


def test_forced_colours_hide_no_state(driving: tuple[str, Session], open_page: OpenPage) -> None:
    page = open_page(driving[0], color_scheme="dark", forced_colors="active")
    page.locator("#links [data-link=left_wheel]").click()
    until(lambda: page.locator("#links [aria-selected=true]").count() == 1)

    def ground(selector: str) -> str:
        return str(page.locator(selector).first.evaluate("e => getComputedStyle(e).backgroundColor"))

    assert ground(".chips [aria-pressed=true]") != ground(".chips [aria-pressed=false]")
    assert ground("#links [aria-selected=true]") != ground("#links [aria-selected=false]")
    # green, or nothing if it is off
    assert ground(".lamp[data-level=ok]") != ground(".lamp[data-level=off]")
    assert violations(page) == []


def test_everything_is_reachable_by_keyboard(driving: tuple[str, Session], open_page: OpenPage) -> None:
    page = open_page(driving[0])
    missing = {
        "World",
        "Visual",
        "Front",
        "Pause",
        "Reset",
        "Speed",
        "Stop",
        "base_footprint",
        "wheel_radius",
    }
    for _ in range(250):
        page.keyboard.press("Tab")
        missing.discard(
            page.evaluate(
                "(e => e.getAttribute('aria-label') || e.textContent.trim())(document.activeElement)"
            )
        )
        if not missing:
            break
    assert not missing
    page.locator("#links [data-link=base_footprint]").focus()
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    until(lambda: page.locator("#links [aria-selected=true]").count() == 1)
    assert page.locator("#links [aria-selected=true]").inner_text().startswith("base_link")


def test_a_phone_shows_one_panel_at_a_time(driving: tuple[str, Session], open_page: OpenPage) -> None:
    page = open_page(driving[0], viewport={"width": 390, "height": 844})
    assert page.evaluate("document.documentElement.scrollWidth") == 390
    for name in ("Findings", "Links", "Parameters", "Joints", "Drive"):
        page.locator(".sheets").get_by_role("button", name=name).click()
        shown = [
            p
            for p in ("findings", "links", "parameters", "joints", "drive")
            if page.locator(f"#{p}").is_visible()
        ]
        assert shown == [name.lower()]
    chosen = page.locator(".sheets [aria-pressed=true]")
    assert chosen.all_inner_texts() == ["Drive"]
    for key in ("l", "y"):  # first the plots, then the topics replace the panel
        page.keyboard.press(key)
        until(lambda: page.locator("#drive").is_hidden() and chosen.count() == 0)
    page.keyboard.press("y")
    until(lambda: page.locator("#drive").is_visible() and chosen.all_inner_texts() == ["Drive"])
    page.keyboard.press("?")
    until(lambda: page.locator("dialog.help").is_visible())
    page.keyboard.press("Escape")
    until(lambda: page.locator("dialog.help").is_hidden())


HEARD = """() => {
  window.heard = [];
  const live = "output, [role=status], [role=alert], [role=log], [aria-live]";
  new MutationObserver((changes) => {
    for (const { target } of changes) {
      const region = (target.nodeType === 1 ? target : target.parentElement)?.closest(live);
      if (!region || region.ariaLive === "off" || !region.checkVisibility()) continue;
      heard.push(region.ariaLabel ?? region.className);
    }
  }).observe(document.body, { subtree: true, childList: true, characterData: true });
}"""
"""Collects what a screen reader would announce."""


def test_changing_numbers_are_not_announced(driving: tuple[str, Session], open_page: OpenPage) -> None:
    page = open_page(driving[0])
    slider = page.get_by_role("slider", name="left_wheel_joint")
    first = slider.get_attribute("aria-valuetext")
    assert first.endswith(" degrees")
    page.evaluate(HEARD)
    page.keyboard.down("w")
    until(lambda: state_of(driving[1]).odometry[0] > 0.2)
    page.keyboard.up("w")
    until(lambda: state_of(driving[1]).twist[0] == 0.0)
    assert page.get_by_label("Odometry: x in m").inner_text() != "0.000"
    assert slider.get_attribute("aria-valuetext") != first
    assert page.evaluate("heard") == []
    page.keyboard.press("k")  # single events are announced
    until(lambda: page.get_by_role("button", name="1 bookmark").is_visible())
    run_between_steps(driving[1], lambda: driving[1].announce(Notice("Well done.")))
    until(lambda: page.evaluate("heard") != [])


OVERLAPS = """([one, other]) => {
  const [a, b] = [one, other].map((what) => document.querySelector(what).getBoundingClientRect());
  return a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
}"""


@pytest.mark.parametrize(
    "size",
    [(360, 740), (390, 844), (844, 390), (640, 400), (1280, 800)],
    ids=["small", "phone", "phone on its side", "zoomed", "desktop"],
)
def test_tools_and_notices_do_not_overlap(
    driving: tuple[str, Session], open_page: OpenPage, size: tuple[int, int]
) -> None:
    width, height = size
    page = open_page(driving[0], viewport={"width": width, "height": height})
    until(lambda: page.locator(".timeline").is_visible())
    reason = "this cannot be done, and the reason takes a line or two to tell"
    run_between_steps(driving[1], lambda: driving[1].announce(Refused(reason)))
    until(lambda: page.locator(".notice.info").is_visible())
    for entry, other in (
        (".tools", ".looks"),
        (".transport", ".looks"),
        (".transport", ".tools"),
        (".notice.info", ".looks"),
        (".notice.info", ".tools"),
        (".notice.info", ".transport"),
        (".notice.info", ".timeline"),
    ):
        assert not page.evaluate(OVERLAPS, [entry, other]), (entry, other)


@pytest.mark.parametrize("size", [(1100, 700), (1280, 720), (760, 700)])
def test_long_notices_scroll_beside_the_toolbars_and_can_be_closed(
    xacro: Path, driving: tuple[str, Session], open_page: OpenPage, size: tuple[int, int]
) -> None:
    width, height = size
    address, session = driving
    page = open_page(address, viewport={"width": width, "height": height})
    page.get_by_role("button", name="Edit").click()
    until(lambda: page.locator(".cm-content").is_visible())
    error = "\n".join(f"drive.py:{line}: in step_{line}" for line in range(1, 30))
    view = ProgramView("drive.py", "failed", "", can_start=True, error=error)
    run_between_steps(session, lambda: session.announce(view))
    text = xacro.read_text()
    xacro.write_text(text.replace("${base_mass}", "${base_mas}", 1))
    broken, program = page.locator(".notices > .error:not(.program)"), page.locator(".notice.program")
    until(lambda: broken.is_visible() and program.is_visible())
    for notice in (".notices > .error:not(.program)", ".notice.program"):
        for other in (".tools", ".looks", ".toolbar .chips", ".transport", ".timeline"):
            assert not page.evaluate(OVERLAPS, [notice, other]), (notice, other)
    assert not page.evaluate(OVERLAPS, [".tools", ".timeline"])
    program.hover()
    page.mouse.wheel(0, 2000)
    until(
        lambda: program.evaluate("e => e.scrollTop > 0 && e.scrollTop + e.clientHeight >= e.scrollHeight - 1")
    )
    assert violations(page, ".notices") == []
    program.get_by_role("button", name="Close the error of the program").click()
    until(program.locator("pre").is_hidden)
    assert program.get_by_role("button", name="Run").is_visible()
    broken.get_by_role("button", name="Close this error").click()
    assert broken.is_hidden()
    xacro.write_text(text.replace("${base_mass}", "${another}", 1))
    until(lambda: "another" in broken.inner_text())  # another error is shown


COVERED = """() => [...document.querySelectorAll("button, select, summary, input:not([type=range]), .pad")]
  .filter((one) => one.checkVisibility({ visibilityProperty: true }) && !one.closest("[popover], dialog"))
  .filter((one) => {
    one.scrollIntoView({ block: "center", inline: "center" });
    const { left, right, top, bottom } = one.getBoundingClientRect();
    const there = document.elementFromPoint((left + right) / 2, (top + bottom) / 2);
    return there === null || !(one.contains(there) || there.contains(one));
  })
  .map((one) => one.getAttribute("aria-label") ?? one.textContent)"""
"""What a hand cannot get at: off the screen for good, or beneath something else."""


@pytest.mark.parametrize(
    "size",
    [(390, 844), (844, 390), (320, 640), (195, 422)],
    ids=["phone", "phone on its side", "small", "half a phone"],
)
def test_everything_is_reachable_on_a_small_screen(
    driving: tuple[str, Session], open_page: OpenPage, size: tuple[int, int]
) -> None:
    width, height = size
    page = open_page(driving[0], viewport={"width": width, "height": height})
    for name in ("Drive", "Joints", "Displays"):
        page.locator(".sheets").get_by_role("button", name=name).click()
        assert (
            page.evaluate("Math.max(document.documentElement.scrollWidth, document.body.scrollWidth)")
            == width
        )
        assert page.evaluate(COVERED) == []
