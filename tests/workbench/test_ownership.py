"""Links of places in the text, and how many findings a page receives."""

from pathlib import Path

import pytest

from kbot.text import Diagnostic, Element, KbotError, Origin, Severity, Span
from kbot.workbench.protocol import ApplyFix, CheckTexts
from kbot.workbench.serve import open_session
from kbot.workbench.source.ownership import Ownership
from kbot.xacro import expand

ROBOT = """<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
<xacro:macro name="wheel" params="side">
<link name="${side}_wheel"><visual/></link>
<joint name="${side}" type="fixed"><parent link="base"/><child link="${side}_wheel"/></joint>
</xacro:macro>
<link name="base"><visual><geometry/></visual></link><link name="top"/>
<gazebo reference="base"><friction/></gazebo>
<xacro:wheel side="left"/>
<xacro:wheel side="right"/>
</robot>
"""


@pytest.mark.parametrize(
    ("text", "link"),
    [
        ("<robot", ""),
        ('<link name="base"', "base"),
        ("<geometry/>", "base"),
        ('<link name="top"/>', "top"),
        ("<friction/>", "base"),
        ('<xacro:wheel side="left"', "left_wheel"),
        ('<xacro:wheel side="right"', "right_wheel"),
        ("</robot>", ""),
    ],
)
def test_a_place_belongs_to_the_smallest_element_around_it(tmp_path: Path, text: str, link: str) -> None:
    document = expanded(tmp_path)
    source = document.source
    start = source.data.index(text.encode())
    assert Ownership(document).link_at(Origin(Span(source, start, start + len(text)))) == link


def test_an_element_of_a_macro_belongs_to_the_link_of_its_call(tmp_path: Path) -> None:
    document = expanded(tmp_path)
    ownership = Ownership(document)
    names = ["base", "top", "base", "left_wheel", "left_wheel", "right_wheel", "right_wheel"]
    elements = [element for element in document.elements() if element.tag in ("link", "joint", "gazebo")]
    assert [ownership.link_at(element.origin) for element in elements] == names
    inner = [part for element in elements for part in element.descendants() if part.tag == "visual"]
    assert [ownership.link_at(part.origin) for part in inner] == ["base", "left_wheel", "right_wheel"]


def expanded(folder: Path) -> Element:
    (folder / "robot.xacro").write_text(ROBOT)
    document = expand(str(folder / "robot.xacro")).document
    assert document is not None
    return document


def unconnected(links: int) -> str:
    """Return a robot of which each link but the first has an error."""
    return '<robot name="r">' + "".join(f'<link name="l{n}"/>' for n in range(links)) + "</robot>"


def test_a_page_lists_the_first_findings_and_counts_the_others(tmp_path: Path) -> None:
    file = tmp_path / "robot.urdf"
    file.write_text(unconnected(700))
    shown = open_session(str(file), simulate=False).shown
    total = len(shown.latest.findings)
    assert total > 500
    other = Diagnostic("D100", Severity.WARNING, "about the run", None)
    for found, last in (
        (shown.findings((other,)).findings, ["about the run"]),
        (shown.check(CheckTexts(1, (str(file),), (file.read_text(),))).findings, []),
    ):
        assert [finding.message for finding in found[500:]] == [
            f"{total - 500} more findings are not listed here",
            *last,
        ]
        assert {finding.severity for finding in found[:500]} == {"error"}


def test_the_count_of_findings_has_no_fix(tmp_path: Path) -> None:
    file = tmp_path / "robot.urdf"
    file.write_text(unconnected(700))
    session = open_session(str(file), simulate=False)
    with pytest.raises(KbotError, match="no fix"):
        session.handle(ApplyFix(session.shown.authoring.serial, 500), 1)
