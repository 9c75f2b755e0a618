"""Applies fixes. The edited file must expand and have fewer findings, or nothing is written."""

from __future__ import annotations

import difflib
from bisect import bisect_left, insort
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby, islice
from pathlib import Path

from kbot.text import Diagnostic, Edit, Fix
from kbot.text.files import unsaved
from kbot.text.notes import note

Check = Callable[[str], Sequence[Diagnostic]]


def fixed(text: str, path: str, check: Check, unsafe: bool) -> tuple[str, list[Fix], Sequence[Diagnostic]]:
    """The text with its fixes applied, those that were, and the findings left. `check` finds those of a text.

    Fixes that edit another file are left out.
    """
    texts, applied, found = _search(
        {path: text},
        check(text),
        lambda texts: check(texts[path]),
        lambda found: _usable(found, path, unsafe),
    )
    return texts[path], applied, found


_CHECKED_BYTES = 12_000_000
"""Bytes that are checked to find out which fixes help: about 5 s, as a check reads 2 to 4 MB/s (measured with
robots of 13 kB to 400 kB)."""
_BYTES_OF_A_FINDING = 150
"""A finding takes as long as so many bytes: 5,000 in a file of 104 kB add 0.2 s to a check (measured)."""
_FEWEST_TRIES = 17
"""Failing tries in a large file: halving 2**16 fixes takes as many to find the one that does not help."""
_BYTES_IN_ALL = 24_000_000
"""Bytes that are checked in all: about 10 s. A very large file gets fewer tries, or none."""
_OTHER_CHECKS = 3
"""Checks beside the tries: before the fixes, after them for the report, and one for everything else."""


