"""Following a suggestion or a fix gives the right robot or an error, never a worse robot without an error."""

from __future__ import annotations

import ast
import re
from collections import Counter
from pathlib import Path

import pytest

import kbot
from kbot.checks import Config, check_file, check_text
from kbot.checks.fixes import fixed
from kbot.text import Diagnostic, Edit, Fix, Origin, Severity, Source, Span
from kbot.text.edits import apply_edits
from kbot.text.suggest import Suggestion

from .mutators import MUTATORS, Mutator
from .robots import ROVERS, rover

CASTER = """<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:property name="wheel_radius" value="0.035"/>
  <link name="base_link">
    <visual><geometry><sphere radius="${wheel_radius}"/></geometry></visual>
  </link>
  <link name="caster"/>
  <joint name="caster_joint" type="fixed">
    <parent link="base_link"/><child link="caster"/>
    <origin xyz="0 0 ${caster_wheel_radius - wheel_radius}"/>
  </joint>
</robot>
"""


def found_in(text: str) -> tuple[Diagnostic, ...]:
    return check_text(text, "robot.xacro", config=Config(ignore=("I1",)))


def test_undefined_name_is_not_replaced_by_a_similar_name() -> None:
    """Only the author knows the value, so there is no fix."""
    (error,) = (d for d in found_in(CASTER) if d.is_error)
    assert error.message == "unknown property 'caster_wheel_radius'"
    assert error.hint == 'Define it with <xacro:property name="caster_wheel_radius" value="…"/>'
    assert error.fix is None
    assert fixed(CASTER, "robot.xacro", found_in, unsafe=True)[0] == CASTER


def test_property_with_the_placeholder_of_the_hint_is_an_error() -> None:
    text = CASTER.replace("<link", '<xacro:property name="caster_wheel_radius" value="${…}"/>\n  <link', 1)
    (error,) = (d for d in found_in(text) if d.is_error)
    assert (error.code, error.origin and error.origin.span.line) == ("X100", 3)
    assert error.message == "the property 'caster_wheel_radius' has no value"
    assert not [d for d in found_in(text.replace("${…}", "0.02")) if d.is_error]


def test_typo_gets_a_suggestion() -> None:
    text = CASTER.replace("caster_wheel_radius", "wheel_raduis")
    (error,) = (d for d in found_in(text) if d.is_error)
    assert (error.message, error.hint) == ("unknown property 'wheel_raduis'", "did you mean 'wheel_radius'?")


def test_property_that_a_misspelt_name_may_mean_is_not_removed() -> None:
    """`wheel_size` seems unused because `${size_of_the_wheels}` is undefined. It is not reported while there
    is an error: removing it would lose its value."""
    text = CASTER.replace("${caster_wheel_radius - wheel_radius}", "${size_of_the_wheels}")
    text = text.replace("  <link", '  <xacro:property name="wheel_size" value="0.07"/>\n  <link', 1)
    assert {d.code for d in found_in(text)} == {"X103"}
    assert "S101" in {d.code for d in found_in(text.replace("${size_of_the_wheels}", "0"))}
    assert '"wheel_size"' in fixed(text, "robot.xacro", found_in, unsafe=True)[0]


def uses(text: str, name: str) -> list[int]:
    """The places where a text has the name as a whole word, including its definition."""
    return [match.start() for match in re.finditer(rf"\b{name}\b", text)]


@pytest.mark.parametrize(
    ("expression", "message", "hint"),
    [
        # `${degrees}` would expand to "<built-in function degrees>"
        ("degree", "unknown property 'degree'", 'Define it with <xacro:property name="degree" value="…"/>'),
        ("sqtr(wheel_radius)", "unknown function 'sqtr'", "did you mean 'sqrt' or 'str'?"),
        ("lenn('a')", "unknown function 'lenn'", "did you mean 'len'?"),
        ("size_of(wheel_radius)", "unknown function 'size_of'", ""),
        ("max([radian(i) for i in [1, 2]])", "unknown function 'radian'", "did you mean 'radians'?"),
    ],
)
def test_function_is_suggested_only_for_a_call(expression: str, message: str, hint: str) -> None:
    text = CASTER.replace("caster_wheel_radius - wheel_radius", expression)
    (error,) = (d for d in found_in(text) if d.is_error)
    assert (error.message, error.hint) == (message, hint)


DEFINED = re.compile(r'<(?:xacro:property|xacro:macro|xacro:arg|link|joint) name="(\w+)"')
CLEAN = rover(ROVERS[0])
NAMES = sorted(name for name in set(DEFINED.findall(CLEAN)) if len(uses(CLEAN, name)) > 1)


@pytest.mark.parametrize("name", NAMES)
def test_undefined_name_is_not_replaced_by_another(name: str) -> None:
    """Rename one definition of the clean robot. No suggestion or fix may then give a robot without an error
    that uses another part instead."""
    mutant = DEFINED.sub(lambda m: m[0].replace(f'"{name}"', '"zzz_qqq"') if m[1] == name else m[0], CLEAN)
    assert mutant != CLEAN
    for found in found_in(mutant):
        assert not getattr(found.hint, "nearest", ()), found
    after = found_in(fixed(mutant, "robot.xacro", found_in, unsafe=True)[0])
    assert any(d.code not in ("S101", "S102", "S103") for d in after)


