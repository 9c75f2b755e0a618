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
_TAGS = frozenset({
    "robot", "link", "joint", "inertial", "visual", "collision", "geometry", "origin", "mass", "inertia",
    "box", "cylinder", "sphere", "capsule", "mesh", "material", "color", "texture", "parent", "child",
    "axis", "calibration", "dynamics", "limit", "mimic", "safety_controller", "gazebo", "transmission",
    "ros2_control", "sensor", "plugin", "launch", "node", "param", "arg", "include", "group", "remap",
    "rosparam", "xacro:property", "xacro:macro", "xacro:arg", "xacro:include", "xacro:if",
    "xacro:unless", "xacro:insert_block",
})  # fmt: skip
"""Tags of URDF, launch files and xacro. This package cannot import those that define them."""
_TOP = frozenset({"link", "joint", "gazebo", "transmission", "ros2_control"})
_PARTS = frozenset({"visual", "collision", "inertial"})
_OUTSIDE = {"link": _TOP, "joint": _TOP, **dict.fromkeys(_PARTS, _TOP | _PARTS)}
"""Elements that an element of URDF cannot contain: its end tag is missing before them."""
_VALUES = re.compile(rb"""<[^<>"']*(?:"[^"]*"[^<>"']*|'[^']*'[^<>"']*)*""")
"""A tag up to the first quote that is not closed."""

_SPACED = re.compile(rb"<\s+/?([\w:.-]+)")
"""A tag with a space in front of its name."""
_CURLY = re.compile(rb"(?:\xe2\x80[\x9c-\x9f])([^<>\"'\xe2]*)(?:\xe2\x80[\x9c-\x9f])")
"""A value in the double quotes of word processors, in UTF-8."""

_WHOLE_TAG = re.compile(rb"""<(?:/[\w:.-]+|[\w:.-]+\s*/?|.*["']\s*/?)""", re.DOTALL)
"""A tag without its `>`: an end tag, or a start tag that ends with its name, a value or a slash."""


@dataclass(frozen=True, slots=True)
class _Explanation:
    """`at` is where the fault is, if that is not where the parser noticed it."""

    message: str
    hint: str = ""
    related: tuple[Related, ...] = ()
    fix: Fix | None = None
    at: int | None = None


def malformed(source: Source, offset: int, reason: str, opened: Sequence[Element]) -> Diagnostic:
    """The diagnostic P001 for an error of the parser. `opened` are the elements that are open there."""
    if reason == "mismatched tag":
        found = _mismatched(source, offset, opened)
    elif reason == "no element found":
        found = _ends_early(opened)
    elif reason == "invalid token":
        found = _invalid(source, offset)
    else:
        found = _other(source, offset, reason)
    found = _broken_root(source, found) or _late_declaration(source, reason, found) or found
    start = offset if found.at is None else found.at
    place = Origin(Span(source, start, start + 1))
    message = f"not well-formed XML: {found.message}"
    return Diagnostic("P001", Severity.ERROR, message, place, found.hint, found.related, found.fix)


def _broken_root(source: Source, found: _Explanation) -> _Explanation | None:
    split = _SPLIT_ROOT.search(source.data)
    if not split:
        return None
    return _Explanation(
        "xmlns:xacro is an attribute of <robot>, not an element",
        "the root element is split in two: write "
        '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="…">',
        fix=_safe("join the root element", source, split.start(), split.start(2), "<robot "),
    )


def _late_declaration(source: Source, reason: str, found: _Explanation) -> _Explanation | None:
    at = source.data.find(b"<?xml")
    before = source.data[: max(0, at)]
    if not before.strip():
        if at <= 0 or "declaration" not in reason:
            return None
        fix = _safe("remove the text before <?xml", source, 0, at, "")
        return _Explanation(found.message, "<?xml …?> must be at the very start of the file", fix=fix)
    if "declaration" in reason:
        return _Explanation(
            "<?xml …?> must be at the very start of the file", "move what is before it below it"
        )
    if b"<" not in before:
        return _Explanation("there is text before <?xml", "remove it", at=0)
    return None


def _mismatched(source: Source, offset: int, opened: Sequence[Element]) -> _Explanation:
    data, inner = source.data, opened[-1]
    name = _word(data, offset)
    here = _opening(inner)
    if all(element.tag != name for element in opened):
        if did_you_mean(name, [inner.tag]) or "xacro:" in (
            name.removesuffix(inner.tag),
            inner.tag.removesuffix(name),
        ):
            return _misspelt(source, offset, name, inner)
        hint = f"remove </{name}>, or write <{name}> where the element begins"
        return _Explanation(f"</{name}> has no start tag: the open element is {_where(inner)}", hint, here)
    outside = next((e for e in inner.elements() if e.tag in _OUTSIDE.get(inner.tag, ())), None)
    if outside is not None:
        return _not_closed_before(source, inner, outside)
    after = data[data.find(b">", offset) + 1 :].lstrip()
    if after.startswith(b"</" + inner.tag.encode()):
        hint = f"close the inner element first: write </{inner.tag}></{name}>"
    else:
        hint = f"write </{inner.tag}> at its end, or <{inner.tag} …/> if it is empty"
    return _Explanation(f"{_where(inner)}, is not closed before </{name}>", hint, here)


