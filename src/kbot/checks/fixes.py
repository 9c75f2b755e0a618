"""Applying fixes: source edits that leave a file that expands and has fewer findings, or none at all."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Sequence
from pathlib import Path

from kbot.text import Diagnostic, Edit, Fix, write_text

_ROUNDS = 10
Check = Callable[[str], Sequence[Diagnostic]]


def fixed(text: str, path: str, check: Check, unsafe: bool) -> tuple[str, list[Fix]]:
    """The text with its fixes applied, and those that were. `check` gives the findings of a text.

    Fixes that edit another file are left out. All are tried together; where that does not leave a text
    with fewer findings and no new error, one by one, and those that do not help are discarded.
    """
    applied: list[Fix] = []
    found = list(check(text))
    for _ in range(_ROUNDS):
        fixes = _usable(found, path, unsafe)
        if not fixes:
            break
        done = _try(text, found, fixes, check) or _one_by_one(text, found, fixes, check)
        if done is None:
            break
        text, found, used = done
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
    if any(_unread(d) for d in found) and not any(_unread(d) for d in after):
        return changed, after, used  # a file that could not be read hid its other findings
    errors, errors_before = (sum(d.is_error for d in ds) for ds in (after, found))
    if errors > errors_before or len(after) >= len(found):
        return None
    return changed, after, used


def _unread(diagnostic: Diagnostic) -> bool:
    return diagnostic.code.startswith("P") and diagnostic.is_error


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


def fixed_includes(path: str, check: Callable[[], Sequence[Diagnostic]], unsafe: bool) -> list[Fix]:
    """Apply the fixes that edit files which `path` includes; returns those that stay.

    Each file is written, the whole is checked anew, and the file is put back when that does not leave fewer
    findings and no new error. Files outside the working directory are left alone: they belong to others.
    """
    applied: list[Fix] = []
    refused: set[Fix] = set()
    for _ in range(_ROUNDS):
        found = check()
        fixes = [f for f in _others(found, path, unsafe) if f not in refused]
        if not fixes:
            break
        fix = fixes[0]
        source = fix.edits[0].span.source
        write_text(source.path, apply_edits(source.text, fix.edits))
        after = check()
        errors, errors_before = (sum(d.is_error for d in ds) for ds in (after, found))
        if len(after) < len(found) and errors <= errors_before:
            applied.append(fix)
        else:
            write_text(source.path, source.text)
            refused.add(fix)
    return applied


def _others(found: Sequence[Diagnostic], path: str, unsafe: bool) -> list[Fix]:
    """Fixes that edit one file which is not `path` and lies within the working directory."""
    fixes = []
    for diagnostic in found:
        fix = diagnostic.fix
        if fix is None or not (fix.safe or unsafe) or not fix.edits:
            continue
        files = {e.span.file for e in fix.edits}
        if len(files) == 1 and path not in files and Path(files.pop()).absolute().is_relative_to(Path.cwd()):
            fixes.append(fix)
    return list(dict.fromkeys(fixes))


def unified_diff(before: str, after: str, path: str) -> str:
    lines = difflib.unified_diff(
        before.splitlines(keepends=True), after.splitlines(keepends=True), path, path + " (fixed)"
    )
    return "".join(line if line.endswith("\n") else line + "\n" for line in lines)
