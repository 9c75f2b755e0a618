"""Findings about a run and of a launch file, as pages receive them."""

from pathlib import Path

import pytest

from kbot.text import Diagnostic, KbotError, Origin, Severity, Span, read_source
from kbot.workbench.protocol import Drive, Findings, FromServer, Notice, OpenSource, Reset, SourceText
from kbot.workbench.serve import open_session
from kbot.workbench.session.session import Session

pytestmark = pytest.mark.usefixtures("keeps_up")

SEPARATION = "<wheelSeparation>${wheel_separation}</wheelSeparation>"


@pytest.fixture
def wrong(xacro: Path) -> Path:
    """KBot, whose wheels are 0.174 m apart, with a declared wheel separation of 0.15 m."""
    control = xacro.with_name("kbot_control.xacro")
    text = control.read_text()
    assert SEPARATION in text
    control.write_text(text.replace(SEPARATION, "<wheelSeparation>0.15</wheelSeparation>"))
    return xacro


def announced(session: Session) -> list[FromServer]:
    messages: list[FromServer] = []
    session.announce = messages.append
    return messages


def turn(session: Session, seconds: float) -> None:
    for _ in range(round(seconds / 0.1)):
        session.handle(Drive(0.0, 1.0), 1)
        session.advance(0.1)


def run_codes(message: FromServer) -> list[str]:
    assert isinstance(message, Findings)
    return [finding.code for finding in message.findings if finding.code.startswith("W3")]


def test_a_finding_about_the_run_is_sent_once_with_a_notice_until_a_reset(wrong: Path) -> None:
    session = open_session(str(wrong), simulate=True)
    messages = announced(session)
    turn(session, 10.0)
    sent = [message for message in messages if isinstance(message, Findings)]
    assert [run_codes(message) for message in sent] == [["W301"]]
    (notice,) = [message for message in messages if isinstance(message, Notice)]
    # 1 - 0.15 / 0.174 is 14 %
    assert notice.text == "Odometry is 14 % off. See Findings: W301."
    (found,) = [finding for finding in sent[0].findings if finding.code == "W301"]
    control = wrong.with_name("kbot_control.xacro")
    line = next(n for n, text in enumerate(control.read_text().splitlines(), 1) if ">0.15<" in text)
    assert found.place is not None
    assert (found.place.file, found.place.line) == (str(control), line)
    assert run_codes(session.findings()) == ["W301"]  # as a new page gets it
    session.handle(Reset(), 1)
    assert run_codes(messages[-1]) == []
    turn(session, 0.3)
    assert run_codes(session.findings()) == []


def test_a_good_run_sends_no_findings(xacro: Path) -> None:
    session = open_session(str(xacro), simulate=True)
    messages = announced(session)
    turn(session, 10.0)
    assert [message for message in messages if isinstance(message, Findings | Notice)] == []


def test_findings_about_the_run_do_not_change_the_numbers_of_fixes(wrong: Path) -> None:
    """A page asks for a fix by its number in the list."""
    session = open_session(str(wrong), simulate=True)
    before = session.findings().findings
    turn(session, 10.0)
    assert session.findings().findings[: len(before)] == before


def test_other_findings_are_listed_and_their_file_can_be_opened(xacro: Path, tmp_path: Path) -> None:
    launch = tmp_path / "a.launch"
    launch.write_text('<launch>\n  <node name="a" pkg="p" type="a.py"/>\n</launch>\n')
    session = open_session(str(xacro), simulate=False)
    with pytest.raises(KbotError, match="not part of this description"):
        session.handle(OpenSource(str(launch)), 1)
    messages = announced(session)
    source = read_source(str(launch))
    origin = Origin(Span(source, source.offset(2, 3), len(source.data)))
    session.advance(0.6)
    session.extra_findings.append(Diagnostic("L090", Severity.ERROR, "/a exited with status 1", origin))
    session.advance(0.6)
    (sent,) = [message for message in messages if isinstance(message, Findings)]
    (notice,) = [message for message in messages if isinstance(message, Notice)]
    assert notice.text == "/a exited with status 1. See Findings: L090."
    found = sent.findings[-1]
    assert (found.code, found.severity, found.place.line) == ("L090", "error", 2)
    shown, *_ = session.handle(OpenSource(str(launch)), 1)
    assert isinstance(shown, SourceText)
    assert shown.text == launch.read_text()
