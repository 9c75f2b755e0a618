"""Writes the tables of docs/reference/trials.md from the code: the keys of scenarios, measures, quantities.

Run `python docs/scenario_tables.py` after you change a key, a measure or a docstring. A test compares.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path

from kbot.trials.formats import Entry, ListOf, Record
from kbot.trials.measures import FAMILIES, measures
from kbot.trials.quantities import QUANTITIES
from kbot.trials.schema import ExpectationFormat, FaultFormat, StepFormat, scenario_format

PAGE = Path(__file__).parent / "reference" / "trials.md"
BEGIN, END = "<!-- written by docs/scenario_tables.py -->\n", "<!-- end -->\n"


def tables() -> str:
    """All tables, with their headings."""
    scenario = scenario_format()
    steps, expect = _inner(scenario, "steps"), _inner(scenario, "expect")
    assert isinstance(steps, StepFormat)
    assert isinstance(expect, ExpectationFormat)
    fault = steps.actions["fault"]
    assert isinstance(fault, FaultFormat)
    actions = {name: each for name, each in steps.actions.items() if isinstance(each, Record)}
    robot, program = scenario.entries["robot"].format, _inner(scenario, "programs")
    assert isinstance(robot, Record)
    assert isinstance(program, Record)
    parts = [
        "### Keys\n",
        _keys(scenario.entries),
        "The keys of `robot`. A plain text is the same as `file`.\n",
        _keys(robot.entries),
        "The keys of a step, beside its action:\n",
        _keys(steps.times.entries),
        "The keys of an item of `programs`. A plain text is the same as `file`.\n",
        _keys(program.entries),
        "### Actions\n",
        _records(actions),
        "### Faults\n",
        "`fault` has the key `kind`, the keys of this kind, and `duration` in s, by default until the end.\n",
        _records(fault.kinds),
        "### Expectations\n",
        _records(expect.kinds),
        "### Measures\n",
        "Under the name of a measure, `min` and `max` bound its value. Each of them may be left out.\n",
        "The floor is the smallest difference that counts in [`kbot compare`](compare.md). "
        "The larger of both values applies.\n",
        _measures(),
        "### Quantities\n",
        "`when` and `until` bound these values at any time, with `min` and `max`.\n",
        _rows("quantity", [(each.name, each.unit, each.description) for each in QUANTITIES.values()]),
    ]
    return "\n".join(parts)


def _inner(scenario: Record, key: str) -> object:
    found = scenario.entries[key].format
    assert isinstance(found, ListOf)
    return found.inner


def _keys(entries: Mapping[str, Entry]) -> str:
    rows = [f"| `{name}` | {_default(each)} | {each.description} |\n" for name, each in entries.items()]
    return "| key | default | meaning |\n| --- | --- | --- |\n" + "".join(rows)


def _default(entry: Entry) -> str:
    if entry.is_required:
        return "required"
    shown = entry.schema().get("default")
    return "" if shown is None else f"`{shown:g}`" if isinstance(shown, float) else f"`{str(shown).lower()}`"


def _records(records: Mapping[str, Record]) -> str:
    rows = []
    for name, each in records.items():
        keys = ["a file" if each.short else _key(key, entry) for key, entry in each.entries.items()]
        rows.append(f"| `{name}` | {each.summary} | {'; '.join(keys)} |\n")
    return "| name | meaning | keys |\n| --- | --- | --- |\n" + "".join(rows)


def _key(name: str, entry: Entry) -> str:
    text = f": {entry.description}" if entry.description else ""
    return f"`{name}`{'' if entry.is_required else ' (optional)'}{text}"


def _measures() -> str:
    families = [replace(each.of("NAME"), name=f"{each.name}/NAME") for each in FAMILIES.values()]
    lines = []
    for each in (*measures().values(), *families):
        is_angle = each.unit == "rad"
        floor = f"{math.degrees(each.floor):.2g}°" if is_angle else f"{each.floor:g} {each.unit}".rstrip()
        both = f"{floor} or {100.0 * each.relative:g} %"
        lines.append(f"| `{each.name}` | {each.unit} | {both} | {each.description} |\n")
    return "| measure | unit | floor | meaning |\n| --- | --- | --- | --- |\n" + "".join(lines)


def _rows(what: str, rows: Iterable[tuple[str, str, str]]) -> str:
    lines = [f"| `{name}` | {unit} | {text} |\n" for name, unit, text in rows]
    return f"| {what} | unit | meaning |\n| --- | --- | --- |\n" + "".join(lines)


def with_tables(page: str) -> str:
    """The page with the tables as they are now."""
    start, end = page.index(BEGIN) + len(BEGIN), page.index(END)
    return f"{page[:start]}\n{tables()}\n{page[end:]}"


if __name__ == "__main__":
    PAGE.write_text(with_tables(PAGE.read_text("utf-8")), "utf-8")
