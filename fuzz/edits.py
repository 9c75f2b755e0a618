"""Edits valid files for fuzzing: an edited valid file reaches deeper code than random bytes."""

import os
import re
from collections.abc import Callable, Sequence
from pathlib import Path

from choices import Choices

ROOT = Path(__file__).parents[1]
SHARED = Path(os.environ.get("KBOT_SHARED") or ROOT.parent / "shared")
FOLDERS = [ROOT / name for name in ("src/kbot", "tests", "examples", "docs/tutorial")]
LARGEST_SEED = 20_000
"""Bytes. A larger file takes longer, and does not reach more code."""
NUMBER = re.compile(rb"-?\d+\.?\d*(?:[eE][-+]?\d+)?")
HOSTILE = [
    b"0", b"-1", b"1e308", b"-1e308", b"1e400", b"nan", b"inf", b"1e-320", b"1" + b"0" * 400,
    b"1" + b"0" * 5000, b"4294967296", b"-2147483649", b"0x" + b"f" * 300, b"", b"1:1", b"true", b"[]", b"{}",
    b"null", b"''",
]  # fmt: skip


def real_files(*endings: str, is_wanted: Callable[[bytes], bool] = lambda data: True) -> list[bytes]:
    """Different files with these endings from the project and from the reference data, if it is there."""
    found: dict[bytes, None] = {}
    for folder in (*FOLDERS, SHARED):
        for path in sorted(folder.rglob("*")):
            if path.name.endswith(endings) and path.is_file() and path.stat().st_size <= LARGEST_SEED:
                data = path.read_bytes()
                if is_wanted(data):
                    found[data] = None
    return list(found)


def edited(choices: Choices, seeds: Sequence[bytes], words: Sequence[bytes] = ()) -> bytes:
    """A seed after up to six edits. `words` are pieces of the format that may be inserted anywhere."""
    data = choices.pick(seeds)
    for _ in range(choices.integer(0, 6)):
        at = choices.integer(0, len(data))
        match choices.integer(0, 6):
            case 0:
                data = data[:at] + choices.raw(choices.integer(1, 8)) + data[at:]
            case 1:
                data = data[:at] + data[at + choices.integer(1, 60) :]
            case 2 if words:
                data = data[:at] + choices.pick(words) + data[at:]
            case 3:
                end = at + choices.integer(1, 200)
                data = data[:end] + data[at:end] * choices.integer(1, 8) + data[end:]
            case 4:
                found = [m.span() for m in NUMBER.finditer(data)]
                if found:
                    start, end = choices.pick(found)
                    data = data[:start] + choices.pick(HOSTILE) + data[end:]
            case 5:
                other = choices.pick(seeds)
                start = choices.integer(0, len(other))
                data = data[:at] + other[start : start + choices.integer(1, 200)] + data[at:]
            case _:
                bits = bytearray(data)
                if at < len(bits):
                    bits[at] ^= choices.integer(1, 255)
                data = bytes(bits)
    return data
