"""Edits valid files for fuzzing: an edited valid file reaches deeper code than random bytes."""

# ruff: noqa: E501 - seeds are files in the style of other programs

import re

import atheris

NUMBER = re.compile(rb"-?\d+\.?\d*(?:[eE][-+]?\d+)?")
HOSTILE = [
    b"0", b"-1", b"1e308", b"-1e308", b"1e400", b"nan", b"inf", b"1e-320", b"1" + b"0" * 400, b"1" + b"0" * 5000,
    b"4294967296", b"-2147483649", b"0x" + b"f" * 300, b"", b"1:1", b"true", b"[]", b"{}", b"null", b"''",
]  # fmt: skip


def edited(provider: atheris.FuzzedDataProvider, seed: bytes, words: list[bytes]) -> bytes:
    """The seed after up to six edits. `words` are pieces of the format that may be inserted anywhere."""
    data = seed
    for _ in range(provider.ConsumeIntInRange(0, 6)):
        at = provider.ConsumeIntInRange(0, len(data))
        match provider.ConsumeIntInRange(0, 5):
            case 0:
                data = data[:at] + provider.ConsumeBytes(provider.ConsumeIntInRange(1, 8)) + data[at:]
            case 1:
                data = data[:at] + data[at + provider.ConsumeIntInRange(1, 60) :]
            case 2 if words:
                data = data[:at] + words[provider.ConsumeIntInRange(0, len(words) - 1)] + data[at:]
            case 3:
                end = at + provider.ConsumeIntInRange(1, 200)
                data = data[:end] + data[at:end] * provider.ConsumeIntInRange(1, 8) + data[end:]
            case 4:
                found = [m.span() for m in NUMBER.finditer(data)]
                if found:
                    start, end = found[provider.ConsumeIntInRange(0, len(found) - 1)]
                    hostile = HOSTILE[provider.ConsumeIntInRange(0, len(HOSTILE) - 1)]
                    data = data[:start] + hostile + data[end:]
            case _:
                bits = bytearray(data)
                if at < len(bits):
                    bits[at] ^= provider.ConsumeIntInRange(1, 255)
                data = bytes(bits)
    return data
