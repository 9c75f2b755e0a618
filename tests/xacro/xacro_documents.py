"""Generates random xacro documents that combine scopes, macros, blocks, conditions and expressions."""

# ruff: noqa: E501 - a table of pieces of documents

from hypothesis import strategies as st

NAMES = st.sampled_from(["a", "b", "c", "width", "n"])
MACROS = st.sampled_from(["m", "wheel", "arm"])
BLOCKS = st.sampled_from(["blk", "other"])

numbers = st.one_of(
    st.integers(0, 30).map(str),
    st.sampled_from(["0.5", "1.", ".25", "1e-3", "2.50", "100.0", "0.1"]),
)
atoms = st.one_of(
    NAMES,
    NAMES,
    numbers,
    st.sampled_from(["'text'", "'1'", "True", "False", "pi", "[1, 2, 3]", "(1, 2)", "''", "'a b'", "None"]),
)


def _operations(inner: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    binary = st.sampled_from(["+", "-", "*", "/", "//", "%", "==", "!=", "and", "or", "in", "**"])
    return st.one_of(
        st.tuples(inner, binary, inner).map(" ".join),
        st.tuples(inner, st.sampled_from(["+", "-", "*", "/"]), inner).map("".join),
        # which computed numbers are the same object depends on the version of CPython
        st.tuples(inner, st.sampled_from(["is", "is not"]), st.sampled_from(["None", "True"])).map(" ".join),
        inner.map(lambda e: f"({e})"),
        inner.map(lambda e: f"-{e}"),
        inner.map(lambda e: f"not {e}"),
        st.tuples(inner, inner, inner).map(lambda e: f"{e[0]} if {e[1]} else {e[2]}"),
        st.tuples(st.sampled_from(["str", "float", "int", "len", "max", "bool", "sin", "round"]), inner).map(
            lambda e: f"{e[0]}({e[1]})"
        ),
        st.tuples(st.sampled_from(["min", "max", "math.hypot", "python.divmod"]), inner, inner).map(
            lambda e: f"{e[0]}({e[1]}, {e[2]})"
        ),
        inner.map(lambda e: f"[{e}, 2][0]"),
        inner.map(lambda e: f"[i * 2 for i in [1, {e}]]"),
        inner.map(lambda e: f"(lambda x: x + {e})(1)"),
        inner.map(lambda e: f"str({e}).upper()"),
        inner.map(lambda e: f"dict(k={e})['k']"),
        inner.map(lambda e: f"xacro.dotify(dict(k={e})).k"),
    )


expressions = st.recursive(atoms, _operations, max_leaves=5)
pieces = st.one_of(
    expressions.map(lambda e: f"${{{e}}}"),
    NAMES.map(lambda n: f"${{{n}}}"),
    st.sampled_from(
        ["$(arg size)", "$(arg label)", "$${a}", "$$(x)", "$", "text", " ", "1", "true", "0.5", "-", "a_b",
         "${xacro.arg('size')}", "$(arg ${'la' + 'bel'})", "${'$(arg label)' * 2}", "$(eval size * 2)", "é"]
    ),
)  # fmt: skip
safe = st.sampled_from(
    ["${a}", "${n + 1}", "${width * 2}", "${'x' + str(n)}", "${c}", "x${n}", "${-width}", "${b / 2} 0 0", "${n == 3}",
     "${max(n, 2)}", "${a if n else b}", "$(arg label)_${n}", "1 ${c} ${a}", "${[1, n]}", "3", "0.25", "text"]
)  # fmt: skip
values = st.one_of(
    safe,
    safe,
    safe,
    pieces,
    st.lists(pieces, min_size=0, max_size=3).map("".join),
    st.sampled_from(
        ["1", " 42 ", "true", "False", "'quoted'", "0", "1.0", "1_000", "5 -2", "[1, 2]", "inf", "+3"]
    ),
)
truths = st.sampled_from(["true", "false", "1", "0", "${n}", "${a == b}", "${True}", "${0.0}"])
conditions = st.one_of(
    truths,
    truths,
    truths,
    st.sampled_from(
        ["true", "false", "1", "0", "${n}", "${a == b}", "${True}", "${0.0}", "$(arg flag)", "2"]
    ),
    values,
)


def quoted(value: str) -> str:
    """A value as text in an attribute."""
    return value.replace("&", "&amp;").replace("<", "&lt;").replace('"', "&quot;")


def _property(name: str, kind: str, value: str, extra: str) -> str:
    return f'<xacro:property name="{name}" {kind}="{quoted(value)}"{extra}/>'


extras = st.sampled_from(
    ["", "", "", ' lazy_eval="false"', ' scope="parent"', ' scope="global"', ' lazy_eval="true"']
)
properties = st.one_of(
    st.builds(_property, NAMES, st.just("value"), values, extras),
    st.builds(_property, NAMES, st.sampled_from(["value", "default"]), values, st.just("")),
    NAMES.map(lambda n: f'<xacro:property name="{n}" remove="true"/>'),
)
parameters = st.lists(
    st.one_of(
        NAMES,
        st.tuples(
            NAMES, st.sampled_from([":=", "="]), st.sampled_from(["1", "'a b'", "${n}", "x", "${a + 1}"])
        ).map("".join),
        NAMES.map(lambda n: f"{n}:=^"),
        NAMES.map(lambda n: f"{n}:=^|7"),
        BLOCKS.map(lambda b: f"*{b}"),
        BLOCKS.map(lambda b: f"**{b}"),
    ),
    max_size=4,
    unique_by=lambda p: p.lstrip("*").split(":")[0].split("=")[0],
).map(" ".join)
blanks = st.sampled_from(["", "\n", "\n  ", "\n\n", " "])
comments = st.sampled_from(
    ["<!-- plain -->", "<!-- ${a} -->", "<!-- xacro:eval-comments -->", "<!-- xacro:eval-comments:off -->"]
)


def _call(macro: str, arguments: dict[str, str], content: str) -> str:
    written = "".join(f' {name}="{quoted(value)}"' for name, value in arguments.items())
    return f"<xacro:{macro}{written}>{content}</xacro:{macro}>"


def _nodes(inner: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    body = st.lists(st.tuples(blanks, inner).map("".join), max_size=4).map("".join)
    arguments = st.dictionaries(NAMES, values, max_size=3)
    return st.one_of(
        st.builds(lambda tag, b: f"<xacro:{tag[0]} value=\"{quoted(tag[1])}\">{b}</xacro:{tag[0]}>",
                  st.tuples(st.sampled_from(["if", "unless"]), conditions), body),
        st.builds(lambda m, p, b: f'<xacro:macro name="{m}" params="{p}">{b}</xacro:macro>',
                  MACROS, parameters, body),
        st.builds(lambda m, p, b, a, c: f'<xacro:macro name="{m}" params="{p}">{b}</xacro:macro>{_call(m, a, c)}',
                  MACROS, parameters, body, arguments, body),
        st.builds(_call, st.just("wheel"), arguments, st.sampled_from(["", "<!-- c -->", "text"])),
        st.builds(_call, st.just("wheel"), arguments, st.sampled_from(["", "<!-- c -->", "text"])),
        st.builds(_call, st.just("arm"), arguments, inner.map(lambda i: f"<blk>{i}</blk>")),
        st.builds(_call, st.just("arm"), arguments, inner),
        st.builds(_call, MACROS, arguments, body),
        st.builds(lambda n, v, b: f'<link {n}="{quoted(v)}">{b}</link>', NAMES, values, body),
        st.builds(lambda n, b: f'<xacro:property name="{n}">{b}</xacro:property>', BLOCKS, body),
        st.builds(lambda n, b: f'<xacro:element xacro:name="{quoted(n)}">{b}</xacro:element>',
                  st.sampled_from(["made", "${'x' + str(n)}", "xacro:m"]), body),
    )  # fmt: skip


leaves = st.one_of(
    properties,
    properties,
    values.map(lambda v: f'<leaf v="{quoted(v)}"/>'),
    values.map(lambda v: quoted(v)),
    comments,
    BLOCKS.map(lambda b: f'<xacro:insert_block name="{b}"/>'),
    st.tuples(NAMES, values).map(lambda p: f'<xacro:attribute name="{p[0]}" value="x{quoted(p[1])}"/>'),
    MACROS.map(lambda m: f'<xacro:call macro="{m}"/>'),
    st.sampled_from(['<xacro:arg name="size" default="3"/>', '<xacro:arg name="flag" default="true"/>']),
    st.sampled_from(["<![CDATA[ ${a} ]]>", "<?pi x?>", '<s xmlns:q="http://q"><q:t/></s>']),
)
START = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
<xacro:arg name="label" default="front"/><xacro:arg name="size" default="2"/>
<xacro:property name="a" value="1"/><xacro:property name="b" value="${a * 2}"/>
<xacro:property name="c" value="text"/><xacro:property name="n" value="3"/>
<xacro:property name="width" value="0.5"/>
<xacro:property name="other"><o v="${a}"/></xacro:property>
<xacro:macro name="wheel" params="a:=1 b:=${n} c:=^ n:=^|3 width:='q r'">
  <!-- of the macro -->
  <w a="${a}" b="${b}" c="${c}" n="${n}" width="${width}"/>
  <xacro:property name="n" value="${a}_n" scope="parent"/>
</xacro:macro>
<xacro:macro name="arm" params="a:=1 b:=${n} c:=^ n:=^|3 width:=$(arg size) *blk">
  <arm a="${a}" c="${c}"><xacro:insert_block name="blk"/><xacro:wheel a="${b}" width="${width}"/></arm>
</xacro:macro>
<xacro:macro name="m" params="a:=5 **blk"><in a="${a}"><xacro:insert_block name="blk"/></in></xacro:macro>
"""
trees = st.recursive(leaves, _nodes, max_leaves=14)
documents = st.lists(st.tuples(blanks, trees).map("".join), min_size=1, max_size=6).map(
    lambda nodes: START + "".join(nodes) + "\n</robot>"
)
