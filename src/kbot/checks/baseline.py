"""A baseline lists a robot's known findings, so that only new ones are reported.

A finding matches an entry by its code, file and message, not by its line: editing moves lines. An entry with
a former code matches by the file alone: the rule that replaced the code has other messages.
"""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from kbot.checks.former_codes import FORMER_CODES, former_codes
from kbot.text import Diagnostic, KbotError, write_text
from kbot.text.files import read_text
from kbot.text.json_text import parse_json

_VERSION = 1
_HOW = ": write a new baseline with --write-baseline to another file"
Key = tuple[str, str, str]


def _key(diagnostic: Diagnostic, folder: str) -> Key:
    file = diagnostic.origin.span.file if diagnostic.origin else ""
    if file:
        file = os.path.abspath(file)
        with suppress(ValueError):  # on Windows the file may be on another drive
            file = os.path.relpath(file, folder)
        file = Path(file).as_posix()
    return diagnostic.code, file, diagnostic.message


def write_baseline(path: str, found: Sequence[Diagnostic]) -> None:
    """Write the current findings as a baseline.

    Raises:
        KbotError: the file cannot be written, or exists and is not a baseline. It is then not overwritten.
    """
    if os.path.isfile(path) and os.path.getsize(path):
        _known(path)
    folder = os.path.dirname(os.path.abspath(path))
    counts = Counter(_key(d, folder) for d in found)
    known = [
        {"code": code, "file": file, "message": message, "count": count}
        for (code, file, message), count in sorted(counts.items())
    ]
    write_text(
        path, json.dumps({"version": _VERSION, "findings": known}, indent=2, ensure_ascii=False) + "\n"
    )


def without_known(found: Sequence[Diagnostic], path: str) -> list[Diagnostic]:
    """Return the findings that are not in a baseline.

    Raises:
        KbotError: the file does not exist or is not a baseline.
    """
    known = _known(path)
    folder = os.path.dirname(os.path.abspath(path))
    new = []
    for diagnostic in found:
        code, file, message = _key(diagnostic, folder)
        keys = ((code, file, message), *((former, file, "") for former in former_codes(code)))
        key = next((key for key in keys if known[key] > 0), None)
        if key is None:
            new.append(diagnostic)
        else:
            known[key] -= 1
    return new


def _known(path: str) -> Counter[Key]:
    if not os.path.exists(path):
        raise KbotError(f"the baseline {path} does not exist: create it with --write-baseline")
    text = read_text(path)
    try:
        data = parse_json(text)
        if data["version"] != _VERSION:
            raise KbotError(f"{path} is a baseline of version {data['version']!r:.60}, not {_VERSION}{_HOW}")
        known = Counter[Key]()
        for row in data["findings"]:
            key, number = (row["code"], row["file"], row["message"]), row["count"]
            if not all(isinstance(part, str) for part in key) or type(number) is not int or number < 1:
                raise TypeError
            # the texts of merged rules differ
            known[key if row["code"] not in FORMER_CODES else (*key[:2], "")] += number
        return known
    except (ValueError, KeyError, TypeError):
        raise KbotError(f"{path} is not a baseline of kbot check{_HOW}") from None
