"""Splits a node's arguments into options, values and other words, and finds where each was written."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from kbot.ros import names
from kbot.ros.launch.plan import PlannedNode
from kbot.ros.launch.quoting import split_words
from kbot.text import Diagnostic, Origin, Severity, Span
from kbot.text.numbers import to_float


@dataclass(frozen=True)
class Options:
    """The words after each option, and all other words. The last of several options with one name counts."""

    node: PlannedNode
    given: Mapping[str, tuple[str, ...]]
    rest: tuple[str, ...]
    notes: list[Diagnostic] = field(default_factory=list)
    """Errors in the values. `number` adds to them."""

    def text(self, *names: str) -> str | None:
        """The word after an option. Of several names, the first that was given counts."""
        found = next((self.given[name] for name in names if self.given.get(name)), None)
        return found[0] if found else None

    def has(self, *names: str) -> bool:
        return any(name in self.given for name in names)

    def number(self, name: str, default: float = 0.0) -> float:
        """The number after an option. For a word that is not a number, adds a note and returns the
        default."""
        word = self.text(name)
        return default if word is None else number(self.node, word, name, default, self.notes)


def split(node: PlannedNode) -> list[str]:
    """The words of a node's arguments. Empty if a quote is not closed."""
    try:
        return split_words(node.args)
    except ValueError:
        return []


def full_name(name: str, node: PlannedNode) -> str:
    """The full name of a node's topic, without its remaps."""
    return names.canonical(names.join(node.namespace, name))


def full_remaps(node: PlannedNode) -> dict[str, str]:
    """The full names that a node's remaps replace, each with the one that replaces it."""
    words = (word.split(":=", 1) for word in split(node) if ":=" in word)
    pairs = (*node.remaps, *((source, target) for source, target in words))
    return {full_name(source, node): full_name(target, node) for source, target in pairs}


def read_options(node: PlannedNode, values: Mapping[str, int]) -> Options:
    """Read a node's options. `values` is the number of words after each option; -1 means all words up to the
    next option. The word of a long option can also follow a `=`."""
    given: dict[str, tuple[str, ...]] = {}
    rest: list[str] = []
    words = split(node)
    at = 0
    while at < len(words):
        word, at = words[at], at + 1
        name, mark, value = word.partition("=")
        if mark and name.startswith("--") and values.get(name):
            given[name] = (*given.get(name, ()), value) if values[name] < 0 else (value,)
            continue
        if word not in values:
            rest.append(word)
            continue
        count = values[word]
        if count < 0:
            ends = (i for i, w in enumerate(words[at:]) if w in values or w.partition("=")[0] in values)
            count = next(ends, len(words) - at)
        given[word] = (*given.get(word, ()), *words[at : at + count]) if count else ()
        at += count
    return Options(node, given, tuple(rest))


def number(node: PlannedNode, word: str, what: str, default: float, notes: list[Diagnostic]) -> float:
    """A word of a node's arguments as a finite number. For any other word, adds a note and returns the
    default."""
    try:
        value = to_float(word)
    except ValueError:
        value = math.nan
    if math.isfinite(value):
        return value
    message = f"{what} must be a finite number, not '{word}'"
    notes.append(Diagnostic("L062", Severity.ERROR, message, place_of(node, word), "the node rejects it"))
    return default


_WRITTEN = re.compile(r"(?:\$\([^)]*(?:\)|\Z)|\S)+")
"""A word as it is written in the file. `$(find a)/b` is one word."""


def place_of(node: PlannedNode, word: str) -> Origin:
    """Where a word of a node's arguments was written. If it is not found, where the arguments were."""
    origin = node.spans.get("args", node.origin)
    words = _WRITTEN.findall(origin.span.text)
    return _nth(origin, words.index(word)) if word in words else origin


def place_of_value(node: PlannedNode, option: str) -> Origin:
    """Where the value of an option was written. For `--option=value` this includes the option, because both
    are one word. If the option is not found, where the arguments were."""
    origin = node.spans.get("args", node.origin)
    words = _WRITTEN.findall(origin.span.text)
    for at in reversed(range(len(words))):
        if words[at].startswith(f"{option}="):
            return _nth(origin, at)
        if words[at] == option and at + 1 < len(words):
            return _nth(origin, at + 1)
    return origin


def _nth(origin: Origin, number: int) -> Origin:
    """The origin of a word, counted from 0."""
    span = origin.span
    at = span.start
    for count, word in enumerate(_WRITTEN.findall(span.text)):
        at = span.source.data.index(word.encode(), at)
        if count == number:
            return Origin(Span(span.source, at, at + len(word.encode())), origin.call)
        at += len(word.encode())
    return origin
