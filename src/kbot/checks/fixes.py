"""Applying fixes: source edits that leave a file that expands and has fewer findings, or none at all."""

from __future__ import annotations

import difflib
from bisect import bisect_left, insort
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby, islice
from pathlib import Path

from kbot.text import Diagnostic, Edit, Fix
from kbot.text.files import unsaved

Check = Callable[[str], Sequence[Diagnostic]]


def fixed(text: str, path: str, check: Check, unsafe: bool) -> tuple[str, list[Fix]]:
    """The text with its fixes applied, and those that were. `check` gives the findings of a text.

    Fixes that edit another file are left out. All are tried together. If that does not leave a text
    with fewer findings and no new error, each half is tried, and so on down to single fixes. Those that do
    not help are discarded. Findings that a fixed error had hidden do not count against its fix.
    """
    applied: list[Fix] = []
    found = list(check(text))
    portions, tries = _portions(_usable(found, path, unsafe)), _tries(text)
    while tries and (fixes := next(portions, None)):
        tries -= 1
        used, edits = _apart(fixes)
        changed = apply_edits(text, edits)
        after = list(check(changed)) if changed != text else found
        if _are_better(after, found):
            text, found = changed, after  # fewer findings, or fewer errors that hide some: it ends
            applied += used
            portions = _portions(_usable(found, path, unsafe))
    return text, applied


_CHECKED_BYTES = 1_500_000
_FEWEST_TRIES = 8


def _tries(text: str) -> int:
    """How often a text is checked to find which of its fixes help: as often as takes some seconds."""
    return max(_FEWEST_TRIES, _CHECKED_BYTES // (len(text) + 1))


def _portions(fixes: Sequence[Fix]) -> Iterator[Sequence[Fix]]:
    """All fixes, then the halves of them, the quarters, down to each alone."""
    waiting = deque([fixes] if fixes else [])
    while waiting:
        part = waiting.popleft()
        yield part
        if len(part) > 1:
            middle = len(part) // 2
            waiting += (part[:middle], part[middle:])


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
class Mended:
    """What fixes make of the files that one includes, nothing written yet.

    `texts`: each changed file's text before and after. `left_alone`: the files outside the working
    directory that have fixes of their own; they belong to others.
    """

    texts: Mapping[str, tuple[str, str]]
    fixes: tuple[Fix, ...]
    left_alone: tuple[str, ...]


def fixed_includes(path: str, check: Callable[[], Sequence[Diagnostic]], unsafe: bool) -> Mended:
    """The files that `path` includes with their fixes applied. `check` gives the findings of the whole.

    They are tried as those of one file are.
    """
    before: dict[str, str] = {}
    after: dict[str, str] = {}
    applied: list[Fix] = []
    found = check()
    inside, left_alone = _others(found, path, unsafe)
    sources = {fix.edits[0].span.source for fix in inside}
    portions, tries = _portions(inside), _tries("".join(source.text for source in sources))
    while tries and (fixes := next(portions, None)):
        tries -= 1
        used, edits = _apart(fixes)
        changed = dict(after)
        for file, of_file in groupby(edits, lambda edit: edit.span.file):
            own = list(of_file)
            changed[file] = apply_edits(own[0].span.source.text, own)
        with unsaved(changed):
            found_then = check()
        if _are_better(found_then, found):
            for fix in used:
                before.setdefault(fix.edits[0].span.file, fix.edits[0].span.source.text)
            applied += used
            after, found = changed, found_then
            inside, left_alone = _others(found, path, unsafe)
            portions = _portions(inside)
    texts = {name: (before[name], text) for name, text in after.items()}
    return Mended(texts, tuple(applied), left_alone)


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
