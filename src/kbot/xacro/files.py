"""A cache of parsed files, valid while their text stays the same."""

from __future__ import annotations

from kbot.text.span import Source
from kbot.text.xml import MAX_NESTING, MAX_NODES, XmlDocument, parse_document

_CACHE_SIZE = 500
_cache: dict[str, XmlDocument] = {}


def clear_cache() -> None:
    """Forget the files that were parsed."""
    _cache.clear()


def parsed(source: Source, max_nesting: int = MAX_NESTING, max_nodes: int = MAX_NODES) -> XmlDocument:
    """The document of a source; the one parsed before where the text is the same.

    Raises:
        DescriptionError: P001 to P006, it is no usable XML.
    """
    known = _cache.get(source.path)
    if known is not None and known.source.text == source.text:
        return known
    if len(_cache) >= _CACHE_SIZE:
        del _cache[next(iter(_cache))]
    document = _cache[source.path] = parse_document(source, max_nesting, max_nodes)
    return document
