"""Splits the difference between two texts into edits that can be applied one by one.

Whole lines are compared first. Where lines were replaced, their words are compared too, so that a harmless
edit and a fault in one line are two edits. Lines that were added or removed are split into complete XML
elements.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher
from itertools import accumulate, takewhile

_TOKEN = re.compile(
    r"<!--.*?(?:-->|\Z)"  # a comment
    r"|[A-Za-z_]\w*"
    r"|(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
    r"|\s+"
    r"|.",
    re.DOTALL,
)
_ATTRIBUTES = re.compile(rf"""(?<![\w:.-])[\w:.-]+\s*=\s*(?:"[^"<]*"|'[^'<]*')|{_TOKEN.pattern}""", re.DOTALL)
_VALUE = re.compile(r"\$\{[^{}]*\}|\d[\d.]*")
_MARKUP = re.compile(
    r"<!--.*?(?:-->|\Z)|<\?.*?(?:\?>|\Z)|<!\[CDATA\[.*?(?:\]\]>|\Z)|<(/?)[^<>]*?(/?)>", re.DOTALL
)
_QUOTES = ('"', "'")
_MOST_PARTS = 8
"""Edits within a pair of lines. More of them do not make sense one by one: the line was replaced."""
_MOST_TOKENS = 2000
"""Words of a replaced block that are compared. The time grows with the square."""
_LONG = 5000
"""Lines without a unique one among them, from which frequent lines are ignored: they take quadratic time."""
_ALIKE = 0.5
"""The least similarity (from 0 to 1) of two blocks of different length whose words are compared."""


@dataclass(frozen=True, slots=True)
class TextEdit:
    """The replacement of the characters from `start` to `end` of text A, by those from `to_start` to `to_end`
    of text B."""

    start: int
    end: int
    to_start: int
    to_end: int


def text_edits(before: str, after: str) -> list[TextEdit]:
    """The edits that turn a text into another one, in order. They do not overlap."""
    a, b = before.splitlines(keepends=True), after.splitlines(keepends=True)
    # if a name is new in most lines, lines match better without names and numbers
    ways = (_line_edits(a, b, key) for key in (str, _pattern))
    return min(ways, key=lambda edits: sum(e.end - e.start + e.to_end - e.to_start for e in edits))


def _pattern(line: str) -> str:
    """A line without its white space, numbers and expressions."""
    return _VALUE.sub("0", "".join(line.split()))


def _line_edits(a: Sequence[str], b: Sequence[str], key: Callable[[str], str]) -> list[TextEdit]:
    """The edits between lines, of which those with the same key match."""
    starts_a, starts_b = [0, *accumulate(map(len, a))], [0, *accumulate(map(len, b))]
    found: list[TextEdit] = []
    for tag, i1, i2, j1, j2 in _opcodes([*map(key, a)], [*map(key, b)]):
        if tag in ("replace", "equal"):
            pairs = [(i1, i2, j1, j2)]
            if i2 - i1 == j2 - j1:
                pairs = [(i1 + n, i1 + n + 1, j1 + n, j1 + n + 1) for n in range(i2 - i1)]
            for first, last, to_first, to_last in pairs:
                old, new = "".join(a[first:last]), "".join(b[to_first:to_last])
                if old != new:
                    found += _within(old, new, starts_a[first], starts_b[to_first])
            continue
        above, below = zip(a[:i1][::-1], b[:j1][::-1], strict=False), zip(a[i2:], b[j2:], strict=False)
        lines, ends = (b, (j1, j2)) if tag == "insert" else (a, (i1, i2))
        moved = _slide(lines, *ends, range(-_equal(above), _equal(below) + 1))
        for first, last in _blocks(lines, ends[0] + moved, ends[1] + moved):
            if tag == "insert":
                at = starts_a[i1 + moved]
                found.append(TextEdit(at, at, starts_b[first], starts_b[last]))
            else:
                at = starts_b[j1 + moved]
                found.append(TextEdit(starts_a[first], starts_a[last], at, at))
    return found


def edit_groups(before: str, after: str) -> list[tuple[TextEdit, ...]]:
    """The edits that turn a text into another one. Edits of a line that belong together are a group: an
    opening and a closing bracket or quote, and a word that was moved."""
    rows: list[list[TextEdit]] = []
    for edit in text_edits(before, after):
        last = rows[-1][-1] if rows else None
        if last is None or "\n" in before[last.start : edit.start] + after[last.to_start : edit.to_start]:
            rows.append([])
        rows[-1].append(edit)
    return [group for row in rows for group in _groups(before, after, row)]


