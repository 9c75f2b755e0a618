"""Explains why a text is not well-formed XML."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from kbot.text.diagnostic import Diagnostic, Edit, Fix, Related, Severity
from kbot.text.span import Origin, Source, Span
from kbot.text.suggest import did_you_mean
from kbot.text.xml_nodes import Element

_A_ROBOT = 'a robot is written in <robot name="…"> … </robot>'
_SPLIT_ROOT = re.compile(rb"<robot\s*>(\s*)<(xmlns:xacro\s*=)")
_NAMELESS = re.compile(rb"<([\w:.-]+)\s*=")
_NAME = re.compile(rb"[^\s<>/=\"']+")
_ENTITY = re.compile(rb"&(?!(?:lt|gt|amp|quot|apos);)[\w:.-]+;")
_LONE_AND = re.compile(rb"&#?[\w:.-]*\Z")
_VALUES = re.compile(rb"""<[^<>"']*(?:"[^"]*"[^<>"']*|'[^']*'[^<>"']*)*""")
"""A tag as far as its quotes are in pairs."""


@dataclass(frozen=True, slots=True)
class _Told:
    message: str
    hint: str = ""
    related: tuple[Related, ...] = ()
    fix: Fix | None = None


def malformed(source: Source, offset: int, reason: str, opened: Sequence[Element]) -> Diagnostic:
    """P001: what the parser refused at a byte, for its reason, within the elements that are open there."""
    if reason == "mismatched tag":
        told = _mismatched(source, offset, opened)
    elif reason == "no element found":
        told = _ends_early(opened)
    elif reason == "invalid token":
        told = _invalid(source, offset)
    else:
        told = _other(source, offset, reason)
    told = _broken_root(source, told) or _late_declaration(source, reason, told) or told
    place = Origin(Span(source, offset, offset + 1))
    message = f"not well-formed XML: {told.message}"
    return Diagnostic("P001", Severity.ERROR, message, place, told.hint, told.related, told.fix)


def _broken_root(source: Source, told: _Told) -> _Told | None:
    split = _SPLIT_ROOT.search(source.data)
    if not split:
        return None
    return _Told(
        told.message,
        "the root element is broken in two: write "
        '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="…">',
        fix=_safe("join the root element", source, split.start(), split.start(2), "<robot "),
    )


def _late_declaration(source: Source, reason: str, told: _Told) -> _Told | None:
    at = source.data.find(b"<?xml")
    if "declaration" not in reason or at <= 0 or source.data[:at].strip():
        return None
    return _Told(
        told.message,
        "<?xml …?> must be the very first thing in the file",
        fix=_safe("remove what stands before <?xml", source, 0, at, ""),
    )


def _mismatched(source: Source, offset: int, opened: Sequence[Element]) -> _Told:
    data, inner = source.data, opened[-1]
    name = _word(data, offset)
    here = _opening(inner)
    if all(element.tag != name for element in opened):
        near = did_you_mean(name, [inner.tag])
        hint = f"write </{inner.tag}>" if near else f"take </{name}> away, or write <{name}> where it begins"
        return _Told(f"</{name}> closes nothing: open here is {_where(inner)}", hint, here)
    after = data[data.find(b">", offset) + 1 :].lstrip()
    if after.startswith(b"</" + inner.tag.encode()):
        hint = f"what is opened last is closed first: write </{inner.tag}></{name}>"
    else:
        hint = f"write </{inner.tag}> where it ends, or <{inner.tag} …/> where it holds nothing"
    return _Told(f"{_where(inner)}, is not closed; here </{name}> closes something else", hint, here)


def _ends_early(opened: Sequence[Element]) -> _Told:
    if not opened:
        return _Told("there is no element in the file", _A_ROBOT)
    closing = "".join(f"</{element.tag}>" for element in reversed(opened[-4:]))
    inner = opened[-1]
    return _Told(f"{_where(inner)}, is not closed: the file ends", f"write {closing}", _opening(inner))


def _invalid(source: Source, offset: int) -> _Told:
    data = source.data
    comment = data.rfind(b"<!--", 0, offset)
    if comment >= 0 and data.find(b"-->", comment, offset) < 0 and data[offset - 2 : offset] == b"--":
        return _in_comment(source, comment, offset)
    tag = data.rfind(b"<", 0, offset)
    lone = _LONE_AND.search(data, max(tag, 0), offset)
    if lone:
        alone = len(lone[0]) == 1
        fix = _safe("write &amp;", source, lone.start(), offset, "&amp;") if alone else None
        what = "'&' stands alone" if alone else f"'{lone[0].decode('utf-8', 'replace')}' has no ; behind it"
        return _Told(what, "write &amp; for the character & itself", fix=fix)
    if data[offset : offset + 1] < b" " and data[offset : offset + 1] not in (b"\t", b"\r", b"\n", b""):
        return _Told(f"the control character {data[offset]:#04x}, which XML forbids", "take it away")
    paired = _VALUES.match(data, tag, offset) if tag >= 0 else None
    if paired and (paired.end() == offset or data[paired.end() : paired.end() + 1] != b">"):
        return _in_tag(source, tag, paired.end(), offset)
    return _Told("here stands what XML does not allow")


def _in_comment(source: Source, comment: int, offset: int) -> _Told:
    if source.data[offset - 4 : offset] == b"<!--":
        comment = source.data.rfind(b"<!--", 0, offset - 4)
        told = ("a comment begins within a comment", "close the one before with -->")
    else:
        told = ("'--' stands in a comment, where XML forbids it", "write one dash, or end with -->")
    return _Told(*told, (Related("the comment begins", Origin(Span(source, comment, comment + 4))),))


def _in_tag(source: Source, tag: int, stop: int, offset: int) -> _Told:
    """`stop` is where an open quote of the tag stands, or the offset itself."""
    data = source.data
    nameless = _NAMELESS.match(data, tag, tag + 200)
    if nameless:
        name = nameless[1].decode("utf-8", "replace")
        hint = f"'{name}' is an attribute, and no element: put it into the tag of the element before"
        return _Told("a tag begins with the name of its element", hint)
    if data.startswith(b"</", tag):
        return _Told("here an element ends, and none has begun", _A_ROBOT)
    if tag == offset - 1:
        return _Told("'<' stands alone: no element's name follows", "write &lt; for the character < itself")
    before = data[tag:stop].rstrip()
    has_equals = before.endswith(b"=")
    last = _NAME.match(before.removesuffix(b"=").rstrip()[::-1])  # from its end: it is the last of them
    name = last[0][::-1].decode("utf-8", "replace") if last else ""
    if stop < offset:  # a quote is open
        begun = (Related("the value begins", Origin(Span(source, stop, stop + 1))),)
        hint = (
            f"end the value with {data[stop : stop + 1].decode()}, or write &lt; for the character < itself"
        )
        return _Told(f"'<' stands in the value of '{name}', where XML forbids it", hint, begun)
    if last and has_equals:
        return _Told(f"the value of '{name}' stands without quotes", f'write {name}="…"')
    if last and len(before) > len(last[0]) + 1:
        return _Told(f"the attribute '{name}' has no value", f'write {name}="…"')
    if data[offset - 1 : offset] in (b'"', b"'"):
        return _Told("a value ends here, and no space follows", "a quote or a space is missing before this")
    return _Told("a tag may not go on like this", "write <name …>, <name …/> or </name>")


def _other(source: Source, offset: int, reason: str) -> _Told:
    data = source.data
    if reason == "unclosed token":
        if data.startswith(b"<!--", offset):
            return _Told("the comment that begins here does not end", "write --> where it ends")
        return _Told("the tag that begins here has no >", "write > behind its name and attributes")
    if reason == "unclosed CDATA section":
        at = data.rfind(b"<![CDATA[", 0, offset)
        begun = (Related("it begins", Origin(Span(source, at, at + 9))),)
        return _Told("a CDATA section does not end", "write ]]> where it ends", begun)
    if reason == "duplicate attribute":
        hint = "take one of them away"
        return _Told(f"the attribute '{_word(data, offset)}' stands twice in one tag", hint)
    if reason == "junk after document element":
        hint = "a file has one root element, which all others stand in: is it closed too early?"
        return _Told("the root element has ended before this", hint)
    if reason == "undefined entity":
        entity = _ENTITY.search(data, offset)
        name = entity[0].decode("utf-8", "replace") if entity else "this"
        hint = "write the character itself; XML knows &amp; &lt; &gt; &quot; &apos;"
        return _Told(f"{name} is no entity that XML knows", hint)
    if reason == "syntax error":
        return _Told("an element is to begin here", _A_ROBOT)
    return _Told(reason)


def _opening(element: Element) -> tuple[Related, ...]:
    return (Related(f"<{element.tag}> is opened", element.origin, is_told=True),)


def _where(element: Element) -> str:
    line, column = element.source.line_column(element.start)
    return f"<{element.tag}>, opened at {line}:{column}"


def _word(data: bytes, offset: int) -> str:
    word = _NAME.match(data, offset)
    return word[0].decode("utf-8", "replace") if word else ""


def _safe(title: str, source: Source, start: int, end: int, replacement: str) -> Fix:
    return Fix(title, (Edit(Span(source, start, end), replacement),), safe=True)