@pytest.mark.parametrize("name", [name for name in NAMES if len(name) >= 4])
def test_typo_in_a_name_is_fixed_or_reported(name: str) -> None:
    """The last use of a name is misspelt in three ways. Following each suggestion gives the clean robot."""
    start = uses(CLEAN, name)[-1]
    for typo in (name[:2] + name[3:], name[0] + name[2] + name[1] + name[3:], name + name[-1]):
        mutant = CLEAN[:start] + typo + CLEAN[start + len(name) :]
        suggested = [d.hint for d in found_in(mutant) if isinstance(d.hint, Suggestion) and d.hint.nearest]
        assert all(hint.nearest == (name,) for hint in suggested), suggested
        after = fixed(mutant, "robot.xacro", found_in, unsafe=False)[0]
        assert after == CLEAN or found_in(after)


@pytest.mark.parametrize("mutator", MUTATORS, ids=lambda m: f"{m.code}-{m.name}")
def test_no_fix_causes_another_finding(mutator: Mutator) -> None:
    """Each fix of a mutant is applied alone, safe or not. Afterwards there is no new finding, or an error
    that says what to do."""
    mutant = next(mutant for robot in ROVERS if (mutant := mutator.spoil(rover(robot))))[0]
    before = found_in(mutant)
    for finding in before:
        if finding.fix is None:
            continue
        after = found_in(apply_edits(mutant, finding.fix.edits))
        new = Counter(d.code for d in after) - Counter(d.code for d in before)
        assert not new or any(d.is_error for d in after), (finding.code, finding.fix.title, new)


MANY_FIXES = "\n".join(["bad" if number % 10 == 3 else "good" for number in range(100)])


def found_by_word(text: str) -> list[Diagnostic]:
    """One finding with a fix for each `good` and `bad`. The fix of `bad` causes an error."""
    source = Source("robot.xacro", text)
    found = list[Diagnostic]()
    for match in re.finditer(r"good|bad|error", text):
        span = Span(source, *match.span())
        replacement = {"good": "done", "bad": "error"}.get(match[0])
        fix = Fix(f"byte {span.start}", (Edit(span, replacement),), safe=True) if replacement else None
        severity = Severity.WARNING if fix else Severity.ERROR
        found.append(Diagnostic("T101", severity, match[0], Origin(span), fix=fix))
    return found


@pytest.mark.parametrize("size", [5_000, 41_000, 201_000])
def test_helpful_fixes_are_applied_although_others_fail(size: int) -> None:
    """The search ends without a note: a note is a warning, which would fail the test."""
    text = MANY_FIXES + " " * (size - len(MANY_FIXES))
    after, applied, _ = fixed(text, "robot.xacro", found_by_word, unsafe=False)
    assert after == text.replace("good", "done")
    assert len(applied) == 90


def test_search_stops_with_a_note_after_too_many_failures(monkeypatch: pytest.MonkeyPatch) -> None:
    """In a large file 17 tries may fail. The fixes that helped until then are applied."""
    monkeypatch.setattr("kbot.checks.fixes._CHECKED_BYTES", 0)  # simulates a file of some megabytes
    text, tries = MANY_FIXES, list[str]()

    def check(changed: str) -> list[Diagnostic]:
        tries.append(changed)
        return found_by_word(changed)

    with pytest.warns(UserWarning, match="stopped after 17 tries: run `kbot check --fix` again"):
        after, applied, _ = fixed(text, "robot.xacro", check, unsafe=False)
    assert "error" not in after
    assert 0 < len(applied) < 90
    assert after.count("done") == len(applied)
    assert len(tries) <= 2 * 17 + 1


PLACEHOLDER = re.compile(r"…|\.\.\.|\bTODO\b|\bXXX\b|=['\"][A-Z_]+['\"]")
"""Texts that only a person can replace."""
DESCRIPTIONS = sorted(
    path
    for folder in (Path(__file__).parent / "fixtures", Path(__file__).parents[1] / "xacro" / "broken")
    for path in folder.rglob("*.xacro")
)


@pytest.mark.parametrize("path", DESCRIPTIONS, ids=[f"{p.parent.name}/{p.stem}" for p in DESCRIPTIONS])
def test_no_fix_writes_a_placeholder(path: Path) -> None:
    for found in check_file(str(path), config=Config()):
        for edit in found.fix.edits if found.fix is not None else ():
            written = PLACEHOLDER.findall(edit.replacement)
            assert len(written) <= len(PLACEHOLDER.findall(edit.span.text)), f"{found}: {edit.replacement}"


MAKES_FIXES = frozenset(
    {"Edit", "Fix", "insert_after", "insert_child", "replace_value", "set_attribute", "set_value"}
)


def test_no_text_of_a_fix_in_the_source_has_a_placeholder() -> None:
    """Also fixes that no fixture shows, such as those of launch files."""
    found = [
        f"{path}:{text.lineno}: {text.value}"
        for path in Path(kbot.__file__).parent.rglob("*.py")
        for call in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id in MAKES_FIXES
        for text in ast.walk(call)
        if isinstance(text, ast.Constant) and isinstance(text.value, str) and PLACEHOLDER.search(text.value)
    ]
    assert found == []
