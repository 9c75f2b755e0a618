"""Tests the text and JSON output of diagnostics."""

import json
import re

import pytest

from kbot.text import Call, Diagnostic, Edit, Fix, Origin, Related, Severity, Source, Span
from kbot.text.render import count, render_text, to_json

SOURCE = Source("robot.xacro", '<robot>\n\t<link name="a" radious="1"/>\n</robot>\n')


def span_of(piece: str, source: Source = SOURCE) -> Span:
    start = source.data.index(piece.encode())
    return Span(source, start, start + len(piece.encode()))


def diagnostic(span: Span, **more: object) -> Diagnostic:
    return Diagnostic("U001", Severity.ERROR, "unknown attribute 'radious'", Origin(span), **more)


def test_the_caret_is_under_the_exact_span_after_a_tab() -> None:
    text = render_text([diagnostic(span_of("radious"), hint="did you mean 'radius'?")])
    assert text == (
        "robot.xacro:2:17: error: unknown attribute 'radious' [U001]\n"
        "  |\n"
        '2 |     <link name="a" radious="1"/>\n'
        "  |                    ^^^^^^^\n"
        "  = hint: did you mean 'radius'?\n"
    )


def test_columns_count_characters_and_carets_count_terminal_columns() -> None:
    source = Source("wide.xacro", '<link name="轮子" bad="é"/>')
    text = render_text([diagnostic(span_of("bad", source))])
    lines = text.splitlines()
    assert lines[0].startswith("wide.xacro:1:17: ")
    assert lines[3] == "  | " + " " * 18 + "^^^"


def test_a_span_of_several_lines_is_marked_to_the_end_of_its_first() -> None:
    source = Source("r.xacro", '<link\n  name="a"\n/>')
    assert render_text([diagnostic(Span(source, 0, len(source.data)))]).splitlines()[3] == "  | ^^^^^"


def test_the_stack_names_macros_and_includes_innermost_first() -> None:
    main = Source("main.xacro", '<robot>\n<xacro:include filename="w.xacro"/>\n<xacro:wheel/>\n</robot>')
    include = Call("include", "w.xacro", span_of("<xacro:include", main))
    macro = Call("macro", "wheel", span_of("<xacro:wheel/>", main), include)
    found = Diagnostic("X101", Severity.ERROR, "no", Origin(span_of("radious"), macro))
    lines = render_text([found]).splitlines()
    assert lines[-2:] == ["  = in macro 'wheel' called at main.xacro:3:1", "  = included from main.xacro:2:1"]
    assert to_json(found)["stack"] == [
        {"kind": "macro", "name": "wheel", "file": "main.xacro", "line": 3, "column": 1},
        {"kind": "include", "name": "w.xacro", "file": "main.xacro", "line": 2, "column": 1},
    ]


def test_a_deep_stack_is_shortened_in_text_but_not_in_json() -> None:
    call = None
    for depth in range(100):
        call = Call("macro", f"m{depth}", span_of("<robot>"), call)
    found = Diagnostic("X102", Severity.ERROR, "too deep", Origin(span_of("radious"), call))
    text = render_text([found])
    assert text.count("in macro") == 8
    assert "… 92 more …" in text
    assert "'m99'" in text
    assert "'m0'" in text
    assert len(to_json(found)["stack"]) == 100


def test_notes_are_wrapped_only_with_a_width() -> None:
    hint = "word " * 60
    found = diagnostic(span_of("radious"), hint=hint.strip())
    assert hint.strip() in render_text([found])
    wrapped = render_text([found], width=60).splitlines()
    assert max(len(line) for line in wrapped[1:]) <= 60
    assert sum(line.count("word") for line in wrapped) == 60


@pytest.mark.parametrize("at", [0, 500, 990])
def test_a_long_line_is_cropped_around_its_caret(at: int) -> None:
    line = "x" * at + "HERE" + "y" * (996 - at)
    source = Source("long.xacro", line)
    shown, carets = render_text([diagnostic(Span(source, at, at + 4))], width=80).splitlines()[2:4]
    assert len(shown) <= 80
    assert shown[carets.index("^") : carets.rindex("^") + 1] == "HERE"