def _groups(before: str, after: str, row: Sequence[TextEdit]) -> list[tuple[TextEdit, ...]]:
    """The groups of edits in a line."""
    groups, opened, depth = list[list[TextEdit]](), list[TextEdit](), 0
    moved: dict[str, list[TextEdit]] = {}
    for edit in row:
        old, new = before[edit.start : edit.end], after[edit.to_start : edit.to_end]
        twin = moved.pop((old + new).strip(), None) if not old or not new else None
        if twin is not None and bool(old) != bool(before[twin[0].start : twin[0].end]):
            twin.append(edit)
            continue
        change = (
            _depth(new) - _depth(old) if new not in _QUOTES or old not in _QUOTES else (-1 if opened else 1)
        )
        if not change:
            groups.append([edit])
            moved[(old + new).strip()] = groups[-1]
            continue
        opened.append(edit)
        depth += change
        if depth == 0:
            groups.append(opened)
            opened = []
    groups += ([edit] for edit in opened)
    return sorted((tuple(group) for group in groups), key=lambda group: row.index(group[0]))


def _depth(text: str) -> int:
    return sum(map(text.count, "([{")) - sum(map(text.count, ")]}"))


def applied(before: str, after: str, edits: Iterable[TextEdit]) -> str:
    """Text A with some of the edits that turn it into text B."""
    parts, at = list[str](), 0
    for edit in sorted(edits, key=lambda e: (e.start, e.end, e.to_start)):
        parts += before[at : edit.start], after[edit.to_start : edit.to_end]
        at = edit.end
    return "".join((*parts, before[at:]))


def _opcodes(a: Sequence[str], b: Sequence[str]) -> Iterator[tuple[str, int, int, int, int]]:
    """How to turn a list of lines into another one, as `SequenceMatcher.get_opcodes` does.

    Lines that are unique in both lists are matched first (the patience diff of Bram Cohen). So the time does
    not grow with the square of the length, and similar elements are not matched with each other.
    """
    last, to_last = 0, 0
    for i, j in (*_unique_matches(a, b), (len(a), len(b))):
        gap = SequenceMatcher(None, a[last:i], b[to_last:j], autojunk=max(i - last, j - to_last) > _LONG)
        for tag, i1, i2, j1, j2 in gap.get_opcodes():
            yield tag, last + i1, last + i2, to_last + j1, to_last + j2
        if i < len(a):
            yield "equal", i, i + 1, j, j + 1
        last, to_last = i + 1, j + 1


def _unique_matches(a: Sequence[str], b: Sequence[str]) -> list[tuple[int, int]]:
    """The longest list of lines in the same order that are unique in both lists, by their indexes."""
    counts_a, counts_b = Counter(a), Counter(b)
    places = {line: index for index, line in enumerate(b)}
    pairs = [(i, places[line]) for i, line in enumerate(a) if counts_a[line] == 1 == counts_b[line]]
    # the longest increasing subsequence: for each length, the pair that ends it lowest
    ends, lowest, before = list[int](), list[int](), list[int]()
    for index, (_, j) in enumerate(pairs):
        length = bisect_left(lowest, j)
        before.append(ends[length - 1] if length else -1)
        ends[length : length + 1], lowest[length : length + 1] = [index], [j]
    found, at = list[tuple[int, int]](), ends[-1] if ends else -1
    while at >= 0:
        found.append(pairs[at])
        at = before[at]
    return found[::-1]


def _equal(pairs: Iterable[tuple[str, str]]) -> int:
    """The number of pairs of equal lines before the first other pair."""
    return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], pairs))


