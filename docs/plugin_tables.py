"""Writes the tables of docs/reference/plugin-settings.md from kinematics/drive/programs.tsv.

Run `python docs/plugin_tables.py` after you change the table or `programs.py`. A test fails if the
page is outdated.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import groupby
from pathlib import Path

from kbot.kinematics.drive.programs import IGNORED, PROGRAMS, SAME, Setting

PAGE = Path(__file__).parent / "reference" / "plugin-settings.md"
BEGIN, END = "<!-- written by docs/plugin_tables.py -->\n", "<!-- end -->\n"
_ANSWERS = {IGNORED: "ignores it", SAME: "no difference"}


def tables() -> str:
    """The settings of each plugin and controller, with headings."""
    parts = []
    for program in PROGRAMS:
        parts.append(f"## {program.title}\n\nSource: {program.source}.\n\n{_rows(program.settings)}")
    return "\n".join(parts)


def _rows(settings: Iterable[Setting]) -> str:
    lines = []
    for (default, kbot, effect), same in groupby(settings, lambda s: (s.default, s.kbot, s.effect)):
        names = ", ".join(f"`{setting.name}`" for setting in same)
        shown = f"`{default}`" if default else ""
        lines.append(f"| {names} | {shown} | {_ANSWERS.get(kbot, 'yes')} | {effect} |\n")
    return "| setting | default | KBot | effect |\n| --- | --- | --- | --- |\n" + "".join(lines)


def with_tables(page: str) -> str:
    """The page with its tables replaced by the current ones."""
    start, end = page.index(BEGIN) + len(BEGIN), page.index(END)
    return f"{page[:start]}\n{tables()}\n{page[end:]}"


if __name__ == "__main__":
    PAGE.write_text(with_tables(PAGE.read_text("utf-8")), "utf-8")