def test_color_is_optional_and_does_not_change_the_text() -> None:
    found = diagnostic(span_of("radious"), hint="h", related=(Related("here", Origin(span_of("robot"))),))
    plain, colored = render_text([found]), render_text([found], color=True)
    assert "\x1b" not in plain
    assert re.sub(r"\x1b\[[0-9;]*m", "", colored) == plain


def test_a_file_cannot_control_the_terminal() -> None:
    source = Source("evil\x1b[2J.xacro", '<a b="\x1b[31m\x07"/>')
    text = render_text([Diagnostic("U1", Severity.ERROR, "bad \x1b]0;x\x07 name", Origin(source.whole()))])
    assert "\x1b" not in text
    assert "\x07" not in text


def test_no_origin_gives_one_line_and_nulls() -> None:
    found = Diagnostic("F001", Severity.ERROR, "x does not exist")
    assert render_text([found]) == "error: x does not exist [F001]\n"
    assert to_json(found)["line"] is None


def test_json_contains_related_places_and_the_fix() -> None:
    fix = Fix("rename", (Edit(span_of("radious"), "radius"),), safe=True)
    found = diagnostic(
        span_of("radious"), related=(Related("declared here", Origin(span_of("robot"))),), fix=fix
    )
    value = json.loads(json.dumps(to_json(found)))
    assert (value["file"], value["line"], value["column"]) == ("robot.xacro", 2, 17)
    assert (value["end_line"], value["end_column"]) == (2, 24)
    assert value["related"][0] | {"end_line": 0, "end_column": 0} == {
        "message": "declared here",
        "file": "robot.xacro",
        "line": 1,
        "column": 2,
        "end_line": 0,
        "end_column": 0,
    }
    assert value["fix"]["edits"][0]["replacement"] == "radius"


def test_count_names_each_severity_once() -> None:
    kinds = [Severity.ERROR, Severity.WARNING, Severity.ERROR, Severity.INFO]
    assert count(Diagnostic("X", kind, "m") for kind in kinds) == "2 errors, 1 warning, 1 info"
    assert count([]) == ""


def test_paths_below_the_working_directory_are_relative(tmp_path, monkeypatch):
    """For paths as they were given, and for absolute paths of a package."""
    monkeypatch.chdir(tmp_path)
    inner, beside = str(tmp_path / "rover" / "robot.xacro"), f"{tmp_path}2/robot.xacro"
    for path, path_shown in ((inner, "rover/robot.xacro"), ("robot.xacro", "robot.xacro"), (beside, beside)):
        span = Span(Source(path, "<robot/>"), 0, 8)
        call = Call("macro", "m", span)
        found = Diagnostic(
            "X000", Severity.INFO, "said", Origin(span, call), "", (Related("here", Origin(span)),)
        )
        text = render_text([found])
        assert text.startswith(f"{path_shown}:1:1: info: said")
        assert f"called at {path_shown}:1:1\n" in text
        assert f"= {path_shown}:1:1: here\n" in text


@pytest.mark.parametrize(
    ("places", "more"), [(2, []), (3, ["and 1 more place"]), (28, ["and 26 more places"])]
)
def test_the_hint_comes_before_two_further_places(places: int, more: list[str]) -> None:
    related = tuple(Related(f"needed here {n}", Origin(span_of("link"))) for n in range(places))
    fix = Fix("write 0.3", (), safe=True)
    found = diagnostic(span_of("radious"), hint="write 0.3", fix=fix, related=related)
    notes = [line[4:] for line in render_text([found]).splitlines() if line.startswith("  = ")]
    uses = [f"robot.xacro:2:3: needed here {n}" for n in (0, 1)]
    assert notes == ["hint: write 0.3", "fix: write 0.3", *uses, *more]
    assert render_text([found], every_place=True).count("needed here") == places
    assert len(to_json(found)["related"]) == places
