"""Reads pages of the docs: their sections, blocks of code, and commands with their output."""

import re
import shlex
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
ELLIPSIS = "…"
"""Stands for any number of lines of a page's output or, within a line, for any text."""


@dataclass(frozen=True)
class Command:
    """A command of a `console` block: its words, of which the first is `kbot` or `cd`, and its output."""

    words: tuple[str, ...]
    output: tuple[str, ...]


def sections(page: str) -> dict[str, str]:
    """The text below each heading of the second level, by heading."""
    parts = re.split(r"^## (.*)\n", (DOCS / page).read_text("utf-8"), flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def blocks(text: str, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)


def commands(text: str) -> list[Command]:
    """The commands in the `console` blocks of a text, in order."""
    found = []
    for block in blocks(text, "console"):
        for run in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]:
            line, *output = run.splitlines()
            found.append(Command(tuple(shlex.split(line)), tuple(output)))
    return found


def matches(expected: tuple[str, ...], printed: str) -> bool:
    """Whether a command printed the expected lines, up to what `ELLIPSIS` stands for."""
    pattern = "".join(
        r"(?:.*\n)*?"
        if line.strip() == ELLIPSIS
        else ".*".join(map(re.escape, line.rstrip().split(ELLIPSIS))) + r"[ ]*\n"
        for line in expected
    )
    return re.fullmatch(pattern, printed) is not None


def programs(text: str) -> list[str]:
    """The blocks in Python, without the indentation of the list that they are in."""
    found = re.findall(r"^( *)```python\n(.*?)^ *```$", text, re.DOTALL | re.MULTILINE)
    return [re.sub(f"^{indent}", "", block, flags=re.MULTILINE) for indent, block in found]
