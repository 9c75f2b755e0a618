"""Tests the content of errors: stack, other places, nearest names."""

from pathlib import Path

from kbot.xacro import expand, expand_text

HEAD = '<r xmlns:xacro="http://www.ros.org/wiki/xacro">\n'


def test_the_stack_leads_through_macros_and_includes(tmp_path: Path) -> None:
    (tmp_path / "m.xacro").write_text(
        f'{HEAD}<xacro:macro name="inner"><a x="${{1/0}}"/></xacro:macro>\n'
        '<xacro:macro name="outer"><xacro:inner/></xacro:macro>\n<xacro:outer/></r>'
    )
    (tmp_path / "main.xacro").write_text(f'{HEAD}<xacro:include filename="m.xacro"/></r>')
    (error,) = expand(tmp_path / "main.xacro").diagnostics
    assert error.origin is not None
    assert [(call.kind, Path(call.name).name, call.span.line) for call in error.origin.stack] == [
        ("macro", "inner", 3),
        ("macro", "outer", 4),
        ("include", "m.xacro", 2),
    ]


def test_an_undefined_property_is_one_error_with_every_place_that_uses_it() -> None:
    text = f'{HEAD}<a x="${{gone}}"/>\n<b y="${{gone}}" z="1 ${{gone}}"/>\n</r>'
    (error,) = expand_text(text, "f.xacro").diagnostics
    assert str(error.origin) == "f.xacro:2:7"
    assert [str(related.origin) for related in error.related] == ["f.xacro:3:7", "f.xacro:3:21"]


def test_the_nearest_names_are_suggested() -> None:
    text = f'{HEAD}<xacro:property name="wheel_radius" value="1"/><a x="${{wheel_raduis}}"/></r>'
    (error,) = expand_text(text).diagnostics
    assert error.hint == "did you mean 'wheel_radius'?"


def test_the_span_covers_the_expression() -> None:
    (error,) = expand_text(f'{HEAD}<a x="é ${{gone + 1}} b"/></r>').diagnostics
    assert error.origin is not None
    assert error.origin.span.text == "${gone + 1}"


def test_names_that_a_failed_include_may_define_are_not_reported() -> None:
    text = f'{HEAD}<xacro:include filename="gone.xacro"/>\n<xacro:wheel/>\n<a x="${{from_there}}"/></r>'
    (error,) = expand_text(text).diagnostics
    assert error.code == "X117"
    assert [related.origin.span.line for related in error.related] == [3, 4]


def test_expansion_continues_after_errors() -> None:
    expansion = expand_text(f'{HEAD}<a x="${{gone}}"/><b/></r>')
    assert expansion.document is not None
    assert [e.tag for e in expansion.document.elements()] == ["a", "b"]
    assert not expansion.ok


def test_a_late_definition_is_shown_for_an_undefined_property() -> None:
    text = f'{HEAD}<a x="${{width}}"/>\n<xacro:property name="width" value="1"/></r>'
    (error,) = expand_text(text, "f").diagnostics
    assert error.hint == "it is defined only further down. Define it before its first use"
    assert [(r.message, str(r.origin)) for r in error.related] == [("defined here", "f:3:37")]


def test_a_definition_without_prefix_is_shown_for_an_undefined_name() -> None:
    definitions = '<property name="width" value="1"/>\n<macro name="wheel"/>'
    errors = expand_text(f'{HEAD}{definitions}\n<a x="${{width}}"/><xacro:wheel/></r>', "f").diagnostics
    assert [(e.hint, [str(r.origin) for r in e.related]) for e in errors] == [
        ("write <xacro:property …> where it is defined", ["f:2:1"]),
        ("write <xacro:macro …> where it is defined", ["f:3:1"]),
    ]


def test_a_lone_surrogate_is_an_error() -> None:
    found = expand_text(
        f"{HEAD}<a x=\"1 ${{'\\ud800'}}\"/>\n<b y=\"${{'\\ud83e\\udd16'}}\" z=\"${{'\U0001f916'}}\"/></r>",
        "f.xacro",
    )
    assert [(d.code, str(d.origin)) for d in found.diagnostics] == [
        ("X104", "f.xacro:2:9"),
        ("X104", "f.xacro:3:7"),
    ]