def _not_closed_before(source: Source, inner: Element, outside: Element) -> _Explanation:
    """Explain an element that contains one that it cannot contain."""
    end = f"</{inner.tag}>"
    before = source.data[: outside.start]
    at = len(before.rstrip())
    line, column = source.line_column(inner.start)
    on_own_line = b"\n" in before[at:]
    lead = "\n" + source.line(line)[: column - 1] if on_own_line else ""
    fix = _safe(f"insert {end}", source, at, at, f"{lead if not lead.strip() else ''}{end}")
    message = f"{_where(inner)}, is not closed before <{outside.tag}>, which it cannot contain"
    return _Explanation(message, f"write {end} before this", _opening(inner), fix, outside.start)


def _misspelt(source: Source, offset: int, name: str, inner: Element) -> _Explanation:
    """Explain a start tag and an end tag whose names differ by a typo or a missing prefix.

    The name that URDF, xacro or another place of the file uses is right. Otherwise only the author knows.
    """
    message = f"</{name}> has no start tag: the open element is {_where(inner)}"
    data, written, ending = source.data, inner.tag.encode(), name.encode()
    is_start_right = inner.tag in _TAGS or inner.tag == f"xacro:{name}" or data.count(b"<" + written) > 1
    is_end_right = name in _TAGS or name == f"xacro:{inner.tag}" or b"<" + ending in data
    if is_start_right == is_end_right:
        hint = f"write the same name in both: </{inner.tag}>, or <{name}> at the start"
        return _Explanation(message, hint, _opening(inner))
    at, old, new = (offset, ending, inner.tag) if is_start_right else (inner.start + 1, written, name)
    shown = f"</{new}>" if is_start_right else f"<{new}>"
    line, column = source.line_column(at)
    fix = _safe(f"write {shown}", source, at, at + len(old), new) if data.startswith(old, at) else None
    return _Explanation(message, f"write {shown} at {line}:{column}", _opening(inner), fix)


def _ends_early(opened: Sequence[Element]) -> _Explanation:
    if not opened:
        return _Explanation("there is no element in the file", _A_ROBOT)
    closing = "".join(f"</{element.tag}>" for element in reversed(opened[-4:]))
    inner = opened[-1]
    return _Explanation(
        f"{_where(inner)}, is not closed at the end of the file", f"write {closing}", _opening(inner)
    )


def _invalid(source: Source, offset: int) -> _Explanation:
    data = source.data
    comment = data.rfind(b"<!--", 0, offset)
    if comment >= 0 and data.find(b"-->", comment, offset) < 0 and data[offset - 2 : offset] == b"--":
        return _in_comment(source, comment, offset)
    tag = data.rfind(b"<", 0, offset)
    lone = _LONE_AND.search(data, max(tag, 0), offset)
    if lone:
        alone = len(lone[0]) == 1
        fix = _safe("write &amp;", source, lone.start(), offset, "&amp;") if alone else None
        what = "unescaped '&'" if alone else f"'{lone[0].decode('utf-8', 'replace')}' has no ';' after it"
        return _Explanation(what, "write &amp; for the character &", fix=fix)
    if data[offset : offset + 1] < b" " and data[offset : offset + 1] not in (b"\t", b"\r", b"\n", b""):
        return _Explanation(f"XML does not allow the control character {data[offset]:#04x}", "remove it")
    paired = _VALUES.match(data, tag, offset) if tag >= 0 else None
    if paired and (paired.end() == offset or data[paired.end() : paired.end() + 1] != b">"):
        return _in_tag(source, tag, paired.end(), offset)
    if offset < data.find(b"<"):
        return _Explanation("there is text before the first element", "remove it")
    return _Explanation("XML does not allow this here")


def _in_comment(source: Source, comment: int, offset: int) -> _Explanation:
    if source.data[offset - 4 : offset] == b"<!--":
        comment = source.data.rfind(b"<!--", 0, offset - 4)
        found = ("a comment begins inside a comment", "close the first comment with -->")
    else:
        found = ("XML does not allow '--' in a comment", "write one dash, or end the comment with -->")
    return _Explanation(
        *found, (Related("the comment begins here", Origin(Span(source, comment, comment + 4))),)
    )


