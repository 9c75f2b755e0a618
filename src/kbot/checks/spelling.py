"""Fixes of names that are a slip away from the only one that can be meant, where they were written."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace

from kbot.checks.context import Context
from kbot.checks.edits import rename_tag
from kbot.text import Diagnostic, Edit, Fix, Span
from kbot.text.suggest import Suggestion


def respelled(diagnostic: Diagnostic, context: Context) -> Diagnostic:
    """The finding with a fix that writes the name its hint is sure of, here and where else it is needed.

    A name that is put together, as `${prefix}_lnk`, is left alone.
    """
    hint, origin = diagnostic.hint, diagnostic.origin
    if diagnostic.fix is not None or origin is None or not isinstance(hint, Suggestion) or not hint.sure:
        return diagnostic
    others = [r.origin.span for r in diagnostic.related if r.message == "needed here"]
    first, *further = ([*_edits(span, hint, context)] for span in dict.fromkeys((origin.span, *others)))
    if not first:
        return diagnostic
    edits = (*first, *(edit for more in further for edit in more))
    return replace(diagnostic, fix=Fix(f"write '{hint.sure}'", tuple(dict.fromkeys(edits)), safe=True))


def _edits(span: Span, hint: Suggestion, context: Context) -> Iterator[Edit]:
    """A macro's name in its call, a value or a text that is the name, or the name within expressions."""
    source, written = span.source, re.escape(hint.written).encode()
    if span.text.startswith("<"):
        call = context.call_at(span)
        if call is not None and call.tag == f"xacro:{hint.written}":
            renamed = rename_tag(call, f"xacro:{hint.sure}", safe=True)
            yield from renamed.edits if renamed else ()
            return
        found = [*re.compile(rb"[\"']" + written + rb"[\"']").finditer(source.data, span.start, span.end)]
        places = [(match.start() + 1, match.end() - 1) for match in found if len(found) == 1]
        text = re.compile(rb"\s*(" + written + rb")\s*</").match(source.data, span.end)
        places += [text.span(1)] if text and not found else []
    elif "$" in span.text:
        word = re.compile(rb"(?<![\w.])" + written + rb"(?!\w)")
        places = [match.span() for match in word.finditer(source.data, span.start, span.end)]
    else:
        places = [(span.start, span.end)] if span.text == hint.written else []
    for start, end in places:
        yield Edit(Span(source, start, end), hint.sure)
