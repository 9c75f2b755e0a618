"""Tests the exact positions of all parts of an XML text."""

import pytest

from kbot.text import Comment, DescriptionError, Element, Source, Text, parse_xml
from kbot.text.edits import apply_edits
from kbot.text.xml import CData, parse_document

TEXT = """<?xml version="1.0"?>
<!-- first --><robot name='a>b' é="ü">
  hi &amp; there <a x="1"/>tail<![CDATA[ <x> ]]>after<!-- é --> z
  <b><c/></b>
</robot>"""


def test_every_node_has_its_source_text() -> None:
    document = parse_document(Source("f", TEXT))
    root = document.root
    assert root.origin.span.text == """<robot name='a>b' é="ü">"""
    assert root.whole.text == TEXT[TEXT.index("<robot") :]
    assert [(type(n), n.origin.span.text) for n in root.children[:6]] == [
        (Text, "\n  hi &amp; there "),
        (Element, '<a x="1"/>'),
        (Text, "tail"),
        (CData, "<![CDATA[ <x> ]]>"),
        (Text, "after"),
        (Comment, "<!-- é -->"),
    ]
    (b,) = root.elements("b")
    assert b.whole.text == "<b><c/></b>"
    assert [c.whole.text for c in b.elements()] == ["<c/>"]
    assert [node.value for node in document.before] == [" first "]


def test_lines_and_columns_count_characters() -> None:
    a = next(parse_xml(Source("f", TEXT)).elements("a"))
    assert (a.origin.span.line, a.origin.span.column) == (3, 18)


def test_attribute_spans() -> None:
    root = parse_xml(Source("f", TEXT))
    name, value = root.attribute_spans()["name"]
    assert (name.text, value.text) == ("name", "a>b")
    assert root.attribute_origin("é").span.text == "ü"
    assert root.attribute_origin("absent").span == root.origin.span


def test_a_long_text_is_one_node() -> None:
    long = " \n" + "x" * 200_000 + "\ny"
    root = parse_xml(Source("f", f"<a>{long}</a>"))
    assert [type(child) for child in root.children] == [Text]
    assert root.text == long


@pytest.mark.parametrize(
    ("text", "message", "hint", "begin"),
    [
        (
            "<r>\n  <link>\n</r>",
            "<link>, opened at 2:3, is not closed before </r>",
            "write </link> at its end",
            "2:3",
        ),
        ("<a><b></a></b>", "<b>, opened at 1:4, is not closed before </a>", "write </b></a>", "1:4"),
        (
            "<a><link></lnk></a>",
            "</lnk> has no start tag: the open element is <link>, opened at 1:4",
            "write </link> at 1:12",
            "1:4",
        ),
        ("<a><parrent></parent></a>", "the open element is <parrent>", "write <parent> at 1:5", "1:4"),
        ("<a><arm/><amr></arm></a>", "the open element is <amr>", "write <arm> at 1:11", "1:10"),
        ("<a><amr></arm></a>", "the open element is <amr>", "the same name in both: </amr>, or <arm>", "1:4"),
        ("<a><macro></xacro:macro></a>", "the open element is <macro>", "write <xacro:macro> at 1:5", "1:4"),
        ("<a><xacro:if></if></a>", "the open element is <xacro:if>", "write </xacro:if> at 1:16", "1:4"),
        (
            "<a>\n <b><c/>",
            "<b>, opened at 2:2, is not closed at the end of the file",
            "write </b></a>",
            "2:2",
        ),
        ("<a x='1' x='2'/>", "'x' occurs twice", "remove one", ""),
        ("<a>R & D</a>", "unescaped '&'", "&amp;", ""),
        ("<a x='R &D'/>", "'&D' has no ';'", "&amp;", ""),
        ("<a>&nbsp;</a>", "&nbsp; is not an XML entity", "the character itself", ""),
        ("<a><!-- x -- y --></a>", "XML does not allow '--' in a comment", "one dash", "1:4"),
        ("<a><!-- x\n<!-- y --></a>", "a comment begins inside a comment", "close the first comment", "1:4"),
        ("<a><!-- x </a>", "the comment that begins here is not closed", "-->", ""),
        ("<a x=1/>", "the value of 'x' has no quotes", 'x="…"', ""),
        ("<a x='1' y/>", "the attribute 'y' has no value", 'y="…"', ""),
        ("<a x='1/>\n<b/></a>", "XML does not allow '<' in the value of 'x'", "end the value with '", "1:6"),
        ("<a>1 < 2</a>", "'<' is not followed by the name of an element", "&lt;", ""),
        ("</a>", "this end tag has no start tag", "<robot", ""),
        ("<a x=\u201c1\u201d/>", "XML needs straight quotes", 'write "1"', ""),
        ("<a>< link/></a>", "'<' is not followed by the name of an element", "write <link", ""),
        ('<a><b x="1"\\></a>', "an empty element ends with a slash, not a backslash", "write />", ""),
        ("<!-- a -->\n<?xml version='1.0'?><a/>", "must be at the very start", "move what is before it", ""),
        ("<?xml version='1.0'?> <?xml version='1.0'?><a/>", "there is a second <?xml", "remove it", ""),
        ("?xml version='1.0'?> <a/>", "there is text before the first element", "remove it", ""),
        ("my robot <?xml version='1.0'?><a/>", "there is text before <?xml", "remove it", ""),
        ("<a/><b/>", "the root element ends", "one root element", ""),
    ],
)
def test_malformed_xml_is_explained(text: str, message: str, hint: str, begin: str) -> None:
    with pytest.raises(DescriptionError) as caught:
        parse_xml(Source("f", text))
    (diagnostic,) = caught.value.diagnostics
    assert diagnostic.code == "P001"
    assert diagnostic.message.startswith("not well-formed XML: ")
    assert message in diagnostic.message
    assert hint in diagnostic.hint
    assert [str(r.origin) for r in diagnostic.related] == ([f"f:{begin}"] if begin else [])


