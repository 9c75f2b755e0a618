"""Tests each feature of the language: input and expected output."""

# ruff: noqa: E501 - a table of documents, one to a line

from pathlib import Path

import pytest

from kbot.xacro import expand, expand_text

HEAD = '<r xmlns:xacro="http://www.ros.org/wiki/xacro">'
MACRO = '<xacro:macro name="m" params="{params}"><a {attributes}/></xacro:macro>'


def result(body: str, **arguments: str) -> str:
    """The content of the root element, without line ends and indentation."""
    expansion = expand_text(f"{HEAD}{body}</r>", arguments=arguments).require()
    assert expansion.document is not None
    lines = [line.strip() for line in expansion.plain_text.splitlines()[1:]]
    text = "".join(lines)
    if text == "<r/>":
        return ""
    return text.removeprefix("<r>").removesuffix("</r>")


PROPERTIES = {
    "a number stays one": ('<xacro:property name="p" value="42"/><a x="${p / 4}"/>', '<a x="10.5"/>'),
    "lazy, so order does not matter": (
        '<xacro:property name="p" value="${2 * q}"/><xacro:property name="q" value="4"/><a x="${p}"/>',
        '<a x="8"/>',
    ),
    "greedy, so it does": (
        '<xacro:property name="s" value="Ab"/><xacro:property name="s" value="${s.lower()}" lazy_eval="false"/>${s}',
        "ab",
    ),
    "blanks around a number": ('<xacro:property name="p" value=" 42 "/><a x="${p + 1}"/>', '<a x="43"/>'),
    "an underscore keeps it a text": ('<xacro:property name="p" value="1_2"/>${p * 2}', "1_21_2"),
    "quotes keep it a text": ('<xacro:property name="p" value="\'12\'"/>${p * 2}', "1212"),
    "equal constants of an expression are one": (
        "${0.5 is 0.5} ${1000 is not 1000} ${0.5 is 0.25}",
        "True False False",
    ),
    "truth values": ('<xacro:property name="p" value="true"/>${not p}', "False"),
    "default does not replace": (
        '<xacro:property name="p" default="1"/><xacro:property name="p" default="2"/>${p}',
        "1",
    ),
    "remove": (
        '<xacro:property name="p" value="1"/><xacro:property name="p" remove="true"/>'
        '<xacro:property name="p" default="2"/>${p}',
        "2",
    ),
    "a computed name": ('<xacro:property name="${\'ab\'}" value="1"/>${ab}', "1"),
    "a block": (
        '<xacro:property name="b"><x v="${n}"/>t</xacro:property><xacro:property name="n" value="3"/>'
        '<xacro:insert_block name="b"/>',
        '<x v="3"/>t',
    ),
    "parent scope": (
        '<xacro:macro name="m" params="f"><xacro:property name="p" value="${21*f}" scope="parent"/></xacro:macro>'
        '<xacro:m f="2"/>${p}',
        "42",
    ),
    "global scope": (
        '<xacro:macro name="i"><xacro:property name="p" value="7" scope="global"/></xacro:macro>'
        '<xacro:macro name="o"><xacro:i/></xacro:macro><xacro:o/>${p}',
        "7",
    ),
    "a macro's own scope": (
        '<xacro:property name="p" value="1"/><xacro:macro name="m"><xacro:property name="p" value="2"/>${p}'
        "</xacro:macro><xacro:m/>${p}",
        "21",
    ),
}
MACROS = {
    "parameters": (
        MACRO.format(params="x y", attributes='v="${x + y}"') + '<xacro:m x="1" y="2"/>',
        '<a v="3"/>',
    ),
    "defaults": (
        MACRO.format(params="x:=1 y=2", attributes='v="${x} ${y}"') + '<xacro:m y="5"/>',
        '<a v="1 5"/>',
    ),
    "a quoted default": (
        MACRO.format(params="x:='a b' y:=3", attributes='v="${x}${y}"') + "<xacro:m/>",
        '<a v="a b3"/>',
    ),
    "a default of the caller's scope": (
        '<xacro:property name="n" value="2"/>'
        + MACRO.format(params="x:=${n * 2}", attributes='v="${x}"')
        + '<xacro:property name="n" value="5"/><xacro:m/>',
        '<a v="10"/>',
    ),
    "forwarded": (
        '<xacro:property name="x" value="7"/>'
        + MACRO.format(params="x:=^", attributes='v="${x}"')
        + "<xacro:m/>",
        '<a v="7"/>',
    ),
    "forwarded or else": (MACRO.format(params="x:=^|8", attributes='v="${x}"') + "<xacro:m/>", '<a v="8"/>'),
    "values keep their type": (
        MACRO.format(params="x", attributes='v="${x[-1]}"') + '<xacro:m x="${[1, 2]}"/>',
        '<a v="2"/>',
    ),
    "no second evaluation": (
        MACRO.format(params="x", attributes='v="${x}"') + '<xacro:m x="$${y}"/>',
        '<a v="${y}"/>',
    ),
    "one block": (
        '<xacro:macro name="m" params="*b"><in><xacro:insert_block name="b"/></in></xacro:macro>'
        '<xacro:m><o x="1"/></xacro:m>',
        '<in><o x="1"/></in>',
    ),
    "what is within a block": (
        '<xacro:macro name="m" params="**b"><in><xacro:insert_block name="b"/></in></xacro:macro>'
        "<xacro:m><o><p/><q/></o></xacro:m>",
        "<in><p/><q/></in>",
    ),
    "a block put in twice": (
        '<xacro:macro name="m" params="*b"><xacro:insert_block name="b"/><xacro:insert_block name="b"/></xacro:macro>'
        "<xacro:m><o/></xacro:m>",
        "<o/><o/>",
    ),
    "called by a computed name": (
        '<xacro:macro name="left"><l/></xacro:macro><xacro:property name="w" value="left"/><xacro:call macro="${w}"/>',
        "<l/>",
    ),
    "recursion": (
        '<xacro:macro name="m" params="n"><xacro:if value="${n}"><a n="${n}"/><xacro:m n="${n - 1}"/></xacro:if>'
        '</xacro:macro><xacro:m n="3"/>',
        '<a n="3"/><a n="2"/><a n="1"/>',
    ),
    "defined again": (
        '<xacro:macro name="m"><a/></xacro:macro><xacro:m/><xacro:macro name="m"><b/></xacro:macro><xacro:m/>',
        "<a/><b/>",
    ),
}
OTHER = {
    "if": ('<xacro:if value="1"><a/></xacro:if><xacro:if value="false"><b/></xacro:if>', "<a/>"),
    "unless": ('<xacro:unless value="${1 == 2}"><a/></xacro:unless>', "<a/>"),
    "a number is true unless it is zero": ('<xacro:if value="${0.1}"><a/></xacro:if><xacro:if value="0"><b/></xacro:if>', "<a/>"),
    "what is left out is not looked at": ('<xacro:if value="0"><xacro:include filename="none"/>${none}</xacro:if>', ""),
    "element": ('<xacro:element xacro:name="${\'a\' + \'b\'}" x="1"/>', '<ab x="1"/>'),
    "attribute": ('<l><xacro:attribute name="x" value="y"/></l>', '<l x="y"/>'),
    "an attribute within a condition is lost, as officially": (
        '<l><xacro:if value="1"><xacro:attribute name="x" value="y"/></xacro:if></l>',
        "<l/>",
    ),
    "escapes": ('<a b="$${x}" c="$$${x}" d="$$(x)" e="$"/>', '<a b="${x}" c="$${x}" d="$(x)" e="$"/>'),
    "expressions within commands": ("$(arg ${'f' + 'oo'})", "bar"),
    "commands within expressions": ("${'$(arg foo)' * 2}", "barbar"),
    "an argument's default": ('<xacro:arg name="a" default="2"/>$(arg a)', "2"),
    "an argument that is given": ('<xacro:arg name="foo" default="2"/>$(arg foo)', "bar"),
    "xacro.arg": ("${xacro.arg('foo').upper()}", "BAR"),
    "eval": ('<xacro:arg name="n" default="3"/>$(eval n * 2)', "6"),
    "optenv": ("$(optenv KBOT_SURELY_NOT_SET a b)", "a b"),
    "cdata stays": ("<t>${1}<![CDATA[${2}]]></t>", "<t>1<![CDATA[${2}]]>  </t>"),
    "entities": ("<a b=\"&lt;&quot;&#233;\">&amp;</a>", '<a b="&lt;&quot;é">&amp;</a>'),
    "comments before tags go": ('<!-- a -->\n<xacro:property name="p" value="1"/><!-- b -->', "<!-- b -->"),
    "comments evaluated on request": ("<!-- xacro:eval-comments --><!-- ${1 + 1} --><a/><!-- ${1} -->", "<!-- 2 --><a/><!-- ${1} -->"),
    "deep expressions": ("${[x * y for x in [1, 2] for y in (3, 4) if x != y][-1]}", "8"),
    "lambda": ("${(lambda a, b=2: a * b)(4)}", "8"),
    "comparison chain": ("${1 &lt; 2 &lt; 3}", "True"),
    "a dictionary with dots": ("${xacro.dotify(dict(a=dict(b=5))).a.b}", "5"),
    "math": ("${round(math.sin(pi / 2) + cos(0), 3)}", "2.0"),
    "string methods": ("${'a-b'.split('-')[1].upper()}", "B"),
    "python": ("${python.sum(python.range(4))}", "6"),
    "tokenize": ("${xacro.tokenize('a, b;c')}", "['a', 'b', 'c']"),
    "hasattr": ("${hasattr(xacro.dotify(dict(a=1)), 'a')}", "True"),
    "unicode": ("${'🍔' * 2}", "🍔🍔"),
}  # fmt: skip


