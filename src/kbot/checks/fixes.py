"""Applying fixes: source edits that leave a file that expands and has fewer findings, or none at all."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from kbot.text import Diagnostic, Edit, Fix
from kbot.text.files import unsaved

Check = Callable[[str], Sequence[Diagnostic]]


def fixed(text: str, path: str, check: Check, unsafe: bool) -> tuple[str, list[Fix]]:
    """The text with its fixes applied, and those that were. `check` gives the findings of a text.

    Fixes that edit another file are left out. All are tried together; where that does not leave a text
    with fewer findings and no new error, one by one, and those that do not help are discarded. Findings
    that a mended error had hidden do not count against its fix.
    """
    applied: list[Fix] = []
    found = list(check(text))
    while fixes := _usable(found, path, unsafe):
        done = _try(text, found, fixes, check) or _one_by_one(text, found, fixes, check)
        if done is None:
            break
        text, found, used = done  # fewer findings, or fewer errors that hide some: it comes to an end
        applied += used
    return text, applied


def _usable(found: Sequence[Diagnostic], path: str, unsafe: bool) -> list[Fix]:
    fixes = [d.fix for d in found if d.fix and (d.fix.safe or unsafe)]
    own = [f for f in fixes if f.edits and all(e.span.file == path for e in f.edits)]
    return list(dict.fromkeys(own))


def _try(
    text: str, found: Sequence[Diagnostic], fixes: Sequence[Fix], check: Check
) -> tuple[str, list[Diagnostic], list[Fix]] | None:
    """The text after these fixes when it is better than before, else None."""
    used, edits = _apart(fixes)
    changed = apply_edits(text, edits)
    after = list(check(changed))
    if changed == text:
        return None
    return (changed, after, used) if _are_better(after, found) else None


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


def _one_by_one(
    text: str, found: list[Diagnostic], fixes: Sequence[Fix], check: Check
) -> tuple[str, list[Diagnostic], list[Fix]] | None:
    if len(fixes) < 2:
        return None
    for fix in fixes:
        done = _try(text, found, [fix], check)
        if done is not None:
            return done
    return None


def _apart(fixes: Sequence[Fix]) -> tuple[list[Fix], list[Edit]]:
    """Fixes whose edits do not touch those of an earlier one, and the edits of all."""
    used: list[Fix] = []
    edits: list[Edit] = []
    for fix in fixes:
        if not any(_overlap(a, b) for a in fix.edits for b in edits):
            used.append(fix)
            edits += fix.edits
    return used, edits


def _overlap(a: Edit, b: Edit) -> bool:
    if a.span.start == a.span.end or b.span.start == b.span.end:
        return a.span.start <= b.span.end and b.span.start <= a.span.end
    return a.span.start < b.span.end and b.span.start < a.span.end


def apply_edits(text: str, edits: Sequence[Edit]) -> str:
    """The text with edits that lie apart applied."""
    data = text.encode("utf-8", "surrogatepass")
    for edit in sorted(edits, key=lambda e: e.span.start, reverse=True):
        data = data[: edit.span.start] + edit.replacement.encode() + data[edit.span.end :]
    return data.decode("utf-8", "surrogatepass")


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

    After each fix the whole is checked anew; one that does not leave fewer findings and no new error
    is discarded.
    """
    before: dict[str, str] = {}
    after: dict[str, str] = {}
    applied: list[Fix] = []
    refused: set[Fix] = set()
    found = check()
    while True:
        inside, left_alone = _others(found, path, unsafe)
        fix = next((f for f in inside if f not in refused), None)
        if fix is None:
            break
        source = fix.edits[0].span.source
        changed = {**after, source.path: apply_edits(source.text, fix.edits)}
        with unsaved(changed):
            found_then = check()
        if _are_better(found_then, found):
            before.setdefault(source.path, source.text)
            applied.append(fix)
            after, found = changed, found_then
        else:
            refused.add(fix)
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
