"""Reads files, XML and YAML with source positions, and defines the Diagnostic. All packages use it."""

from kbot.lazy_names import lazy_names, public_names

TYPE_CHECKING = False
if TYPE_CHECKING:
    from kbot.text.diagnostic import Diagnostic, Edit, Fix, Related, Severity
    from kbot.text.diagnostic_collector import DiagnosticCollector
    from kbot.text.errors import DescriptionError, KbotError
    from kbot.text.files import read_source, rewrite, write_text
    from kbot.text.span import Call, Origin, Source, Span
    from kbot.text.xml import Comment, Element, Text, parse_xml

_HOMES = {
    "Call": "span",
    "Comment": "xml",
    "DescriptionError": "errors",
    "Diagnostic": "diagnostic",
    "DiagnosticCollector": "diagnostic_collector",
    "Edit": "diagnostic",
    "Element": "xml",
    "Fix": "diagnostic",
    "KbotError": "errors",
    "Origin": "span",
    "Related": "diagnostic",
    "Severity": "diagnostic",
    "Source": "span",
    "Span": "span",
    "Text": "xml",
    "parse_xml": "xml",
    "read_source": "files",
    "rewrite": "files",
    "write_text": "files",
}

__all__ = [
    "Call",
    "Comment",
    "DescriptionError",
    "Diagnostic",
    "DiagnosticCollector",
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
    "rewrite",
    "write_text",
]

# imported on first use: start-up time
__getattr__ = lazy_names(__name__, _HOMES)
__dir__ = public_names(__all__)
