"""Repairs XML that ROS and Gazebo read although it is not well-formed. No offset changes."""

from __future__ import annotations

import re
from dataclasses import replace

from kbot.text.diagnostic import Diagnostic, Severity

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator

_DASH = re.compile(rb"-(?=-|\Z)")
_DECLARATION = re.compile(rb"<\?xml\s[^<>]*+>")
_BEFORE_ROOT = re.compile(rb"(?:\s++|<!--.*?-->|<\?xml\s[^<>]*+>)*+", re.DOTALL)
_VISIBLE = re.compile(rb"[^\n]")


def repaired(data: bytes, offset: int, reason: str, after_root: bool) -> bytes | None:
    """The XML without faults of the kind that expat found at `offset`. None if ROS and Gazebo reject it too.

    urdfdom 3.0 reads `--` in comments, an XML declaration after blanks or comments, and elements or end tags
    after the root element. So does libsdformat 12, except for a declaration after comments. It also reads
    text before `<sdf>`.
    """
    if "declaration" in reason:
        return _without_declarations(data, offset)
    first = data.find(b"<")
    if offset < first and data.startswith(b"<sdf", first):
        return _blank(data[:first]) + data[first:]
    in_comment = False
    parts, end = list[bytes](), 0
    for start, stop in _comments(data):
        in_comment |= start <= offset < stop + 3
        parts += data[end:start], _DASH.sub(b" ", data[start:stop])
        end = stop
    if in_comment:
        fixed = b"".join((*parts, data[end:]))
        return fixed if fixed != data else None
    start = data.rfind(b"<", 0, offset + 1)  # expat is at the slash of an end tag
    return data[:start] + _blank(data[start:]) if after_root and offset - start < 2 else None


def as_warning(problem: Diagnostic) -> Diagnostic:
    """The warning for an error that ROS and Gazebo do not report."""
    code = "P007" if problem.code == "P001" else problem.code
    message = f"{problem.message}. KBot reads the file as ROS and Gazebo do"
    return replace(problem, code=code, severity=Severity.WARNING, message=message)


def _without_declarations(data: bytes, offset: int) -> bytes | None:
    """The text without XML declarations before the root element. None if something else precedes them."""
    before = _BEFORE_ROOT.match(data)
    end = before.end() if before else 0
    if end <= offset:
        return None
    return _DECLARATION.sub(lambda match: _blank(match[0]), data[:end]) + data[end:]


def _comments(data: bytes) -> Iterator[tuple[int, int]]:
    """The start and end of the text in each comment that is closed."""
    at = data.find(b"<!")
    while at >= 0:
        is_comment = data.startswith(b"<!--", at)
        is_cdata = data.startswith(b"<![CDATA[", at)
        end = data.find(b"-->" if is_comment else b"]]>", at + 4) if is_comment or is_cdata else at + 2
        if end < 0:
            return
        if is_comment:
            yield at + 4, end
        at = data.find(b"<!", end)


def _blank(data: bytes) -> bytes:
    return _VISIBLE.sub(b" ", data)