def _search(
    texts: Mapping[str, str],
    found: Sequence[Diagnostic],
    check: Callable[[Mapping[str, str]], Sequence[Diagnostic]],
    usable: Callable[[Sequence[Diagnostic]], Sequence[Fix]],
) -> tuple[Mapping[str, str], list[Fix], Sequence[Diagnostic]]:
    """Some files' texts by path with the fixes that help applied, these fixes, and the findings left, where
    `found` are the findings of the texts as they are.

    All usable fixes are tried together. If that does not leave the texts with fewer findings and no new
    error, each half is tried, and so on down to single fixes. Those that do not help are discarded.
    Findings that a fixed error had hidden do not count against its fix: their own fixes are tried in
    another round. When too many tries failed the search stops with a note.
    """
    applied: list[Fix] = []
    portions = [usable(found)]
    sources = {edit.span.file: edit.span.source for fix in portions[0] for edit in fix.edits}
    size = sum(len(source.text) for source in sources.values()) + _BYTES_OF_A_FINDING * len(found)
    most = max(_FEWEST_TRIES, _CHECKED_BYTES // (size + 1))
    most = min(most, _BYTES_IN_ALL // (size + 1) - _OTHER_CHECKS)
    is_listed = not any(d.code == "K004" for d in found)
    if portions[0] and not (is_listed and most > 0):
        note("no fix is tried: the file is too large or has too many findings; fix some by hand first")
        return texts, [], found
    failed = 0
    while portions[0]:
        before, kept = texts, list[Fix]()
        """Fixes are kept by their places in the texts before this round."""
        failures = set[tuple[Fix, ...]]()
        while portions:
            portion = portions.pop()
            used, edits = _apart([*kept, *portion])
            if len(used) == len(kept):
                continue  # they touch fixes that are kept: the next round has what is left of them
            if tuple(used) not in failures:  # with its left half kept, a right half is the whole again
                if failed >= most:
                    tries = f"stopped after {failed} tries"
                    note(f"{tries}: run `kbot check --fix` again, or fix the rest by hand")
                    return texts, applied + kept, found
                changed = _changed(before, edits)
                after = check(changed) if changed != texts else found
                if _are_better(after, found):
                    texts, found, kept = changed, after, used
                    continue
                failures.add(tuple(used))
                failed += 1
            if len(portion) > 1:
                middle = len(portion) // 2
                portions += (portion[middle:], portion[:middle])
        applied += kept
        portions = [usable(found) if kept else ()]
        failed += bool(kept)  # a round costs a check, even if one follows another without a failure
    return texts, applied, found


def _changed(texts: Mapping[str, str], edits: Sequence[Edit]) -> Mapping[str, str]:
    """The texts with edits applied that lie apart, in order of file and place."""
    changed = dict(texts)
    for file, of_file in groupby(edits, lambda edit: edit.span.file):
        own = list(of_file)
        changed[file] = apply_edits(texts.get(file, own[0].span.source.text), own)
    return changed


def _usable(found: Sequence[Diagnostic], path: str, unsafe: bool) -> list[Fix]:
    fixes = [d.fix for d in found if d.fix and (d.fix.safe or unsafe)]
    own = [f for f in fixes if f.edits and all(e.span.file == path for e in f.edits)]
    return list(dict.fromkeys(own))


def _are_better(after: Sequence[Diagnostic], before: Sequence[Diagnostic]) -> bool:
    """Whether there are fewer findings and no more errors, or fewer of the errors that hide others."""
    hiding, hiding_before = _hiding(after), _hiding(before)
    if hiding != hiding_before:
        return hiding < hiding_before
    errors, errors_before = (sum(d.is_error for d in found) for found in (after, before))
    return len(after) < len(before) and errors <= errors_before


def _hiding(found: Sequence[Diagnostic]) -> tuple[int, ...]:
    """How many errors keep from the rules what comes after: of XML, of expansion, of the model's reader.

    A property without a value (X100) is what the fix of an unknown one leaves: it counts as less.
    """
    codes = [d.code for d in found if d.is_error]
    unvalued = codes.count("X100")
    xml, expansion, reading = (sum(code.startswith(of) for code in codes) for of in ("P", "X", "U0"))
    return xml, expansion - unvalued, unvalued, reading


def _apart(fixes: Sequence[Fix]) -> tuple[list[Fix], list[Edit]]:
    """Fixes whose edits do not touch those of an earlier one, and the edits of all."""
    used: list[Fix] = []
    edits: list[Edit] = []
    """In order of file and place."""
    for fix in fixes:
        if not any(_overlap(edit, near) for edit in fix.edits for near in _near(edit, edits)):
            used.append(fix)
            for edit in fix.edits:
                insort(edits, edit, key=_start)
    return used, edits


def _start(edit: Edit) -> tuple[str, int]:
    return edit.span.file, edit.span.start


def _near(edit: Edit, edits: Sequence[Edit]) -> Iterator[Edit]:
    """Of some edits in order that lie apart, those of its file that may touch an edit."""
    at = max(bisect_left(edits, _start(edit), key=_start) - 1, 0)
    for near in islice(edits, at, None):
        if _start(near) > (edit.span.file, edit.span.end):
            break
        if near.span.file == edit.span.file:
            yield near


def _overlap(a: Edit, b: Edit) -> bool:
    if a.span.start == a.span.end or b.span.start == b.span.end:
        return a.span.start <= b.span.end and b.span.start <= a.span.end
    return a.span.start < b.span.end and b.span.start < a.span.end


def apply_edits(text: str, edits: Sequence[Edit]) -> str:
    """The text with edits that lie apart applied."""
    data, parts, at = text.encode("utf-8", "surrogatepass"), list[bytes](), 0
    for edit in sorted(edits, key=_start):
        parts += (data[at : edit.span.start], edit.replacement.encode())
        at = edit.span.end
    return b"".join([*parts, data[at:]]).decode("utf-8", "surrogatepass")


@dataclass(frozen=True, slots=True)
class FixedIncludes:
    """The fixed texts of the files that a file includes, not written yet.

    `texts`: each changed file's text before and after. `outside`: the files outside the working
    directory that have fixes of their own; they belong to others.
    """

    texts: Mapping[str, tuple[str, str]]
    fixes: tuple[Fix, ...]
    outside: tuple[str, ...]


def fixed_includes(
    path: str, found: Sequence[Diagnostic], check: Callable[[], Sequence[Diagnostic]], unsafe: bool
) -> FixedIncludes:
    """The files that `path` includes with their fixes applied. `found` are the findings of the whole, and
    `check` gives them anew.

    They are tried as those of one file are.
    """

    def check_all(texts: Mapping[str, str]) -> Sequence[Diagnostic]:
        with unsaved(texts):
            return check()

    after, applied, found = _search({}, found, check_all, lambda found: _others(found, path, unsafe)[0])
    before: dict[str, str] = {}
    for fix in applied:
        before.setdefault(fix.edits[0].span.file, fix.edits[0].span.source.text)
    texts = {name: (before[name], text) for name, text in after.items()}
    return FixedIncludes(texts, tuple(applied), _others(found, path, unsafe)[1])


def _others(found: Sequence[Diagnostic], path: str, unsafe: bool) -> tuple[list[Fix], tuple[str, ...]]:
    """Fixes of one file other than `path` within the working directory; the files outside that have some."""
    inside, outside = list[Fix](), list[str]()
    for diagnostic in found:
        fix = diagnostic.fix
        files = {e.span.file for e in fix.edits} if fix and (fix.safe or unsafe) else set()
        if fix is None or len(files) != 1 or path in files:
            continue
        file = files.pop()
        if Path(file).resolve().is_relative_to(Path.cwd()):
            inside.append(fix)
        else:
            outside.append(file)
    return list(dict.fromkeys(inside)), tuple(dict.fromkeys(outside))


def unified_diff(before: str, after: str, path: str) -> str:
    lines = difflib.unified_diff(
        before.splitlines(keepends=True), after.splitlines(keepends=True), path, path + " (fixed)"
    )
    return "".join(line if line.endswith("\n") else line + "\n" for line in lines)
