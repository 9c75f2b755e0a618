"""What to do about a text that is not well-formed XML, where a view of the whole of it tells."""

from __future__ import annotations

import re

from kbot.text.diagnostic import Edit, Fix
from kbot.text.span import Source, Span

_SPLIT_ROOT = re.compile(rb"<robot\s*>(\s*)<(xmlns:xacro\s*=)")
_NAMELESS = re.compile(rb"<([\w:.-]+)\s*=")


def advice(source: Source, offset: int, reason: str) -> tuple[str, Fix | None]:
    """A hint and perhaps a fix for what the parser refused at a byte; an empty hint where it is not known."""
    data = source.data
    split = _SPLIT_ROOT.search(data)
    if split:
        span = Span(source, split.start(), split.start(2))
        return (
            "the root element is broken in two: write "
            '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="…">',
            Fix("join the root element", (Edit(span, "<robot "),), safe=True),
        )
    at = data.find(b"<?xml")
    if "declaration" in reason and at > 0 and not data[:at].strip():
        return (
            "<?xml …?> must be the very first thing in the file",
            Fix("remove what stands before <?xml", (Edit(Span(source, 0, at), ""),), safe=True),
        )
    tag = data.rfind(b"<", 0, offset + 1)
    nameless = _NAMELESS.match(data, tag, tag + 200) if tag >= 0 else None
    if nameless is None:
        return "", None
    name = nameless[1].decode("utf-8", "replace")
    return f"'{name}' is an attribute, and no element: put it into the tag of the element before", None
