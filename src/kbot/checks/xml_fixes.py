"""What a view of the whole file adds to the errors of the floors below."""

from __future__ import annotations

import re

from kbot.text import Diagnostic, Edit, Fix, Span

_SPLIT_ROOT = re.compile(rb"<robot\s*>(\s*)<(xmlns:xacro\s*=)")


def improved(diagnostic: Diagnostic) -> Diagnostic:
    """A diagnostic from below with the hint and the fix that a view of the whole file gives."""
    if diagnostic.code != "P001" or diagnostic.origin is None:
        return diagnostic
    data = diagnostic.origin.span.source.data
    split = _SPLIT_ROOT.search(data)
    if split:
        span = Span(diagnostic.origin.span.source, split.start(), split.start(2))
        return _with(
            diagnostic,
            "the root element is broken in two: write "
            '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="…">',
            Fix("join the root element", (Edit(span, "<robot "),), safe=True),
        )
    if "declaration" in diagnostic.message and "start" in diagnostic.message:
        at = data.find(b"<?xml")
        if at > 0 and not data[:at].strip():
            span = Span(diagnostic.origin.span.source, 0, at)
            return _with(
                diagnostic,
                "<?xml …?> must be the very first thing in the file",
                Fix("remove what stands before <?xml", (Edit(span, ""),), safe=True),
            )
    return diagnostic


def _with(diagnostic: Diagnostic, hint: str, fix: Fix) -> Diagnostic:
    from dataclasses import replace

    return replace(diagnostic, hint=hint, fix=fix)
