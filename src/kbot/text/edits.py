"""Applies edits to texts, and shows changed texts as a diff."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping, Sequence

from kbot.text.diagnostic import Edit


def apply_edits(text: str, edits: Sequence[Edit]) -> str:
    """Apply edits that do not overlap."""
    data, parts, at = text.encode("utf-8", "surrogatepass"), list[bytes](), 0
    for edit in sorted(edits, key=start_of):
        parts += (data[at : edit.span.start], edit.replacement.encode())
        at = edit.span.end
    return b"".join([*parts, data[at:]]).decode("utf-8", "surrogatepass")


def edited_texts(edits: Iterable[Edit]) -> Mapping[str, tuple[str, str]]:
    """The texts of the edited files before and after edits that do not overlap, by path, for `rewrite`."""
    by_file: dict[str, list[Edit]] = {}
    for edit in edits:
        by_file.setdefault(edit.span.file, []).append(edit)
    return {
        file: (text := of_file[0].span.source.text, apply_edits(text, of_file))
        for file, of_file in by_file.items()
    }


def start_of(edit: Edit) -> tuple[str, int]:
    return edit.span.file, edit.span.start


def unified_diff(before: str, after: str, path: str, changed_path: str = "") -> str:
    """The difference of two texts. The second one is named `changed_path`, by default as fixed."""
    lines = difflib.unified_diff(
        before.splitlines(keepends=True),
        after.splitlines(keepends=True),
        path,
        changed_path or f"{path} (fixed)",
    )
    return "".join(line if line.endswith("\n") else line + "\n" for line in lines)
