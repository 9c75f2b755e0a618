"""Parses the source files of a description without expanding them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

from kbot.text import Comment, DescriptionError, Element, KbotError, Source, Text, read_source
from kbot.xacro.files import parsed

XACRO = "xacro:"
_NAME = re.compile(r"[A-Za-z_]\w*")
_PARAMETER = re.compile(r"""(\*{0,2})([\w-]+)(\s*:?=\s*(?:\^\|?)?(?:'[^']*'|"[^"]*"|[^\s'"]*))?""")


@dataclass(frozen=True)
class MacroText:
    """A macro as written: its element, its parameter names, and all names that its body uses."""

    element: Element
    parameters: tuple[str, ...]
    words: frozenset[str]


@dataclass(frozen=True, eq=False)
class SourceFile:
    """One file: its text and its root element. The rest is computed on first use."""

    source: Source
    root: Element

    @property
    def path(self) -> str:
        return self.source.path

    @cached_property
    def elements(self) -> tuple[Element, ...]:
        """All elements in document order."""
        return tuple(in_order(self.root))

    @cached_property
    def xacro(self) -> tuple[Element, ...]:
        """The elements that xacro may change, in document order."""
        return tuple(e for e in self._walked[0] if not e.is_plain)

    @cached_property
    def _walked(self) -> tuple[tuple[Element, ...], tuple[int, ...]]:
        """Elements in document order, without the content of plain ones, and the index after the last element
        of each one's subtree."""
        elements, ends = [self.root], [1]
        inner = [(0, iter(() if self.root.is_plain else self.root.children))]
        while inner:
            at, children = inner[-1]
            for child in children:
                if type(child) is Element:
                    elements.append(child)
                    ends.append(len(elements))
                    if child.children and not child.is_plain:
                        inner.append((len(elements) - 1, iter(child.children)))
                        break
            else:
                ends[at] = len(elements)
                inner.pop()
        return tuple(elements), tuple(ends)

    @cached_property
    def _words(self) -> tuple[tuple[str, ...], ...]:
        return tuple(() if e.is_plain else words_of(e) for e in self._walked[0])

    @cached_property
    def words(self) -> frozenset[str]:
        """Every name that is used: in `${}` and `$()`, called macros, inserted blocks."""
        return frozenset().union(*self._words)

    def _words_in(self, start: int, end: int) -> frozenset[str]:
        return frozenset().union(*self._words[start:end])

    @cached_property
    def top(self) -> tuple[tuple[Element, frozenset[str]], ...]:
        """The root's children, each with the names used in it, without macros and arguments: macros use
        nothing until they are called."""
        elements, ends = self._walked
        found, at = [], 1
        while at < len(elements):
            element = elements[at]
            if element.tag not in ("xacro:macro", "xacro:arg"):
                found.append((element, self._words_in(at, ends[at])))
            at = ends[at]
        return tuple(found)

    @cached_property
    def macros(self) -> tuple[MacroText, ...]:
        elements, ends = self._walked
        return tuple(
            MacroText(e, tuple(parameters_of(e)), self._words_in(i + 1, ends[i]))
            for i, e in enumerate(elements)
            if e.tag == "xacro:macro" and "name" in e.attributes
        )


_CACHE_SIZE = 500
_files: dict[str, SourceFile] = {}


def read_sources(entry: Source, dependencies: Sequence[str]) -> tuple[SourceFile, ...]:
    """The entry and its XML dependencies. Files that cannot be read are left out."""
    files = []
    for path in dict.fromkeys((entry.path, *dependencies)):
        if path.endswith((".yaml", ".yml")):
            continue
        try:
            source = entry if path == entry.path else read_source(path, from_pipe=False)
            root = parsed(source).root
        except (DescriptionError, KbotError):
            continue
        files.append(_source_file(root))
    return tuple(files)


def _source_file(root: Element) -> SourceFile:
    """The `SourceFile` of a parsed file, cached until the file changes."""
    path = root.source.path
    known = _files.get(path)
    if known is None or known.root is not root:
        if len(_files) >= _CACHE_SIZE:
            del _files[next(iter(_files))]
        known = _files[path] = SourceFile(root.source, root)
    return known


def in_order(root: Element) -> list[Element]:
    """An element and all its descendants in document order."""
    found = [root]
    inner = [iter(root.children)]
    while inner:
        for child in inner[-1]:
            if type(child) is Element:
                found.append(child)
                if child.children:
                    inner.append(iter(child.children))
                    break
        else:
            inner.pop()
    return found


def words_of(element: Element) -> tuple[str, ...]:
    """The names that an element itself uses, without its descendants."""
    words: list[str] = []
    tag, attributes = element.tag, element.attributes
    if tag.startswith(XACRO):
        if tag == "xacro:insert_block":
            words.append(attributes.get("name", ""))
        elif tag == "xacro:call":
            words.append(attributes.get("macro", ""))
        elif tag in ("xacro:if", "xacro:unless"):
            words += _NAME.findall(attributes.get("value", ""))
        else:
            words.append(tag[len(XACRO) :])
    for value in attributes.values():
        if "$" in value:
            words += _NAME.findall(value)
    params = attributes.get("params")
    if params is not None and "^" in params:  # `name:=^` forwards the caller's property of that name
        words += (m[1] for m in re.finditer(r"(?<![\w-])([\w-]++)\s*:?=\s*\^", params))
        words += _NAME.findall(params)
    for child in element.children:
        if isinstance(child, Text) and type(child) is not Comment and "$" in child.value:
            words += _NAME.findall(child.value)
    return tuple(words)


def parameters_of(macro: Element) -> dict[str, str]:
    """The parameters of a macro by name, each with its default as written."""
    text = macro.attributes.get("params", "")
    return {m[2]: m[3] or "" for m in _PARAMETER.finditer(text)}


def named(file: SourceFile, tag: str) -> Iterator[tuple[str, Element]]:
    """The elements of a xacro tag whose name has no expression, each with its name."""
    for element in file.xacro:
        if element.tag == tag and "name" in element.attributes and "$" not in element.attributes["name"]:
            yield element.attributes["name"], element