def _in_tag(source: Source, tag: int, stop: int, offset: int) -> _Explanation:
    """Explain an error inside a tag. `stop` is the position of an open quote, or the offset."""
    data = source.data
    nameless = _NAMELESS.match(data, tag, tag + 200)
    if nameless:
        name = nameless[1].decode("utf-8", "replace")
        hint = f"'{name}' is an attribute: put it into the tag of the previous element"
        return _Explanation("the tag does not begin with the name of an element", hint)
    before = data[tag:stop].rstrip()
    if stop == offset and _WHOLE_TAG.fullmatch(before) and data[offset:].lstrip()[:1] == b"<":
        return _no_bracket(source, tag, tag + len(before))
    if data.startswith(b"</", tag):
        return _Explanation("this end tag has no start tag", _A_ROBOT)
    if tag == offset - 1:
        message, spaced = "'<' is not followed by the name of an element", _SPACED.match(data, tag)
        if spaced is None or spaced[1].decode() not in _TAGS:
            return _Explanation(message, "write &lt; for the character <")
        fix = _safe("remove the space after '<'", source, offset, spaced.start(1), "")
        return _Explanation(message, f"write <{spaced[1].decode()}", fix=fix)
    has_equals = before.endswith(b"=")
    last = _NAME.match(before.removesuffix(b"=").rstrip()[::-1])  # reversed, to find the last name
    name = last[0][::-1].decode("utf-8", "replace") if last else ""
    if stop < offset:  # a quote is open
        begun = (Related("the value begins here", Origin(Span(source, stop, stop + 1))),)
        hint = f"end the value with {data[stop : stop + 1].decode()}, or write &lt; for the character <"
        return _Explanation(f"XML does not allow '<' in the value of '{name}'", hint, begun)
    curly = _CURLY.match(data, offset)
    if last and has_equals and curly:
        value = curly[1].decode("utf-8", "replace")
        fix = _safe("write straight quotes", source, offset, curly.end(), f'"{value}"')
        return _Explanation("XML needs straight quotes", f'write "{value}"', fix=fix)
    if last and has_equals:
        return _Explanation(f"the value of '{name}' has no quotes", f'write {name}="…"')
    if last and len(before) > len(last[0]) + 1:
        return _Explanation(f"the attribute '{name}' has no value", f'write {name}="…"')
    if data.startswith(b"\\>", offset):
        fix = _safe("write />", source, offset, offset + 2, "/>")
        return _Explanation("an empty element ends with a slash, not a backslash", "write />", fix=fix)
    if data[offset - 1 : offset] in (b'"', b"'"):
        return _Explanation(
            "the value that ends here is not followed by a space", "a quote or a space is missing before this"
        )
    return _Explanation("the tag is malformed here", "write <name …>, <name …/> or </name>")


def _no_bracket(source: Source, tag: int, end: int) -> _Explanation:
    """Explain a tag that ends without `>` at `end`."""
    is_known = source.data.startswith(b"</", tag) or source.data[end - 1 : end] == b"/"
    hint = "write >" if is_known else "write >, or /> if the element is empty"
    fix = _safe("insert >", source, end, end, ">") if is_known else None
    return _Explanation("'>' is missing at the end of the tag", hint, fix=fix, at=end - 1)


def _other(source: Source, offset: int, reason: str) -> _Explanation:
    data = source.data
    if reason == "unclosed token":
        if data.startswith(b"<!--", offset):
            return _Explanation("the comment that begins here is not closed", "write --> at its end")
        return _Explanation("the tag that begins here has no '>'", "write > after its name and attributes")
    if reason == "unclosed CDATA section":
        at = data.rfind(b"<![CDATA[", 0, offset)
        begun = (Related("it begins here", Origin(Span(source, at, at + 9))),)
        return _Explanation("the CDATA section is not closed", "write ]]> at its end", begun)
    if reason == "duplicate attribute":
        hint = "remove one of them"
        return _Explanation(f"the attribute '{_word(data, offset)}' occurs twice in the tag", hint)
    if reason == "junk after document element":
        hint = "a file has one root element that contains all others: is it closed too early?"
        return _Explanation("the root element ends before this", hint)
    if reason == "undefined entity":
        entity = _ENTITY.search(data, offset)
        name = entity[0].decode("utf-8", "replace") if entity else "this"
        hint = "write the character itself; XML defines only &amp; &lt; &gt; &quot; &apos;"
        return _Explanation(f"{name} is not an XML entity", hint)
    if "declaration" in reason:
        return _Explanation("there is a second <?xml …?>", "remove it")
    if reason == "syntax error":
        return _Explanation("an element must begin here", _A_ROBOT)
    return _Explanation(reason)


def _opening(element: Element) -> tuple[Related, ...]:
    return (Related(f"<{element.tag}> is opened", element.origin, is_in_message=True),)


def _where(element: Element) -> str:
    line, column = element.source.line_column(element.start)
    return f"<{element.tag}>, opened at {line}:{column}"


def _word(data: bytes, offset: int) -> str:
    word = _NAME.match(data, offset)
    return word[0].decode("utf-8", "replace") if word else ""


def _safe(title: str, source: Source, start: int, end: int, replacement: str) -> Fix:
    return Fix(title, (Edit(Span(source, start, end), replacement),), safe=True)
