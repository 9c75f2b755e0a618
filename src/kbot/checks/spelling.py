"""Fixes for unknown names: correct a typo, or distinguish properties from arguments."""

from __future__ import annotations

import ast
import html
import re
import warnings
from collections.abc import Iterator
from dataclasses import replace
from itertools import accumulate

from kbot.checks.context import Context
from kbot.checks.edits import insert_after, rename_tag
from kbot.text import Diagnostic, Edit, Fix, Span
from kbot.text.suggest import Suggestion
from kbot.xacro.location import UNIT
from kbot.xacro.templates import pieces
from kbot.xacro.xacro_error import XacroError

_VALUE = re.compile(rb"""[\w:.\-]\s*=\s*("[^"]*"|'[^']*')""")
_BLANKS = str.maketrans("\r\n\t", "   ")


def with_fix(diagnostic: Diagnostic, context: Context) -> Diagnostic:
    """Add the fix to a finding of an unknown name."""
    hint = diagnostic.hint
    if diagnostic.fix is not None or diagnostic.origin is None or not isinstance(hint, Suggestion):
        return diagnostic
    fix = None
    if hint.sure:
        fix = _respelled(diagnostic, diagnostic.origin.span, hint, context)
    elif hint.nearest:
        pass  # one of several names is meant
    elif diagnostic.code == "X103":
        fix = _argument_as_property(diagnostic, hint.written, context)
    elif diagnostic.code == "X112":
        fix = _property_in_place(diagnostic, diagnostic.origin.span, hint.written)
    return replace(diagnostic, fix=fix) if fix else diagnostic


def _respelled(diagnostic: Diagnostic, span: Span, hint: Suggestion, context: Context) -> Fix | None:
    """Write the name that the hint is sure of, here and at all other places that need it.

    A composed name, such as `${prefix}_lnk`, is not changed.
    """
    places = _places(diagnostic, span)
    first, *further = ([*_edits(span, hint, context)] for span in places)
    if not first:
        return None
    edits = (*first, *(edit for more in further for edit in more))
    return Fix(f"write '{hint.sure}'", tuple(dict.fromkeys(edits)), safe=True)


def _places(diagnostic: Diagnostic, span: Span) -> list[Span]:
    """The places that need the name of a finding, beginning with its own."""
    others = [r.origin.span for r in diagnostic.related if r.message == "needed here"]
    return list(dict.fromkeys((span, *others)))


def _argument_as_property(diagnostic: Diagnostic, name: str, context: Context) -> Fix | None:
    """Define a property with the value of an argument, below the argument.

    There is no fix for an argument of another file or of a macro: the property might not be visible where it
    is needed."""
    span = diagnostic.origin.span if diagnostic.origin else None
    file = next((file for file in context.sources if span is not None and file.path == span.file), None)
    declared = [r.origin.span for r in diagnostic.related if r.message == "declared here"]
    for element in file.root.elements("xacro:arg") if file is not None else ():
        if any(element.source is at.source and element.start <= at.start < element.end for at in declared):
            line = f'<xacro:property name="{name}" value="$(arg {name})"/>'
            return insert_after(element, line, f"insert {line}", safe=False)
    return None


def _property_in_place(diagnostic: Diagnostic, span: Span, name: str) -> Fix | None:
    """Read a property as `${name}`, or by its name inside an expression, wherever `$(arg name)` is."""
    pattern = re.compile(r"\$\( *arg +" + re.escape(name) + r" *\)")
    edits = list[Edit]()
    for place in _places(diagnostic, span):
        found = pattern.search(place.text)
        if found is None:
            return None
        start = place.start + len(place.text[: found.start()].encode("utf-8", "surrogatepass"))
        written = f"${{{name}}}" if place.text == found[0] else name
        edits.append(Edit(Span(place.source, start, start + len(found[0])), written))
    return Fix(f"write {edits[0].replacement}", tuple(edits), safe=False)


def _edits(span: Span, hint: Suggestion, context: Context) -> Iterator[Edit]:
    """The edits that write a name: in a macro call, in a value or text that is only the name, or in
    expressions."""
    source, written = span.source, hint.written.encode()
    if span.text.startswith("<"):
        call = context.call_at(span)
        if call is not None and call.tag == f"xacro:{hint.written}":
            renamed = rename_tag(call, f"xacro:{hint.sure}", safe=True)
            yield from renamed.edits if renamed else ()
            return
        values = [match.span(1) for match in _VALUE.finditer(source.data, span.start, span.end)]
        found = [(start + 1, end - 1) for start, end in values if source.data[start + 1 : end - 1] == written]
        places = found if len(found) == 1 else []
        text = re.compile(rb"\s*(" + re.escape(written) + rb")\s*</").match(source.data, span.end)
        places += [text.span(1)] if text and not found else []
    elif "$" in span.text:
        places = [(span.start + start, span.start + end) for start, end in _names(span.text, hint.written)]
    else:
        places = [(span.start, span.end)] if span.text == hint.written else []
    for start, end in places:
        yield Edit(Span(source, start, end), hint.sure)


def _names(written: str, name: str) -> Iterator[tuple[int, int]]:
    """The byte ranges of a name of a property or argument in a text as it is written in XML."""
    units = UNIT.findall(written)
    plain = [html.unescape(unit).translate(_BLANKS) for unit in units]
    if any(len(character) != 1 for character in plain):
        return
    at = [0, *accumulate(len(unit.encode("utf-8", "surrogatepass")) for unit in units)]
    for start in _starts("".join(plain), name):
        yield at[start], at[start + len(name)]


def _starts(text: str, name: str) -> Iterator[int]:
    """The character offsets of a name in the expressions and substitutions of a text."""
    try:
        found = pieces(text)
    except XacroError:
        return
    for piece in found:
        first = piece.start + 2
        if piece.kind == "command" and not piece.content.startswith("eval "):
            words = [word for word in re.finditer("[^ ]+", piece.content) if word[0] == name]
            yield from (first + word.start() for word in words[:1])
        elif piece.kind == "expression" and "$" in piece.content:
            yield from (first + start for start in _starts(piece.content, name))
        elif piece.kind != "text":
            skipped = len("eval ") if piece.kind == "command" else 0
            yield from (first + skipped + start for start in _variables(piece.content[skipped:], name))


def _variables(expression: str, name: str) -> Iterator[int]:
    """The character offsets of a variable in an expression.

    Only variables are properties: strings, keywords and attributes are not. None are returned if the
    expression binds the name itself, or has an f-string, because Python before 3.12 reports wrong columns in
    f-strings.
    """
    source = expression.lstrip()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            nodes = [*ast.walk(ast.parse(source, mode="eval"))]
    except (SyntaxError, ValueError, MemoryError, RecursionError):
        return
    uses = [node for node in nodes if isinstance(node, ast.Name) and node.id == name]
    binds = any(isinstance(node, ast.arg) and node.arg == name for node in nodes)
    if binds or any(isinstance(node, ast.JoinedStr) for node in nodes):
        return
    if all(isinstance(node.ctx, ast.Load) for node in uses):
        skipped, line = len(expression) - len(source), source.encode("utf-8", "surrogatepass")
        for node in uses:
            yield skipped + len(line[: node.col_offset].decode("utf-8", "surrogatepass"))
