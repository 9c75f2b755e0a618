"""Applies fixes. A fix is kept only if the edited file has fewer findings and no new error."""

from __future__ import annotations

from bisect import bisect_left, insort
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby, islice
from pathlib import Path

from kbot.checks.consequences import UNUSED, WRONG_UNITS, is_cause
from kbot.text import Diagnostic, Edit, Fix
from kbot.text.edits import apply_edits, start_of
from kbot.text.files import unsaved
from kbot.text.notes import note

Check = Callable[[str], Sequence[Diagnostic]]


def fixed(text: str, path: str, check: Check, unsafe: bool) -> tuple[str, list[Fix], Sequence[Diagnostic]]:
    """Apply the fixes of one file: return the new text, the applied fixes and the remaining findings.

    `check` returns the findings of a text. Fixes that edit another file are not applied.
    """
    texts, applied, found = _search(
        {path: text},
        check(text),
        lambda texts: check(texts[path]),
        lambda found: _usable(found, path, unsafe),
    )
    return texts[path], applied, found


_CHECKED_BYTES = 12_000_000
"""Bytes that may be checked to find out which fixes help: about 5 s, because a check reads 2 to 4 MB/s
(measured with robots of 13 kB to 400 kB)."""
_BYTES_OF_A_FINDING = 150
"""A finding takes as long as this many bytes: 5,000 in a file of 104 kB add 0.2 s to a check (measured)."""
_FEWEST_TRIES = 17
"""Failed tries that are allowed even in a large file: halving 2**16 fixes takes this many tries to find the
one that does not help."""
_BYTES_IN_ALL = 24_000_000
"""Bytes that may be checked in total: about 10 s. A very large file gets fewer tries, or none."""
_OTHER_CHECKS = 3
"""Checks besides the tries: one before the fixes, one after them for the report, and one for everything
else."""