@pytest.mark.parametrize(
    ("text", "code", "line", "column"),
    [
        ("", "P002", 1, 1),
        (" \n ", "P002", 1, 1),
        ("hello", "P001", 1, 1),
        ("<a><b></a>", "P001", 1, 9),
        ("<a>\n  <b", "P001", 2, 3),
        ("<a/><b/>", "P001", 1, 5),
        ("<a x='1' x='2'/>", "P001", 1, 10),
        ("<!DOCTYPE a [<!ENTITY b 'c'>]><a>&b;</a>", "P003", 1, 14),
        ("<a>\n<x:b/></a>", "P004", 2, 1),
        ("<a x:b='1'/>", "P004", 1, 1),
        ("<a>" * 1500 + "</a>" * 1500, "P005", 1, 301),
    ],
)
def test_an_error_is_one_diagnostic_at_its_position(text: str, code: str, line: int, column: int) -> None:
    with pytest.raises(DescriptionError) as caught:
        parse_xml(Source("f", text))
    (diagnostic,) = caught.value.diagnostics
    assert diagnostic.origin is not None
    assert (diagnostic.code, diagnostic.origin.span.line, diagnostic.origin.span.column) == (
        code,
        line,
        column,
    )


@pytest.mark.parametrize(
    ("text", "corrected"),
    [
        ('<robot>\n  <xmlns:xacro="u" name="r">\n</robot>', '<robot xmlns:xacro="u" name="r">\n</robot>'),
        ('\n<?xml version="1.0"?>\n<robot name="r"/>', '<?xml version="1.0"?>\n<robot name="r"/>'),
    ],
)
def test_common_mistakes_in_the_first_lines_have_a_hint_and_a_fix(text: str, corrected: str) -> None:
    with pytest.raises(DescriptionError) as caught:
        parse_xml(Source("f", text))
    (diagnostic,) = caught.value.diagnostics
    assert diagnostic.hint
    assert diagnostic.fix is not None
    (edit,) = diagnostic.fix.edits
    data = text.encode()
    changed = data[: edit.span.start] + edit.replacement.encode() + data[edit.span.end :]
    assert changed.decode() == corrected
    parse_xml(Source("f", corrected))


