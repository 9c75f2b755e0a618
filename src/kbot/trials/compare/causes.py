"""Finds the edits that change a robot's behaviour, by trying groups of edits and halving them.

The method is ddmin (A. Zeller and R. Hildebrandt, "Simplifying and isolating failure-inducing input", IEEE
Transactions on Software Engineering 28(2), 2002). A group of edits passes, fails, or is unresolved: some
edits do not make a valid description without others, such as the new name of a property without its uses.

First, models are compared, which takes milliseconds: `relevant_changes` finds the edits without which A does
not behave like B. Then simulations decide which measures each of them changes: `explain`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from typing import TypeVar

from kbot.trials.compare.declarations import DeclaredDifference
from kbot.trials.compare.edits import Edit, Edits
from kbot.trials.compare.significance import Difference

T = TypeVar("T", bound=Hashable)
Effect = Difference | DeclaredDifference
EffectKey = tuple[str, str]
"""A scenario and its measure, or a part and its setting."""

_MOST_LINES = 24
"""Lines of which each pair is tried together. Each trial expands the description, in milliseconds."""


_MOST_TRIES = 200
"""Groups of edits that are tried, at 0.05 s for KBot's description. The edits that are left stay together."""
_MOST_CHANGES = 12
"""Changes that are simulated alone, at a few seconds each. Of more, neighbours are simulated together."""


@dataclass(frozen=True, slots=True)
class Change:
    """Edits that are tried together: those in one line, and those that are only valid together."""

    edits: tuple[Edit, ...]

    @property
    def lines(self) -> tuple[Edit, ...]:
        """The first edit of each line, in the order of files and lines."""
        return tuple({(edit.key, edit.line): edit for edit in reversed(self.edits)}.values())[::-1]


@dataclass(frozen=True, slots=True)
class Cause:
    """Changes that affect measures or settings: one, or several that do so only together
    (`is_interaction`)."""

    changes: tuple[Change, ...]
    effects: Mapping[EffectKey, Effect]

    @property
    def is_interaction(self) -> bool:
        return len(self.changes) > 1

    @property
    def size(self) -> float:
        """The size of the largest effect."""
        return max(effect.size for effect in self.effects.values())


EffectsOf = Callable[[frozenset[Edit]], Mapping[EffectKey, Effect]]
"""Simulates A with some edits, and returns the effect on each measure and setting. The result must not
depend on the order of calls."""


def relevant_changes(edits: Edits) -> tuple[Change, ...]:
    """The fewest changes with which A behaves like B, in the order of files and lines. Nothing is simulated.

    If A with all edits does not behave like B, `edits.whole` is the only change. This happens if a pattern of
    an include matches a file that only B has. If very many edits are needed, for example between different
    robots, neighbouring ones are one change, and some of them may not be needed.
    """
    if edits.behaves_like_after(()):
        return ()
    if not edits.behaves_like_after(edits.all):
        return (Change((edits.whole,)),)
    needed = minimal(_without_replacements(edits, edits.all), edits.behaves_like_after, _MOST_TRIES)
    if len(needed) > _MOST_TRIES:
        return (Change(needed),)
    needed = _without_renamings(edits, needed)
    needed = _without_moves(edits, needed)
    return _grouped(_joined(edits, needed))


def explain(changes: Sequence[Change], effects_of: EffectsOf) -> tuple[Cause, ...]:
    """Which changes cause which significant effects, the strongest first.

    Each change is tried alone. For an effect that none of them has alone, the smallest group that has it is
    searched by halving. `effects_of` is called once for each group; the first call has all changes.
    """
    known: dict[frozenset[Edit], Mapping[EffectKey, Effect]] = {}

    def effects(group: Iterable[Change]) -> Mapping[EffectKey, Effect]:
        chosen = frozenset(edit for change in group for edit in change.edits)
        if chosen not in known:
            known[chosen] = {name: e for name, e in effects_of(chosen).items() if e.is_significant}
        return known[chosen]

    def has_effect(name: EffectKey, group: Iterable[Change]) -> bool:
        return name in effects(group)

    every = effects(changes)
    found: dict[tuple[Change, ...], dict[EffectKey, Effect]] = {}
    for change in changes if every else ():
        alone = effects((change,))
        if alone:
            found[change,] = dict(alone)
    for name in sorted(every, key=lambda name: -every[name].size):
        if not any(name in own for own in found.values()):
            group = minimal(changes, partial(has_effect, name))
            found.setdefault(group, {})[name] = effects(group)[name]
    return tuple(sorted((Cause(*item) for item in found.items()), key=lambda cause: -cause.size))


