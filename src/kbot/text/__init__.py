"""The base of all packages: files, positions in them, XML, YAML, and the Diagnostic."""

TYPE_CHECKING = False
if TYPE_CHECKING:
    from kbot.text.diagnostic import Diagnostic, Edit, Fix, Related, Severity
    from kbot.text.diagnostic_collector import DiagnosticCollector
    from kbot.text.errors import DescriptionError, KbotError
    from kbot.text.files import read_source, rewrite, write_text
    from kbot.text.span import Call, Origin, Source, Span
    from kbot.text.xml import Comment, Element, Text, parse_xml

_HOMES = {
    "diagnostic_collector": ("DiagnosticCollector",),
    "diagnostic": ("Diagnostic", "Edit", "Fix", "Related", "Severity"),
    "errors": ("DescriptionError", "KbotError"),
    "files": ("read_source", "rewrite", "write_text"),
    "span": ("Call", "Origin", "Source", "Span"),
    "xml": ("Comment", "Element", "Text", "parse_xml"),
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


def __getattr__(name: str) -> object:
    """A name from its module, which is imported only now: most texts need no diagnostics."""
    from importlib import import_module  # lazy in this module: start-up time

    for module, names in _HOMES.items():
        if name in names:
            value: object = getattr(import_module(f"kbot.text.{module}"), name)
            globals()[name] = value
            return value
    raise AttributeError(f"module 'kbot.text' has no attribute '{name}'")