def _within(old: str, new: str, start: int, to_start: int) -> list[TextEdit]:
    """The edits between two texts by words, or a single one if the texts have little in common.

    Attributes match by name, so that a value is compared with the value that it had.
    """
    a, b = _ATTRIBUTES.findall(old), _ATTRIBUTES.findall(new)
    found: list[TextEdit] = []
    if max(len(a), len(b)) <= _MOST_TOKENS:
        starts_a, starts_b = [0, *accumulate(map(len, a))], [0, *accumulate(map(len, b))]
        matcher = SequenceMatcher(None, [*map(_attribute, a)], [*map(_attribute, b)], autojunk=False)
        for tag, i1, i2, j1, j2 in matcher.get_opcodes():
            pairs = [(i1, i2, j1, j2)]
            if tag == "equal":
                pairs = [(i1 + n, i1 + n + 1, j1 + n, j1 + n + 1) for n in range(i2 - i1)]
            for first, last, to_first, to_last in pairs:
                texts = "".join(a[first:last]), "".join(b[to_first:to_last])
                found += _by_words(*texts, start + starts_a[first], to_start + starts_b[to_first])
        most = _MOST_PARTS * max(1, old.count("\n"))
        if matcher.ratio() >= _ALIKE and len(found) <= most:
            return found
    return [TextEdit(start, start + len(old), to_start, to_start + len(new))]


def _by_words(old: str, new: str, start: int, to_start: int) -> Iterator[TextEdit]:
    """The edits between two texts by words."""
    a, b = _TOKEN.findall(old), _TOKEN.findall(new)
    starts_a, starts_b = [0, *accumulate(map(len, a))], [0, *accumulate(map(len, b))]
    for tag, i1, i2, j1, j2 in SequenceMatcher(None, a, b, autojunk=False).get_opcodes():
        for first, last, to_first, to_last in _parts(a, b, i1, i2, j1, j2) if tag != "equal" else ():
            ends = start + starts_a[first], start + starts_a[last]
            yield TextEdit(*ends, to_start + starts_b[to_first], to_start + starts_b[to_last])


def _attribute(token: str) -> str:
    """The name of an attribute with its equals sign. Other tokens stay as they are."""
    return token[: token.index("=") + 1] if token[-1] in _QUOTES and "=" in token else token


def _parts(
    a: Sequence[str], b: Sequence[str], i1: int, i2: int, j1: int, j2: int
) -> Iterator[tuple[int, int, int, int]]:
    """The parts of a replacement of words, so that a new name is an edit by itself: in `radius` →
    `2*(wheel_radius)`, a factor was added, and a name was replaced."""
    kinds_a, kinds_b = [_kind(token) for token in a[i1:i2]], [_kind(token) for token in b[j1:j2]]
    for tag, k1, k2, n1, n2 in SequenceMatcher(None, kinds_a, kinds_b, autojunk=False).get_opcodes():
        first, last, to_first, to_last = i1 + k1, i1 + k2, j1 + n1, j1 + n2
        if tag != "equal":
            yield first, last, to_first, to_last
            continue
        for i, j in zip(range(first, last), range(to_first, to_last), strict=True):
            if a[i] != b[j]:
                yield i, i + 1, j, j + 1


def _kind(token: str) -> str:
    """`name` for each name; other words are their own kind."""
    return "name" if token[0].isalpha() or token[0] == "_" else token


def _slide(lines: Sequence[str], first: int, last: int, room: Iterable[int]) -> int:
    """How far to move a block of added or removed lines, so that it consists of complete elements.

    Where `<b/></a><a>` was added after `<a>`, the difference is the same as `<a><b/></a>` before it.
    """
    if _is_complete("".join(lines[first:last])):
        return 0
    size = last - first
    for moved in sorted(room, key=abs):
        at = first + moved
        same = all(lines[n] == lines[n + size] for n in range(min(first, at), max(first, at)))
        if moved and same and _is_complete("".join(lines[at : at + size])):
            return moved
    return 0


def _blocks(lines: Sequence[str], first: int, last: int) -> Iterator[tuple[int, int]]:
    """The smallest groups of lines that are complete elements, or else all lines as one."""
    if not _is_complete("".join(lines[first:last])):
        yield first, last
        return
    for end in range(first + 1, last + 1):
        if _is_complete("".join(lines[first:end])):
            yield first, end
            first = end


def _is_complete(text: str) -> bool:
    """Whether each element and comment in a text begins and ends in it. True for a text that is not XML."""
    depth, at = 0, 0
    for match in _MARKUP.finditer(text):
        if "<" in text[at : match.start()] or "-->" in text[at : match.start()]:
            return False
        at = match.end()
        if match[1] is not None and not match[2]:
            depth += -1 if match[1] else 1
            if depth < 0:
                return False
    return depth == 0 and "<" not in text[at:] and "-->" not in text[at:]
