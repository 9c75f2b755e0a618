"""Ground floor: files, spans, XML with exact positions, and the one Diagnostic that everything reports in."""

from kbot.text.diagnostic import Diagnostic, Edit, Fix, Related, Severity
from kbot.text.errors import DescriptionError, KbotError
from kbot.text.files import read_source, write_text
from kbot.text.span import Call, Origin, Source, Span
from kbot.text.xml import Comment, Element, Text, parse_xml

__all__ = [
    "Call",
    "Comment",
    "DescriptionError",
    "Diagnostic",
    "Edit",
    "Element",
    "Fix",
    "KbotError",
    "Origin",
    "Related",
    "Severity",
    "Source",
    "Span",
    "Text",
    "parse_xml",
    "read_source",
    "write_text",
]
