"""Findings about a run and of a launch file in the page: their cards, their notice and their source."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from kbot.text import Diagnostic, Origin, Severity, Span, read_source
from kbot.workbench.serve import open_session
from kbot.workbench.session.session import Session

from .conftest import until
from .served import served

OpenPage = Callable[..., Any]


def card(page: Any, code: str) -> Any:
    return page.locator(f'#findings li[data-code="{code}"]')


def test_wrong_odometry_is_a_finding_that_leads_to_its_line_until_a_reset(
    xacro: Path, open_page: OpenPage, keeps_up: None
) -> None:
    """The declared wheel separation is 0.15 m, and the wheels are 0.174 m apart."""
    control = xacro.with_name("kbot_control.xacro")
    text = control.read_text()
    control.write_text(text.replace("<wheelSeparation>${wheel_separation}", "<wheelSeparation>0.15"))
    with served(open_session(str(xacro), simulate=True)) as address:
        page = open_page(address)
        page.keyboard.down("ArrowLeft")
        until(lambda: card(page, "W301").count() == 1)
        page.keyboard.up("ArrowLeft")
        until(lambda: "Odometry is 14 % off" in page.locator(".notice.info").inner_text())
        assert "D105" in card(page, "W301").inner_text()
        card(page, "W301").locator(".finding").click()
        until(lambda: page.locator(".cm-line.here").count() == 1)
        assert "<wheelSeparation>0.15" in page.locator(".cm-line.here").inner_text()
        page.keyboard.press("Escape")
        page.keyboard.press("r")
        until(lambda: card(page, "W301").count() == 0)


def test_a_failed_node_is_a_finding_that_leads_to_its_launch_file(
    xacro: Path, driving: tuple[str, Session], open_page: OpenPage, tmp_path: Path
) -> None:
    launch = tmp_path / "a.launch"
    launch.write_text('<launch>\n  <node name="follower" pkg="p" type="follower.py"/>\n</launch>\n')
    address, session = driving
    page = open_page(address)
    source = read_source(str(launch))
    origin = Origin(Span(source, source.offset(2, 3), source.offset(2, 8)))
    session.extra_findings.append(
        Diagnostic("L090", Severity.ERROR, "/follower exited with status 1", origin)
    )
    until(lambda: card(page, "L090").count() == 1)
    # errors are first, whatever they are about
    assert page.locator("#findings li[data-code]").first.get_attribute("data-code") == "L090"
    assert "a.launch:2:3" in card(page, "L090").inner_text()
    card(page, "L090").locator(".finding").click()
    until(lambda: page.locator(".cm-line.here").count() == 1)
    assert 'name="follower"' in page.locator(".cm-line.here").inner_text()
