"""The nearest valid names to a misspelt one."""

from __future__ import annotations

import re

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable


_ALIKE = 0.6
_WORD, _SWAPPED = 4, 3
"""Letters of a word in which one, or an exchange of two, is surely a slip."""


def nearest(name: str, candidates: Iterable[str], count: int = 3) -> list[str]:
    """Up to `count` candidates that look like `name`, best first."""
    by_lower: dict[str, str] = {}
    for candidate in candidates:
        by_lower.setdefault(candidate.lower(), candidate)
    if not by_lower:
        return []
    from difflib import get_close_matches  # only where something is misspelt: imports add up

    matches = get_close_matches(name.lower(), by_lower, count, _ALIKE)
    return [by_lower[match] for match in matches if _own_words_are_alike(name.lower(), match)]


def _own_words_are_alike(name: str, other: str) -> bool:
    """Whether two names are alike in more than the words that both have, as `_link` and `wheel`."""
    words, other_words = name.split("_"), other.split("_")
    own = "_".join(word for word in words if word not in other_words)
    theirs = "_".join(word for word in other_words if word not in words)
    if own.startswith(theirs) or theirs.startswith(own):  # a word more or less, or cut short
        return True
    from difflib import SequenceMatcher

    return SequenceMatcher(None, own, theirs).ratio() >= _ALIKE


class Suggestion(str):
    """A hint of the names that were perhaps meant, and those names."""

    written: str
    nearest: tuple[str, ...]

    @property
    def sure(self) -> str:
        """The one of them that is a slip away from what was written; empty where that is none or several."""
        slips = [name for name in self.nearest if _is_a_slip(self.written, name)]
        return slips[0] if len(slips) == 1 else ""


def _is_a_slip(written: str, meant: str) -> bool:
    """Whether a letter is missing, too many, another or exchanged with the next, or only capitals differ.

    Not in short words and digits: `l_wheel` and `r_wheel`, `arm_1` and `arm_2` are different names.
    """
    if written.lower() == meant.lower():
        return True
    start = _common(written, meant)
    end = _common(written[start:][::-1], meant[start:][::-1])
    off, right = written[start : len(written) - end], meant[start : len(meant) - end]
    is_swap = len(off) == 2 and off == right[::-1]
    if (max(len(off), len(right)) > 1 and not is_swap) or any(c.isdigit() for c in off + right):
        return False
    before = re.split(r"[\W_\d]", meant[:start])[-1]
    after = re.split(r"[\W_\d]", meant[len(meant) - end :])[0]
    return len(before) + len(after) + max(len(off), len(right)) >= (_SWAPPED if is_swap else _WORD)


def _common(one: str, other: str) -> int:
    """How many characters two texts begin with alike."""
    both = enumerate(zip(one, other, strict=False))
    return next((i for i, (a, b) in both if a != b), min(len(one), len(other)))


def did_you_mean(name: str, candidates: Iterable[str]) -> Suggestion:
    """`did you mean 'a' or 'b'?`, or an empty text when nothing is near."""
    near = nearest(name, candidates)
    names = [f"'{n}'" for n in near]
    either = (", ".join(names[:-1]) + " or " if len(names) > 1 else "") + names[-1] if names else ""
    hint = Suggestion(f"did you mean {either}?" if names else "")
    hint.written, hint.nearest = name, tuple(near)
    return hint
