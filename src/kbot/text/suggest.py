"""Suggests valid names for a misspelled name.

A reader follows a suggestion without checking it, so a merely similar name does harm: `wheel_radius` for an
undefined `caster_wheel_radius` gives a robot without an error message whose caster is under the ground. One
rule therefore holds for every suggestion: the name is one edit away, or has the same words in another order.
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
"""Names that are compared with a misspelled one, at up to a microsecond each: a broken file may have
thousands of misspelled names beside thousands of others."""
_KEPT = 2
"""Letters of a word that an edit leaves: `fl` and `fr`, `a` and `b` keep fewer: they are different words."""
_SURE = 4
"""Letters of the shortest word whose edit is surely a slip: `tap` may be meant where `tip` is known. At a
word's end every replaced letter needs as many: `min` and `mid`."""
_SIDES = frozenset("lrfbmxyz")
"""Letters that name a side or an axis at the beginning or end of a word: `lwheel` and `rwheel`, `posx` and
`posy` are different names, and so are `lwheel` and `wheel`."""
_CONNECTING = frozenset({"from", "in", "of", "on", "per", "to"})
"""With one of these the order of the words matters: `left_to_right`, `map_from_odom`."""
_OPPOSITES = (
    {"left", "right"}, {"front", "rear"}, {"front", "back"}, {"upper", "lower"}, {"top", "bottom"},
    {"inner", "outer"}, {"min", "max"},
)  # fmt: skip
"""With both words of a pair their order matters: `left_arm_right_finger`."""
_HUMP = re.compile(r"(?<=[a-z])(?=[A-Z])")
_UNIT = re.compile(r"[^\W\d_]+|\d+")


def nearest(name: str, candidates: Iterable[str], count: int = 3, *, sides: bool = True) -> list[str]:
    """Up to `count` candidates that are one slip away from `name`, in alphabetical order.

    They are sorted because many callers pass a set.

    `sides`: whether a letter at the beginning or end of a word may name a side or an axis. In a fixed
    vocabulary such as the verbs it does not: `siml` is a slip of `sim`.
    """
    if len(name) > _LONGEST:
        return []
    promising = _promising(name, tuple(candidates))
    near = {other for other in promising if len(other) <= _LONGEST and _is_a_slip(name, other, sides=sides)}
    return sorted(near)[:count]


def _promising(name: str, candidates: tuple[str, ...]) -> Iterable[str]:
    """Of many candidates, the first that share a trait with the name."""
    if len(candidates) <= _MANY:
        return candidates
    index = _index(candidates)
    return islice(dict.fromkeys(chain.from_iterable(index.get(key, ()) for key in _traits(name))), _MANY)


@lru_cache(maxsize=4)  # a broken file asks for thousands of names, each among the same thousands
def _index(candidates: tuple[str, ...]) -> dict[Hashable, list[str]]:
    """The candidates by each of their traits."""
    index = defaultdict[Hashable, list[str]](list)
    for candidate in candidates:
        for key in _traits(candidate[:_LONGEST]):
            index[key].append(candidate)
    return index


def _traits(name: str) -> tuple[Hashable, Hashable, Hashable]:
    """The words of a name, its beginning and its end. A slip leaves one of them, in all but short names."""
    joined, numbers, words = _words(name)
    return words, ("begins", joined[:2], numbers), ("ends", joined[-2:], numbers)


class Suggestion(str):
    """A hint of the names that were perhaps meant, and those names."""

    written: str
    nearest: tuple[str, ...]

    def __new__(cls, hint: str, written: str, nearest: Iterable[str] = ()) -> Suggestion:
        self = super().__new__(cls, hint)
        self.written, self.nearest = written, tuple(nearest)
        return self

    def __reduce__(self) -> tuple[type[Suggestion], tuple[str, str, tuple[str, ...]]]:
        """How a copy is made: diagnostics are copied for the page."""
        return type(self), (str(self), self.written, self.nearest)

    @property
    def sure(self) -> str:
        """The name that was surely meant, which a fix may write; empty where none or several are near."""
        alone = self.nearest[0] if len(self.nearest) == 1 else ""
        return alone if alone and _is_a_slip(self.written, alone, _SURE) else ""


def did_you_mean(name: str, candidates: Iterable[str], *, sides: bool = True) -> Suggestion:
    """`did you mean 'a' or 'b'?`, or an empty text when no candidate is one slip away from `name`."""
    near = nearest(name, candidates, sides=sides)
    names = [f"'{n}'" for n in near]
    either = (", ".join(names[:-1]) + " or " if len(names) > 1 else "") + names[-1] if names else ""
    return Suggestion(f"did you mean {either}?" if names else "", name, near)


@lru_cache(maxsize=1 << 14)  # a file with many unknown names compares each with the same known ones
def _words(name: str) -> tuple[str, tuple[str, ...], tuple[str, ...]]:
    """A name's words in lower case: joined by `_`, those that are numbers, and all of them sorted."""
    words = _UNIT.findall(_HUMP.sub("_", name).lower())
    return "_".join(words), tuple(word for word in words if word.isdigit()), tuple(sorted(words))


@lru_cache(maxsize=1 << 14)  # the same slip is often made many times
def _is_a_slip(written: str, meant: str, shortest: int = 0, *, sides: bool = True) -> bool:
    """Whether one letter is missing, extra, replaced or exchanged with the next, or capitals, separators or
    the order of the words differ. A word that is edited has at least `shortest` letters.

    Numbers must agree: `arm_1` and `arm_2` are different names.
    """
    (one, numbers, words), (other, other_numbers, other_words) = _words(written), _words(meant)
    if numbers != other_numbers or not one or written == meant:
        return False
    if words == other_words:
        return one == other or not _order_matters(words)
    return _is_one_edit(one, other, shortest, sides)


def _order_matters(words: tuple[str, ...]) -> bool:
    return not _CONNECTING.isdisjoint(words) or any(pair.issubset(words) for pair in _OPPOSITES)


def _is_one_edit(written: str, meant: str, shortest: int, sides: bool) -> bool:
    if abs(len(written) - len(meant)) > 1:
        return False
    if len(written) > 5 and written[:2] != meant[:2] and written[-2:] != meant[-2:]:
        return False  # one edit leaves the first two letters or the last two: most names end here, quickly
    start = _common(written, meant)
    end = _common(written[start:][::-1], meant[start:][::-1])
    off, right = written[start : len(written) - end], meant[start : len(meant) - end]
    is_swap = len(off) == 2 and off == right[::-1]
    if max(len(off), len(right)) > 1 and not is_swap:
        return False
    if any(c.isdigit() for c in off + right):
        return False
    before = re.split(r"[_\d]", meant[:start])[-1]
    after = re.split(r"[_\d]", meant[len(meant) - end :])[0]
    is_doubled = not right and before.endswith(off)
    is_at_end = not (before and after)
    is_side = sides and off and is_at_end and _SIDES.issuperset(off + right)
    if is_side and not is_swap and not is_doubled:
        return False
    kept = len(before) + len(after)
    if is_swap:  # its letters are all there: one more that stays shows the word
        return kept > 0
    if is_at_end and off and right:
        shortest = _SURE
    return kept >= _KEPT and kept + max(len(off), len(right)) >= shortest


def _common(one: str, other: str) -> int:
    """How many characters two texts begin with alike."""
    both = enumerate(zip(one, other, strict=False))
    return next((i for i, (a, b) in both if a != b), min(len(one), len(other)))