def _search(
    texts: Mapping[str, str],
    found: Sequence[Diagnostic],
    check: Callable[[Mapping[str, str]], Sequence[Diagnostic]],
    usable: Callable[[Sequence[Diagnostic]], Sequence[Fix]],
) -> tuple[Mapping[str, str], list[Fix], Sequence[Diagnostic]]:
    """Apply the fixes that help: return the new texts by path, these fixes and the remaining findings.

    `found` are the findings of the unchanged texts.

    The search tries all usable fixes together. If the texts then do not have fewer findings, or have a new
    error, it tries each half, and so on down to single fixes. Fixes that do not help are discarded. Findings
    that a fixed error had hidden do not count against its fix: their own fixes are tried in another round.
    After too many failed tries the search stops with a note.
    """
    applied: list[Fix] = []
    portions = [usable(found)]
    sources = {edit.span.file: edit.span.source for fix in portions[0] for edit in fix.edits}
    size = sum(len(source.text) for source in sources.values()) + _BYTES_OF_A_FINDING * len(found)
    most = max(_FEWEST_TRIES, _CHECKED_BYTES // (size + 1))
    most = min(most, _BYTES_IN_ALL // (size + 1) - _OTHER_CHECKS)
    is_listed = not any(d.code == "K004" for d in found)
    if portions[0] and not (is_listed and most > 0):
        note("no fix is tried: the file is too large or has too many findings. Fix some by hand first.")
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
                continue  # they overlap kept fixes: the next round tries those that still apply
            # if the left half was kept, adding the right half gives the whole again
            if tuple(used) not in failures:
                if failed >= most:
                    tries = f"stopped after {failed} tries"
                    note(f"{tries}: run `kbot check --fix` again, or fix the rest by hand.")
                    return texts, applied + kept, found
                changed = _changed(before, edits)
                after = check(changed) if changed != texts else found
                if _is_better(after, found):
                    texts, found, kept = changed, after, used
                    continue
                failures.add(tuple(used))
                failed += 1
            if len(portion) > 1:
                middle = len(portion) // 2
                portions += (portion[middle:], portion[:middle])
        applied += kept
        portions = [usable(found) if kept else ()]
        failed += bool(kept)  # each round costs a check, even without a failure
    return texts, applied, found


def _changed(texts: Mapping[str, str], edits: Sequence[Edit]) -> Mapping[str, str]:
    """Apply edits that do not overlap and are sorted by file and place."""
    changed = dict(texts)
    for file, of_file in groupby(edits, lambda edit: edit.span.file):
        own = list(of_file)
        changed[file] = apply_edits(texts.get(file, own[0].span.source.text), own)
    return changed


def _usable(found: Sequence[Diagnostic], path: str, unsafe: bool) -> list[Fix]:
    fixes = [d.fix for d in found if d.fix and (d.fix.safe or unsafe)]
    own = [f for f in fixes if f.edits and all(e.span.file == path for e in f.edits)]
    return list(dict.fromkeys(own))


def _is_better(after: Sequence[Diagnostic], before: Sequence[Diagnostic]) -> bool:
    """Whether there are fewer findings without more errors, or fewer of the errors that hide others."""
    hiding, hiding_before = _hiding(after), _hiding(before)
    if hiding != hiding_before:
        return hiding < hiding_before
    errors, errors_before = (sum(d.is_error for d in found) for found in (after, before))
    if errors_before:  # unused definitions are reported only without errors
        after, before = ([d for d in found if d.code not in UNUSED] for found in (after, before))
    return len(after) < len(before) and errors <= errors_before


def _hiding(found: Sequence[Diagnostic]) -> tuple[int, ...]:
    """The numbers of findings that keep others from being reported: errors of XML, of expansion, of the URDF
    reader, and lengths in millimetres."""
    codes = [d.code for d in found if is_cause(d)]
    xml, expansion, reading = (sum(code.startswith(of) for code in codes) for of in ("P", ("X", "S"), "U0"))
    units = sum(d.code in WRONG_UNITS for d in found)
    return xml, expansion, reading, units


def _apart(fixes: Sequence[Fix]) -> tuple[list[Fix], list[Edit]]:
    """The fixes whose edits do not overlap those of an earlier fix, and all their edits."""
    used: list[Fix] = []
    edits: list[Edit] = []
    """Sorted by file and place."""
    for fix in fixes:
        if not any(_overlap(edit, near) for edit in fix.edits for near in _near(edit, edits)):
            used.append(fix)
            for edit in fix.edits:
                insort(edits, edit, key=start_of)
    return used, edits


def _near(edit: Edit, edits: Sequence[Edit]) -> Iterator[Edit]:
    """The edits of the same file that may overlap an edit. `edits` are sorted and do not overlap."""
    at = max(bisect_left(edits, start_of(edit), key=start_of) - 1, 0)
    for near in islice(edits, at, None):
        if start_of(near) > (edit.span.file, edit.span.end):
            break
        if near.span.file == edit.span.file:
            yield near


def _overlap(a: Edit, b: Edit) -> bool:
    if a.span.start == a.span.end or b.span.start == b.span.end:
        return a.span.start <= b.span.end and b.span.start <= a.span.end
    return a.span.start < b.span.end and b.span.start < a.span.end


@dataclass(frozen=True, slots=True)
class FixedIncludes:
    """The fixed texts of the files that a file includes. They are not written yet.

    `texts`: each changed file's text before and after. `outside`: files outside the working directory that
    have fixes. They are not changed, because they belong to other packages.
    """

    texts: Mapping[str, tuple[str, str]]
    fixes: tuple[Fix, ...]
    outside: tuple[str, ...]


def fixed_includes(
    path: str, found: Sequence[Diagnostic], check: Callable[[], Sequence[Diagnostic]], unsafe: bool
) -> FixedIncludes:
    """Apply the fixes of the files that `path` includes, by the same search as for one file.

    `found` are the findings of `path` with its includes. `check` computes them again.
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
    """The fixes that edit one file other than `path` in the working directory, and the files outside it that
    have fixes."""
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
