"""Every rule has a page, a failing and a passing fixture, and its fix does what the page says."""

from __future__ import annotations

import re
import shutil
import struct
from pathlib import Path

import pytest

from kbot.checks import Rule, all_rules, check_file
from kbot.checks.config import Config
from kbot.checks.fixes import fixed
from kbot.checks.former_codes import FORMER_CODES
from kbot.checks.runner import check_text
from kbot.text import Diagnostic

FIXTURES = Path(__file__).parent / "fixtures"
EXPECT = re.compile(r"<!-- expect: ([A-Z0-9, ]+) -->")
OWN = sorted((r for r in all_rules().values() if r.needs != "below"), key=lambda r: r.code)


def of_rule(rule: Rule) -> str:
    return rule.code


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path


def fixture(rule: Rule, name: str, folder: Path) -> Path:
    """A copy of a rule's fixture. The mesh with very many triangles is generated."""
    shutil.copytree(FIXTURES / rule.code, folder / rule.code)
    if rule.code == "G110":
        write_dense_mesh(folder / rule.code / "meshes" / "dense.stl")
    return folder / rule.code / f"{name}.xacro"


def write_dense_mesh(path: Path, triangles: int = 10_050) -> None:
    """Write a binary STL: a zigzag ribbon of 0.1 m."""
    step = 0.1 / triangles
    with path.open("wb") as stream:
        stream.write(bytes(80) + struct.pack("<I", triangles))
        for i in range(triangles):
            x = i * step
            corners = (x, 0.0, 0.0, x + step, 0.1, 0.0, x + 2 * step, 0.0, 0.1)
            stream.write(struct.pack("<12fH", 0.0, 0.0, 0.0, *corners, 0))


def expected(path: Path) -> set[tuple[str, int]]:
    lines = path.read_text("utf-8").splitlines()
    marks = ((n, m[1]) for n, line in enumerate(lines, 1) if (m := EXPECT.search(line)))
    return {(code.strip(), n) for n, codes in marks for code in codes.split(",")}


def places(found: tuple[Diagnostic, ...]) -> set[tuple[str, int]]:
    return {(d.code, d.origin.span.line) for d in found if d.origin}


@pytest.mark.parametrize("rule", OWN, ids=of_rule)
def test_failing_fixture_has_exactly_the_findings_it_names(rule: Rule, folder: Path) -> None:
    path = fixture(rule, "fails", folder)
    found = check_file(str(path), config=Config())
    assert places(found) == expected(path)
    assert rule.code in {d.code for d in found}


@pytest.mark.parametrize("rule", OWN, ids=of_rule)
def test_only_errors_that_only_ros_raises_say_so(rule: Rule, folder: Path) -> None:
    found = check_file(str(fixture(rule, "fails", folder)), config=Config())
    assert {d.message.startswith("on ROS: ") for d in found if d.code == rule.code} == {rule.is_ros_only}


def test_some_rules_are_about_ros_alone() -> None:
    assert {"J101", "U204", "D129"} <= {rule.code for rule in OWN if rule.is_ros_only}


@pytest.mark.parametrize("rule", OWN, ids=of_rule)
def test_passing_fixture_has_no_such_finding(rule: Rule, folder: Path) -> None:
    path = fixture(rule, "passes", folder)
    assert rule.code not in {d.code for d in check_file(str(path), config=Config())}


@pytest.mark.parametrize("rule", sorted(all_rules().values(), key=of_rule), ids=of_rule)
def test_every_rule_has_a_complete_page(rule: Rule) -> None:
    assert re.fullmatch(r"[A-Z]\d{3}", rule.code)
    assert re.fullmatch(r"[a-z][a-z0-9]*(-[a-z0-9]+)*", rule.name)
    assert re.match(r"What: [A-Z0-9`$]", rule.page)
    for part in ("Why:", "Example:", "Fix:", "Autofix:"):
        assert f"\n\n{part} " in rule.page, f"{rule.code} lacks {part}"


def findings_of(path: Path, text: str) -> tuple[Diagnostic, ...]:
    return check_text(text, str(path), config=Config())


@pytest.mark.parametrize("rule", [r for r in OWN if r.fix != "none"], ids=of_rule)
def test_fix_removes_the_finding_and_is_idempotent(rule: Rule, folder: Path) -> None:
    path = fixture(rule, "fails", folder)
    text = path.read_text("utf-8")
    offered = [d.fix for d in findings_of(path, text) if d.code == rule.code]
    assert any(fix and fix.safe == (rule.fix == "safe") for fix in offered), f"{rule.code} offers no fix"
    after_fixes, applied, _ = fixed(text, str(path), lambda t: findings_of(path, t), unsafe=True)
    assert applied
    before, after = findings_of(path, text), findings_of(path, after_fixes)
    assert len(after) < len(before)
    assert rule.code not in {d.code for d in after}
    assert not any(d.is_error for d in after) or any(d.is_error for d in before)
    assert fixed(after_fixes, str(path), lambda t: findings_of(path, t), unsafe=True)[:2] == (after_fixes, [])


def test_every_fixture_belongs_to_a_rule() -> None:
    assert {p.name for p in FIXTURES.iterdir()} == {rule.code for rule in OWN}


def test_every_code_has_a_page() -> None:
    source = Path(__file__).parents[2] / "src" / "kbot"
    given = {
        code
        for file in source.rglob("*.py")
        for code in re.findall(r'"([A-Z]\d{3})"', file.read_text("utf-8"))
    }
    assert {"D107", "L053", "W201"} <= given
    assert given - set(all_rules()) == set(FORMER_CODES)


@pytest.mark.parametrize(
    ("count", "finding"), [(400, "does not use its parameter 'lost'"), (700, "are not checked")]
)
def test_unchecked_parameters_are_reported_once(count: int, finding: str, tmp_path: Path) -> None:
    """Each macro calls the next one. The last one calls none."""
    macros = [f'<xacro:macro name="m{n}"><xacro:m{n + 1}/></xacro:macro>' for n in range(1, count)]
    macros[0] = macros[0].replace("><", ' params="lost"><', 1)
    text = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="a"/>\n'
    text += "\n".join(macros) + "\n</robot>\n"
    found = [d for d in findings_of(tmp_path / "r.xacro", text) if d.code == "S104"]
    assert [finding in d.message for d in found] == [True]
