"""Suggests valid names for a misspelled name.

Users follow a suggestion without checking it, so a merely similar name does harm. With `wheel_radius` for an
undefined `caster_wheel_radius`, the robot has no error message, but its caster is below the ground. Therefore
every suggestion is one edit away, or has the same words in another order.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Hashable, Iterable
from functools import lru_cache
from itertools import chain, islice

_LONGEST = 200
"""Characters of the longest name that is compared. Longer ones are data, and comparing them costs time."""
_MANY = 50
"""Names that are compared with a misspelled name, at up to a microsecond each. A broken file may have
thousands of misspelled names and thousands of others."""
_KEPT = 2
"""Letters of a word that an edit must leave unchanged. `fl` and `fr` have fewer: they are different words."""
_LISTED = 6
"""Names that a message lists instead of a suggestion."""
_SURE = 4
"""Letters of the shortest word whose edit is certainly a typo. Shorter words such as `tap` and `tip` may both
be meant. Replacing the first or last letter of a word needs as many letters: `min` is not `mid`."""
_SIDES = frozenset("lrfbmxyz")
"""Letters that can mean a side or an axis at the start or end of a word. `lwheel` and `rwheel`, `posx` and
`posy`, `lwheel` and `wheel` are different names."""
_CONNECTING = frozenset({"from", "in", "of", "on", "per", "to"})
"""Words with which the order of the other words matters: `left_to_right`, `map_from_odom`."""
_OPPOSITES = (
    {"left", "right"}, {"front", "rear"}, {"front", "back"}, {"upper", "lower"}, {"top", "bottom"},
    {"inner", "outer"}, {"min", "max"},
)  # fmt: skip
"""If a name has both words of a pair, their order matters: `left_arm_right_finger`."""
_HUMP = re.compile(r"(?<=[a-z])(?=[A-Z])")
_UNIT = re.compile(r"[^\W\d_]+|\d+")


class Candidates(tuple[str, ...]):
    """Names with which many misspelled names are compared. Two instances are equal only if they are the same.

    `_index` is cached by its argument. Hashing a plain tuple of thousands of names takes longer than the
    comparisons.
    """

    __slots__ = ()
    __hash__ = object.__hash__

    def __eq__(self, other: object) -> bool:
        return self is other


def nearest(name: str, candidates: Iterable[str], count: int = 3, *, sides: bool = True) -> list[str]:
    """Up to `count` candidates that differ from `name` by one typo, in alphabetical order.

    The result is sorted because many callers pass a set.

    `sides`: whether a letter at the start or end of a word can mean a side or an axis. It cannot in a fixed
    vocabulary such as the verbs: `siml` is a typo of `sim`.
    """
    if len(name) > _LONGEST:
        return []
    names = candidates if isinstance(candidates, Candidates) else tuple(candidates)
    promising = _promising(name, names)
    near = {other for other in promising if len(other) <= _LONGEST and _is_typo(name, other, sides=sides)}
    return sorted(near)[:count]


def _promising(name: str, candidates: tuple[str, ...]) -> Iterable[str]:
    """The candidates, or if there are many, the first ones that share a trait with the name."""
    if len(candidates) <= _MANY:
        return candidates
    index = _index(candidates)
    return islice(dict.fromkeys(chain.from_iterable(index.get(key, ()) for key in _traits(name))), _MANY)


@lru_cache(maxsize=4)  # a broken file looks up thousands of names among the same candidates
def _index(candidates: tuple[str, ...]) -> dict[Hashable, list[str]]:
    """The candidates by trait."""
    index = defaultdict[Hashable, list[str]](list)
    for candidate in candidates:
        for key in _traits(candidate[:_LONGEST]):
            index[key].append(candidate)
    return index


def _traits(name: str) -> tuple[Hashable, Hashable, Hashable]:
    """The words, start and end of a name. In all but short names, a typo leaves one of them unchanged."""
    joined, numbers, words = _words(name)
    return words, ("begins", joined[:2], numbers), ("ends", joined[-2:], numbers)


class Suggestion(str):
    """A hint that suggests names, together with the names."""

    written: str
    nearest: tuple[str, ...]

    def __new__(cls, hint: str, written: str, nearest: Iterable[str] = ()) -> Suggestion:
        self = super().__new__(cls, hint)
        self.written, self.nearest = written, tuple(nearest)
        return self

    def __reduce__(self) -> tuple[type[Suggestion], tuple[str, str, tuple[str, ...]]]:
        """Supports copying: diagnostics are copied for the page."""
        return type(self), (str(self), self.written, self.nearest)

    @property
    def sure(self) -> str:
        """The name that was certainly meant, which a fix can write. Empty if there are none or several."""
        alone = self.nearest[0] if len(self.nearest) == 1 else ""
        return alone if alone and _is_typo(self.written, alone, _SURE) else ""


def did_you_mean(name: str, candidates: Iterable[str], *, sides: bool = True) -> Suggestion:
    """`did you mean 'a' or 'b'?`, or an empty string if no candidate differs from `name` by one typo."""
    near = nearest(name, candidates, sides=sides)
    names = [f"'{n}'" for n in near]
    either = (", ".join(names[:-1]) + " or " if len(names) > 1 else "") + names[-1] if names else ""
    return Suggestion(f"did you mean {either}?" if names else "", name, near)


def suggest_or_list(name: str, known: Iterable[str]) -> str:
    """`did you mean 'a'?`, or else the first known names: `choose from a, b, … (9 more)`."""
    names = list(known)
    more = len(names) - _LISTED
    end = f", … ({more} more)" if more > 0 else ""
    return did_you_mean(name, names) or f"choose from {', '.join(names[:_LISTED])}{end}"


@lru_cache(maxsize=1 << 14)  # a file with many unknown names compares each with the same candidates
def _words(name: str) -> tuple[str, tuple[str, ...], tuple[str, ...]]:
    """The words of a name in lower case: joined by `_`, the numbers among them, and all sorted."""
    words = _UNIT.findall(_HUMP.sub("_", name).lower())
    return "_".join(words), tuple(word for word in words if word.isdigit()), tuple(sorted(words))


@lru_cache(maxsize=1 << 14)  # the same typo often occurs many times
def _is_typo(written: str, meant: str, shortest: int = 0, *, sides: bool = True) -> bool:
    """Whether two names differ by one letter, two swapped letters, or capitals, separators and word order.

    One letter may be missing, extra or replaced. An edited word has at least `shortest` letters. Numbers must
    agree: `arm_1` and `arm_2` are different names.
    """
    (joined, numbers, words), (other, other_numbers, other_words) = _words(written), _words(meant)
    if numbers != other_numbers or not joined or written == meant:
        return False
    if words == other_words:
        return joined == other or not _order_matters(words)
    return _is_one_edit(joined, other, shortest, sides)


def _order_matters(words: tuple[str, ...]) -> bool:
    return not _CONNECTING.isdisjoint(words) or any(pair.issubset(words) for pair in _OPPOSITES)


def _is_one_edit(written: str, meant: str, shortest: int, sides: bool) -> bool:
    if abs(len(written) - len(meant)) > 1:
        return False
    if len(written) > 5 and written[:2] != meant[:2] and written[-2:] != meant[-2:]:
        return False  # quick test for most names: one edit leaves the first or last two letters unchanged
    start = _common(written, meant)
    end = _common(written[start:][::-1], meant[start:][::-1])
    wrong, right = written[start : len(written) - end], meant[start : len(meant) - end]
    is_swap = len(wrong) == 2 and wrong == right[::-1]
    if max(len(wrong), len(right)) > 1 and not is_swap:
        return False
    if any(c.isdigit() for c in wrong + right):
        return False
    before = re.split(r"[_\d]", meant[:start])[-1]
    after = re.split(r"[_\d]", meant[len(meant) - end :])[0]
    is_doubled = not right and before.endswith(wrong)
    is_at_end = not (before and after)
    is_side = sides and wrong and is_at_end and _SIDES.issuperset(wrong + right)
    if is_side and not is_swap and not is_doubled:
        return False
    kept = len(before) + len(after)
    if is_swap:  # all letters are there, so one more is enough to recognize the word
        return kept > 0
    if is_at_end and wrong and right:
        shortest = _SURE
    return kept >= _KEPT and kept + max(len(wrong), len(right)) >= shortest


def _common(text: str, other: str) -> int:
    """The number of equal characters at the start of two texts."""
    both = enumerate(zip(text, other, strict=False))
    return next((i for i, (a, b) in both if a != b), min(len(text), len(other)))
