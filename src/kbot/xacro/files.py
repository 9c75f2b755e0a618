"""Caches parsed files by path. An entry is valid while the file's text is the same."""

from __future__ import annotations

from kbot.text.span import Source
from kbot.text.xml import MAX_NESTING, MAX_NODES, XmlDocument, parse_document

_CACHE_SIZE = 500
_cache: dict[tuple[str, bool], XmlDocument] = {}


def clear_cache() -> None:
    """Forget all parsed files."""
    _cache.clear()


def parsed(
    source: Source, max_nesting: int = MAX_NESTING, max_nodes: int = MAX_NODES, *, lenient: bool = False
) -> XmlDocument:
    """The parsed document of a source, from the cache if possible. `lenient` as for `parse_document`.

    Raises:
        DescriptionError: P001 to P006, the text is not usable XML.
    """
    key = source.path, lenient
    known = _cache.get(key)
    if known is not None and known.source.text == source.text:
        return known
    if len(_cache) >= _CACHE_SIZE:
        del _cache[next(iter(_cache))]
    document = _cache[key] = parse_document(source, max_nesting, max_nodes, lenient=lenient)
    return document
