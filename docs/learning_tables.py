"""Writes the tables of docs/reference/learning.md from the code: environments, options, inputs, rewards.

Run `python docs/learning_tables.py` after you change an option, a field or a docstring. A test compares.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, fields
from pathlib import Path

from kbot.learn.environments.options import Options
from kbot.learn.environments.randomisation import NONE, Noise, Randomisation
from kbot.learn.environments.registration import ENVIRONMENTS
from kbot.learn.environments.tasks import TASKS
from kbot.learn.environments.tasks.task import COMMON_REWARDS, OUTCOMES, Reward
from kbot.learn.interface.policy_interface import PolicyInterface, Sectors
from kbot.learn.interface.targets import Field

PAGE = Path(__file__).parent / "reference" / "learning.md"
BEGIN, END = "<!-- written by docs/learning_tables.py -->\n", "<!-- end -->\n"
_HEAD = "| option | default | meaning |\n| --- | --- | --- |\n"
_FIELD = re.compile(r"^(\w+)  +(\S.*(?:\n  +.*)*)", re.MULTILINE)
"""A field in a docstring: its name, at least two spaces, and its meaning, also on indented lines."""
_EXAMPLE = {
    "goal": PolicyInterface("goal", (0.0, 0.3), (-2.0, 2.0), (-0.3, 0.3), Sectors(36)),
    "path": PolicyInterface("path", (0.0, 0.3), (-2.0, 2.0)),
}
"""Interfaces with all fields. The speeds are examples."""


def tables() -> str:
    """All tables, with their headings."""
    goal = _EXAMPLE["goal"]
    target = [field for field in goal.inputs if field.name.startswith("goal")]
    rest = [field for field in goal.inputs if field not in target and not field.name.startswith("lidar_")]
    lidar = next(field for field in goal.inputs if field.name == "lidar_0")
    path = [field for field in _EXAMPLE["path"].inputs if field.name.startswith("path")]
    parts = [
        "### Options of all environments\n",
        _options(Options),
        *(
            text
            for name, task in ENVIRONMENTS.items()
            for text in (
                f"### Options of {name}\n",
                _options(TASKS[task]) + _rows(Options, TASKS[task].defaults({"folder": "FOLDER"})),
            )
        ),
        "### Options of `randomise`\n",
        _options(Randomisation),
        "The options of `noise`:\n",
        _HEAD + _rows(Noise, {each.name: NONE for each in fields(Noise)}),
        "### Inputs\n",
        "The speeds are those of a robot that drives at 0.3 m/s and turns at 2 rad/s.\n",
        _fields([*target, *path, *rest, lidar]),
        "### Actions\n",
        _fields(goal.actions),
        "### Rewards\n",
        _rewards({"every environment": COMMON_REWARDS}),
        _rewards({name: TASKS[task].rewards for name, task in ENVIRONMENTS.items()}),
        "### Outcomes\n",
        _outcomes(),
    ]
    return "\n".join(parts)


def _options(kind: type) -> str:
    defaults = {
        each.name: each.default_factory() if each.default is MISSING else each.default  # type: ignore[misc]  # without a default, there is a factory
        for each in fields(kind)
        if each.init
    }
    return _HEAD + _rows(kind, defaults)


def _rows(kind: type, defaults: Mapping[str, object]) -> str:
    """A row for each option of a kind that has a default here."""
    meanings = {name: " ".join(text.split()) for name, text in _FIELD.findall(inspect.getdoc(kind) or "")}
    return "".join(
        f"| `{name}` | {_shown(default)} | {meanings[name]} |\n" for name, default in defaults.items()
    )


def _shown(default: object) -> str:
    return (
        "" if default is None or default in ({}, (), "") or default == Randomisation.noise else f"`{default}`"
    )


def _fields(found: Iterable[Field]) -> str:
    rows = [
        f"| `{each.name}` | {each.unit} | {each.low:g} to {each.high:g} | {each.meaning} |\n"
        for each in found
    ]
    return "| name | unit | bounds | meaning |\n| --- | --- | --- | --- |\n" + "".join(rows)


def _rewards(found: Mapping[str, Mapping[str, Reward]]) -> str:
    rows = [
        f"| {where} | `{name}` | {each.weight:g} | {each.meaning} |\n"
        for where, terms in found.items()
        for name, each in terms.items()
    ]
    return "| environment | term | weight | value |\n| --- | --- | --- | --- |\n" + "".join(rows)


def _outcomes() -> str:
    found = [
        ("every environment", OUTCOMES),
        *((name, TASKS[task].outcomes) for name, task in ENVIRONMENTS.items()),
    ]
    rows = [
        f"| {where} | `{name}` | {meaning} |\n"
        for where, outcomes in found
        for name, meaning in outcomes.items()
    ]
    return "| environment | outcome | meaning |\n| --- | --- | --- |\n" + "".join(rows)


def with_tables(page: str) -> str:
    """The page with the tables as they are now."""
    start, end = page.index(BEGIN) + len(BEGIN), page.index(END)
    return f"{page[:start]}\n{tables()}\n{page[end:]}"


if __name__ == "__main__":
    PAGE.write_text(with_tables(PAGE.read_text("utf-8")), "utf-8")