@pytest.mark.parametrize(
    ("text", "message", "place", "corrected"),
    [
        (
            '<robot><mass value="1"/\n<inertia/></robot>',
            "'>' is missing at the end of the tag",
            "f:1:23",
            '<robot><mass value="1"/>\n<inertia/></robot>',
        ),
        ("<robot><link></link\n</robot>", "'>' is missing", "f:1:19", "<robot><link></link>\n</robot>"),
        ('<robot><link name="a"\n<visual/></link></robot>', "'>' is missing", "f:1:21", ""),
        (
            "<robot>\n\t<link>\n\t\t<visual/>\n\t<joint/>\n\t<link/>\n</robot>",
            "<link>, opened at 2:2, is not closed before <joint>, which it cannot contain",
            "f:4:2",
            "<robot>\n\t<link>\n\t\t<visual/>\n\t</link>\n\t<joint/>\n\t<link/>\n</robot>",
        ),
        (
            "<robot><link><visual><collision/></link></robot>",
            "<visual>, opened at 1:14, is not closed before <collision>",
            "f:1:22",
            "<robot><link><visual></visual><collision/></link></robot>",
        ),
    ],
)
def test_a_missing_bracket_or_end_tag_is_named_at_its_place(
    text: str, message: str, place: str, corrected: str
) -> None:
    with pytest.raises(DescriptionError) as caught:
        parse_xml(Source("f", text))
    (diagnostic,) = caught.value.diagnostics
    assert message in diagnostic.message
    assert str(diagnostic.origin) == place
    assert bool(diagnostic.fix) == bool(corrected)
    if diagnostic.fix is not None:
        assert apply_edits(text, diagnostic.fix.edits) == corrected
        parse_xml(Source("f", corrected))


def test_a_prefix_is_valid_only_inside_its_element() -> None:
    parse_xml(Source("f", '<a><b xmlns:x="u"><x:c x:d="1"/></b></a>'))
    with pytest.raises(DescriptionError):
        parse_xml(Source("f", '<a><b xmlns:x="u"><x:c/></b><x:c/></a>'))


@pytest.mark.parametrize(
    ("text", "column"),
    [
        ("<a><!-- b -- c --><b/></a>", 13),
        ("<a><!-- b ---><!-- c -- d --><b/></a>", 13),
        ("\n<?xml version='1.0'?><a><b/></a>", 1),
        ("<!-- é --><?xml version='1.0'?><a><b/></a>", 11),
        ("<?xml version='1.0'?><?xml version='1.0'?><a><b/></a>", 22),
        ("<a><b/></a></a>", 13),
        ("<a><b/></a>\n<c/>", 1),
        ("text <sdf><b/></sdf>", 1),
    ],
)
def test_lenient_reader_warns_and_keeps_positions(text: str, column: int) -> None:
    """urdfdom and libsdformat read these, as tests/peers verifies."""
    document = parse_document(Source("f", text), lenient=True)
    (warning,) = document.diagnostics
    assert (warning.code, warning.is_error, warning.origin.span.column) == ("P007", False, column)
    (b,) = document.root.elements()
    assert b.origin.span.text == "<b/>"
    with pytest.raises(DescriptionError):
        parse_document(Source("f", text))


def test_lenient_reader_warns_once_about_each_kind() -> None:
    text = "\n<?xml version='1.0'?><!-- a -- b --><a><!-- c -- d --><![CDATA[<!-- -- -->]]><x:y/></a>\n<a/>"
    document = parse_document(Source("f", text), lenient=True)
    assert [d.code for d in document.diagnostics] == ["P007", "P007", "P007", "P004"]
    assert not any(d.is_error for d in document.diagnostics)
    assert document.root.text == "<!-- -- -->"


@pytest.mark.parametrize(
    "text",
    [
        "text <?xml version='1.0'?><a/>",
        "text <a/>",
        "<a><?xml version='1.0'?></a>",
        "<a/>text",
        "<a x='1' x='2'/>",
        "<a><!-- b -- </a>",
        "<a><![CDATA[<!-- ]]> & <!-- -- --></a>",
        "<a>",
    ],
)
def test_lenient_reader_rejects_what_ros_and_gazebo_reject(text: str) -> None:
    with pytest.raises(DescriptionError) as caught:
        parse_document(Source("f", text), lenient=True)
    assert [d.code for d in caught.value.diagnostics] == ["P001"]