@pytest.mark.parametrize(
    "case", [*PROPERTIES.items(), *MACROS.items(), *OTHER.items()], ids=lambda case: case[0]
)
def test_language(case: tuple[str, tuple[str, str]]) -> None:
    body, expected = case[1]
    assert result(body, foo="bar") == expected


def test_includes_are_relative_to_the_including_file(tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    (tmp_path / "main.xacro").write_text(
        f'{HEAD}<xacro:include filename="sub/a.xacro"/><x d="$(dirname)"/></r>'
    )
    (tmp_path / "sub/a.xacro").write_text(f'{HEAD}<xacro:include filename="b.xacro"/><y d="$(dirname)"/></r>')
    (tmp_path / "sub/b.xacro").write_text(f"{HEAD}<z/></r>")
    expansion = expand(tmp_path / "main.xacro").require()
    assert expansion.document is not None
    assert [(e.tag, e.attributes.get("d")) for e in expansion.document.elements()] == [
        ("z", None),
        ("y", str(tmp_path / "sub")),
        ("x", str(tmp_path)),
    ]
    assert expansion.dependencies == (str(tmp_path / "sub/a.xacro"), str(tmp_path / "sub/b.xacro"))


def test_namespaces_patterns_and_optional_includes(tmp_path: Path) -> None:
    (tmp_path / "p1.xacro").write_text(
        f'{HEAD}<xacro:property name="v" value="5"/><xacro:macro name="w"><w v="${{v}}"/></xacro:macro></r>'
    )
    (tmp_path / "p2.xacro").write_text(f"{HEAD}<two/></r>")
    (tmp_path / "main.xacro").write_text(
        f'{HEAD}<xacro:include filename="p1.xacro" ns="n"/><xacro:n.w/><a v="${{n.v + 1}}"/>'
        '<xacro:include filename="p[2-9].xacro"/><xacro:include filename="none.xacro" optional="true"/></r>'
    )
    expansion = expand(tmp_path / "main.xacro").require()
    assert expansion.document is not None
    assert [(e.tag, *e.attributes.values()) for e in expansion.document.elements()] == [
        ("w", "5"),
        ("a", "6"),
        ("two",),
    ]


def test_yaml_with_units(tmp_path: Path) -> None:
    (tmp_path / "p.yaml").write_text("angle: !degrees 180\nlength: !millimeters 5 * 2\nlist: [{x: 1}, 2]\n")
    (tmp_path / "main.xacro").write_text(
        f'{HEAD}<xacro:property name="p" value="${{xacro.load_yaml(\'p.yaml\')}}"/>'
        '<a angle="${p.angle}" length="${p[\'length\']}" x="${p.list[0].x}"/></r>'
    )
    expansion = expand(tmp_path / "main.xacro").require()
    assert expansion.document is not None
    (a,) = expansion.document.elements()
    assert a.attributes == {"angle": "3.141592653589793", "length": "0.01", "x": "1"}
    assert expansion.dependencies == (str(tmp_path / "p.yaml"),)


def test_a_description_cannot_change_cached_yaml(tmp_path: Path) -> None:
    (tmp_path / "p.yaml").write_text("l: [1]\n")
    (tmp_path / "main.xacro").write_text(
        f"{HEAD}<xacro:property name=\"p\" value=\"${{xacro.load_yaml('p.yaml')['l']}}\"/>${{p.append(2)}}${{p}}</r>"
    )
    first = expand(tmp_path / "main.xacro").require().text
    assert expand(tmp_path / "main.xacro").require().text == first


def test_only_an_edited_file_is_parsed_again(tmp_path: Path) -> None:
    (tmp_path / "main.xacro").write_text(f'{HEAD}<xacro:include filename="a.xacro"/></r>')
    (tmp_path / "a.xacro").write_text(f"{HEAD}<one/></r>")
    first = expand(tmp_path / "main.xacro").require()
    (tmp_path / "a.xacro").write_text(f"{HEAD}<two/></r>")
    second = expand(tmp_path / "main.xacro").require()
    assert first.document is not None
    assert second.document is not None
    assert [e.tag for e in second.document.elements()] == ["two"]
    assert first.document.source is second.document.source


def test_properties_of_the_caller_replace_top_level_ones() -> None:
    body = '<xacro:property name="r" value="1"/><xacro:property name="d" value="${2 * r}"/><a d="${d}"/>'
    expansion = expand_text(f"{HEAD}{body}</r>", properties={"r": 4, "rr": 1})
    assert expansion.document is not None
    assert [e.attributes["d"] for e in expansion.document.elements()] == ["8"]
    assert [d.code for d in expansion.diagnostics] == ["X207"]


def test_an_undeclared_argument_is_a_warning() -> None:
    expansion = expand_text(f'{HEAD}<xacro:arg name="width" default="1"/></r>', arguments={"widht": "2"})
    assert [(d.code, d.hint) for d in expansion.diagnostics] == [("X206", "did you mean 'width'?")]
    assert expansion.ok


@pytest.mark.parametrize("kind", ["message", "warning", "error"])
def test_a_message_has_a_text(kind: str) -> None:
    """The official package rejects a message without an argument, and prints an empty line for an empty text."""
    (error,) = expand_text(f"{HEAD}${{xacro.{kind}()}}</r>").diagnostics
    assert (error.is_error, error.message) == (True, f"xacro.{kind} needs a text")
    (found,) = expand_text(f"{HEAD}${{xacro.{kind}(' ')}}</r>").diagnostics
    assert (found.is_error, found.message) == (False, f"xacro.{kind} with an empty text")


def test_messages_of_a_description_are_reported() -> None:
    expansion = expand_text(f"{HEAD}${{xacro.warning('mind', 2)}}${{xacro.message('hello')}}</r>")
    assert [(d.code, d.message) for d in expansion.diagnostics] == [("X302", "mind 2"), ("X301", "hello")]


def test_a_plain_urdf_passes_through() -> None:
    text = '<robot name="r">\n  <link name="a"/>\n</robot>'
    assert expand_text(text).require().plain_text == f'<?xml version="1.0" ?>\n{text}\n'


@pytest.mark.parametrize("case", ["missing", "folder", "empty", "binary", "image"])
def test_a_text_that_is_not_a_description_is_one_diagnostic(tmp_path: Path, case: str) -> None:
    path = tmp_path / "x"
    code = {"missing": "F001", "folder": "F002", "empty": "P002", "binary": "F005", "image": "P001"}[case]
    if case == "folder":
        path.mkdir()
    elif case != "missing":
        path.write_bytes({"empty": b" \n", "binary": b"\x89PNG\xff", "image": b"PNG image"}[case])
    expansion = expand(path)
    assert [d.code for d in expansion.diagnostics] == [code]
    assert expansion.document is None
    assert expansion.text == ""