def _grouped(changes: Sequence[Change]) -> tuple[Change, ...]:
    """At most `_MOST_CHANGES` changes, of neighbours."""
    size = -(-len(changes) // _MOST_CHANGES)
    groups = [changes[at : at + size] for at in range(0, len(changes), size)]
    return tuple(Change(tuple(edit for change in group for edit in change.edits)) for group in groups)


def minimal(
    items: Sequence[T], fails: Callable[[Sequence[T]], bool], most_tries: float = math.inf
) -> tuple[T, ...]:
    """A subset for which `fails` is true, and which is 1-minimal: it is false, or unresolved, without any one
    of the items. `fails` must be true for all items. After about `most_tries` calls, the result is the
    smallest subset so far."""
    left, parts = tuple(items), 2
    tries = 0
    while len(left) >= 2 and tries < most_tries:
        tries += parts
        size = -(-len(left) // parts)
        chunks = [left[at : at + size] for at in range(0, len(left), size)]
        rest = next((chunk for chunk in chunks if fails(chunk)), None) if parts == 2 else None
        if rest is not None:
            left, parts = rest, 2
            continue
        for chunk in chunks:
            rest = tuple(item for item in left if item not in chunk)
            if fails(rest):
                left, parts = rest, max(parts - 1, 2)
                break
        else:
            if size == 1:
                break
            parts = min(len(left), parts * 2)
    return left


def _without_replacements(edits: Edits, needed: Sequence[Edit]) -> tuple[Edit, ...]:
    """Without edits that replace the same word by the same other one, if they are harmless together: a name
    that is new everywhere."""
    alike: dict[tuple[str, str], list[Edit]] = {}
    for edit in needed:
        alike.setdefault(edit.words, []).append(edit)
    left = tuple(needed)
    for group in alike.values():
        if 1 < len(group) < len(left) and edits.behaves_like_after(_without(left, group)):
            left = _without(left, group)
    return left


def _without_renamings(edits: Edits, needed: Sequence[Edit]) -> tuple[Edit, ...]:
    """Without edits that are harmless, but only together: a new name with all its uses."""
    left = tuple(needed)
    for edit in needed:
        others = _without(left, (edit,))
        if edit in left and not edits.is_valid(others):
            rest = _fewest_removed(edits, others)
            # a use may be in a line that was also moved, so that another line belongs to it
            shorter = (rest, *(_without(rest, line) for line in _by_line(rest)))
            left = next(filter(edits.behaves_like_after, shorter), left)
    return left


def _fewest_removed(edits: Edits, invalid: Sequence[Edit]) -> tuple[Edit, ...]:
    """As many of some edits as are valid together."""
    removed = minimal(invalid, lambda some: edits.is_valid(_without(invalid, some)))
    return _without(invalid, removed)


def _without_moves(edits: Edits, needed: Sequence[Edit]) -> tuple[Edit, ...]:
    """Without lines that are harmless together: elements and attributes in another order. These are pairs of
    lines, and lines in a row."""
    lines = _by_line(needed)
    if len(lines) > _MOST_LINES:
        return tuple(needed)
    rows = (lines[at : at + size] for size in range(1, len(lines)) for at in range(len(lines) - size + 1))
    left = tuple(needed)
    for group in (*combinations(lines, 2), *rows):
        moved = [edit for line in group for edit in line]
        if all(edit in left for edit in moved) and edits.behaves_like_after(_without(left, moved)):
            left = _without(left, moved)
    return left


def _by_line(edits: Sequence[Edit]) -> list[tuple[Edit, ...]]:
    """The edits of each line of B."""
    lines: dict[object, list[Edit]] = {}
    for edit in edits:
        lines.setdefault((edit.key, edit.line), []).append(edit)
    return [tuple(line) for line in lines.values()]


def _joined(edits: Edits, needed: Sequence[Edit]) -> tuple[Change, ...]:
    """The edits in groups: those in one line, and each edit that is not valid alone with those that it
    needs."""
    groups: list[set[Edit]] = []

    def join(group: Iterable[Edit]) -> None:
        joined = set(group)
        for other in [other for other in groups if other & joined]:
            joined |= other
            groups.remove(other)
        groups.append(joined)

    for line in _by_line(needed):
        join(line)
    for group in list(groups):
        if not edits.is_valid(group):
            join((*group, *_needed_by(edits, group, _without(needed, group))))
    ordered = [Change(tuple(edit for edit in needed if edit in group)) for group in groups]
    return tuple(sorted(ordered, key=lambda change: needed.index(change.edits[0])))


def _needed_by(edits: Edits, group: Iterable[Edit], others: Sequence[Edit]) -> tuple[Edit, ...]:
    """The fewest other edits with which a group is valid."""
    return minimal(others, lambda some: edits.is_valid((*group, *some)))


def _without(edits: Sequence[Edit], removed: Iterable[Edit]) -> tuple[Edit, ...]:
    gone = set(removed)
    return tuple(edit for edit in edits if edit not in gone)
