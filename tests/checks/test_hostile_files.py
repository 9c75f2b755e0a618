"""`kbot check` handles hostile files within its limits, in time linear in the size of the file."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from kbot.checks import check_text
from kbot.checks.config import Config
from kbot.text import Call, DescriptionError, Diagnostic, Origin, Severity, Source, Span
from kbot.text.diagnostic import bounded
from kbot.text.render import render_text
from kbot.xacro import clear_cache

H = '<robot name="x" xmlns:xacro="http://www.ros.org/wiki/xacro">'

MALFORMED = {
    "a long name before many blanks": f"{H}<p{'a' * 1_200}{' ' * 1_200}/ $ </robot>",
    "many beginnings of a value": f"{H}<p {'a= ' * 100_000}</robot>",
    "many lone ampersands": f"{H}<p a='{'&' * 300_000}'/></robot>",
    "a tag that does not end": f"{H}<p {' ' * 300_000}a='<",
}


@pytest.mark.parametrize("what", MALFORMED)
def test_malformed_xml_is_reported_quickly(
    what: str, tmp_path: Path, measured_kbot: Callable[..., Any]
) -> None:
    (tmp_path / "robot.xacro").write_text(MALFORMED[what])
    result = measured_kbot("check", "robot.xacro")
    assert result.is_bounded(), result
    assert result.status == 2
    assert "not well-formed XML" in result.out


def _lines(count: int, line: str) -> str:
    """A robot with one line per number. `{}` in the line is replaced by the number."""
    lines = "\n".join(line.replace("{}", str(number)) for number in range(count))
    return f'{H}\n<link name="base_link"/>\n{lines}\n</robot>\n'


def _unknown_attributes(count: int) -> str:
    attributes = " ".join(f'a{number}="1"' for number in range(count))
    return f'{H}<link name="base_link" {attributes}/></robot>'


def _unused_parameters(count: int) -> str:
    names = " ".join(f"p{number}" for number in range(count))
    return f'{H}<link name="base_link"/><xacro:macro name="m" params="{names}"><a/></xacro:macro></robot>'


def _joint(kind: str, inner: str) -> str:
    ends = '<parent link="base_link"/><child link="l{}"/><axis xyz="0 0 1"/>'
    return f'<link name="l{{}}"/><joint name="j{{}}" type="{kind}">{ends}{inner}</joint>'


def _calls(count: int) -> str:
    """Calls of a macro, every second one with a fault."""
    inertial = '<inertial><mass value="${v * 1}"/></inertial>'
    macro = f'<xacro:macro name="m" params="n v"><link name="${{n}}">{inertial}</link></xacro:macro>'
    return _lines(count, '<xacro:m n="l{}" v="${{} % 2 - 1}"/>').replace(H, H + macro)


MANY: dict[str, Callable[[int], str]] = {
    "unknown attributes of one element": _unknown_attributes,
    "unused parameters": _unused_parameters,
    "half of a macro's calls": _calls,
    "findings in one line": lambda n: _lines(n, '<link name="l{}" colour="\u00e9"/>').replace("\n", ""),
} | {
    what: lambda n, line=line: _lines(n, line)  # type: ignore[misc]  # mypy cannot infer a lambda's default
    for what, line in {
        "unknown elements": '<linc name="l{}"/>',
        "undefined properties": "<a>${undefined}</a>",
        "nearly properties": '<xacro:property name="property_{}" value="1"/><a>${properti_{}}</a>',
        "links of one name": '<link name="same"/>',
        "unused macros": '<xacro:macro name="m{}" params="unused"><a/></xacro:macro>',
        "missing meshes": '<link name="l{}"><visual>'
        '<geometry><mesh filename="m{}.stl"/></geometry></visual></link>',
        "bad limits": _joint("revolute", '<limit lower="2" upper="1" effort="-1" velocity="0"/>'),
        "ignored axes": _joint("fixed", ""),
        "joints of one name": _joint("fixed", "").replace("j{}", "same"),
        "misspelt attributes": _joint("fixed", "").replace("type=", "typ="),
        "tags without prefix, and errors": '<property name="p{}" value="1"/>' + _joint("fixd", ""),
        "unknown mimics": _joint("continuous", '<mimic joint="jj{}"/>'),
        "comments that suppress": '<!-- kbot: ignore[U202] why --><link name="l{}" colour="red"/>',
        "properties of one name": '<xacro:property name="p" value="{}"/><a b="${p}"/>',
    }.items()
}


@pytest.mark.parametrize("what", MANY)
def test_time_grows_linearly_with_file_size(what: str, tmp_path: Path) -> None:
    """Counts function calls: four times as many findings take at most five times the calls."""
    work = []
    for count in (150, 600):
        text = MANY[what](count)
        clear_cache()
        calls = 0

        def counted(_frame: object, event: str, _argument: object) -> None:
            nonlocal calls
            calls += event in ("call", "c_call")

        check_text("<robot/>", "warm_up.xacro", config=Config())
        sys.setprofile(counted)
        try:
            found = check_text(text, "robot.xacro", config=Config())
            render_text(found)
        finally:
            sys.setprofile(None)
        assert found
        work.append(calls)
    assert work[1] < 5 * work[0], work


def test_many_unknown_children_take_linear_time(tmp_path: Path, measured_kbot: Callable[..., Any]) -> None:
    """Takes 2 s. A search among the siblings for each child took more than 10 s."""
    inner = "".join(f"<lnk{number}/>" for number in range(50_000))
    (tmp_path / "robot.urdf").write_text(f'<robot name="x"><link name="a">{inner}</link></robot>')
    result = measured_kbot("check", "robot.urdf")
    assert result.is_bounded(), result
    assert result.status == 1
    assert "25000 more findings are not listed [K004]" in result.out
    assert "25001 warnings" in result.out


@pytest.mark.parametrize(
    "options", [("--output-format", "sarif"), ("--diff",), ("--fix", "--json")], ids=" ".join
)
def test_number_of_findings_through_60_macro_calls_is_limited(
    options: tuple[str, ...], tmp_path: Path, measured_kbot: Callable[..., Any]
) -> None:
    """Takes up to 5 s. Without the limit, SARIF took 8 GB and `--diff` 66 s."""
    calls = "".join(f'<xacro:macro name="m{i}" params=""><xacro:m{i + 1}/></xacro:macro>' for i in range(59))
    inner = '<xacro:macro name="m59" params="">' + "<linc/>" * 50_000 + "</xacro:macro>"
    text = f'{H}<link name="a"/>{calls}{inner}<xacro:m0/></robot>'
    (tmp_path / "robot.xacro").write_text(text)
    result = measured_kbot("check", "robot.xacro", *options)
    assert result.is_bounded(), result
    assert result.status == 1
    assert (tmp_path / "robot.xacro").read_text() == text
    assert ("no fix is tried" in result.err) == ("sarif" not in options)


def test_errors_are_listed_first_if_findings_are_limited() -> None:
    """A finding counts as four and each of its macro calls as one. The limit is 100,000."""
    source = Source("r.xacro", "<a/>")
    span = Span(source, 0, 4)
    call = Call("macro", "m", span, Call("macro", "n", span))
    warning = Diagnostic("U201", Severity.WARNING, "w", Origin(span, call))
    error = Diagnostic("U001", Severity.ERROR, "e", Origin(span))
    assert bounded([warning] * 16_666) == (warning,) * 16_666
    listed = bounded([*[warning] * 20_000, error])
    assert listed[:-1] == (*[warning] * 16_666, error)
    assert (listed[-1].code, listed[-1].message) == ("K004", "3334 more findings are not listed")
    assert bounded(listed) == listed
    assert DescriptionError([error] * 30_000).diagnostics[:-1] == (error,) * 25_000


def test_too_many_robots_of_a_launch_file_are_not_checked(
    tmp_path: Path, measured_kbot: Callable[..., Any]
) -> None:
    """Takes 2 s. Checking all 60 robots took 48 s."""
    work = "${len([x * y for x in python.range(1000) for y in python.range(600)])}"
    (tmp_path / "r.xacro").write_text(
        f'{H}<xacro:arg name="a" default=""/><link name="l"/><t n="{work}"/></robot>'
    )
    tag = '<param name="p{0}" command="xacro $(dirname)/r.xacro a:={0}"/>'
    (tmp_path / "a.launch").write_text(f"<launch>{''.join(map(tag.format, range(60)))}</launch>")
    result = measured_kbot("check", "-v", "a.launch")
    assert result.is_bounded(), result
    assert result.status == 1
    assert "r.xacro is not checked: the launch file has too many robots [K003]" in result.out
    assert "r.xacro takes too many steps to expand" in result.out


@pytest.mark.parametrize("options", [("-v",), ("--json",), ("--diff",)])
def test_thousands_of_findings_are_reported(
    options: tuple[str, ...], tmp_path: Path, measured_kbot: Callable[..., Any]
) -> None:
    (tmp_path / "robot.xacro").write_text(MANY["unknown attributes of one element"](5_000))
    result = measured_kbot("check", "robot.xacro", *options)
    assert result.is_bounded(), result
    assert result.status == 1
    assert (result.out + result.err).count("is not an attribute of <link>") == (
        0 if "--diff" in options else 5_000
    )


def test_fixes_that_do_not_help_are_abandoned(tmp_path: Path, measured_kbot: Callable[..., Any]) -> None:
    """Each `<linc>` is a typo of `<link>`, but a robot of 5,000 links without joints has more errors."""
    (tmp_path / "robot.xacro").write_text(MANY["unknown elements"](5_000))
    result = measured_kbot("check", "robot.xacro", "--fix")
    assert result.is_bounded(), result
    assert "linc" in (tmp_path / "robot.xacro").read_text()
