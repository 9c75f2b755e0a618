"""Every text that names a command or an option of KBot names one that exists, for the verbs that print it."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import NamedTuple

import click

import kbot
from kbot.checks import all_rules
from kbot.cli.main import VERBS, group
from kbot.cli.other_tools import instead_of

ROOT = Path(kbot.__file__).parent

OF_OTHER_TOOLS = (
    "pytest_plugin/",  # options of pytest
    "ros/client/arguments.py",  # of ROS 2 nodes
    "ros/launch/node_settings/",  # of the nodes that a launch file starts
    "trials/compare/git.py",  # of git
)
"""Files whose options are not KBot's. `kbot VERB --option` is checked there too."""
OF_ROSBAG = frozenset({"--topics", "--exclude-topics"})
"""Options of `kbot bag play` that take several values, which click does not know."""
OF_XACRO = ("checks/page of L057", "--inorder")
"""A page about an option of the xacro program."""

READS_ROBOTS = (
    "sim",
    "view",
    "check",
    "expand",
    "where",
    "export",
    "info",
    "try",
    "compare",
    "sweep",
    "identify",
)
SHOWS_PAGE = ("sim", "view", "launch")
SIMULATES = ("sim", "launch", "try", "compare", "sweep")
PRINTED_BY: Mapping[str, tuple[str, ...]] = {
    "checks/": ("check",),
    "identify/": ("identify",),
    "kinematics/": READS_ROBOTS,
    "model/": READS_ROBOTS,
    "navigation/": SIMULATES,
    "ros/checks/": ("check", "launch"),
    "ros/launch/": ("check", "launch"),
    "sim/": SIMULATES,
    "sweep/": ("sweep",),
    "templates/": ("new",),
    "trials/": ("try", "sweep"),
    "trials/compare/": ("compare",),
    "workbench/": SHOWS_PAGE,
    "world/": SIMULATES,
    "xacro/": READS_ROBOTS,
    **{f"cli/{verb}.py": (verb,) for verb in VERBS},
    "cli/try_command.py": ("try",),
    "cli/sim/": ("sim",),
    "cli/ros/launch/": ("launch",),
    "cli/bag/": ("bag",),
    **{f"cli/ros/graph/{verb}.py": (verb,) for verb in ("topic", "node", "service", "param", "tf")},
}
"""The verbs that print the texts of a folder or file. The longest entry applies. An option without a verb
must exist for each of them, and in other files for any verb."""
ONLY_IN = {
    ("workbench/session/played_session.py", "--robot"): ("view",),  # it alone opens recordings
    ("trials/scenario_keys.py", "--set"): ("sweep",),  # names come from its option alone
    ("trials/reports/table.py", "--at"): ("view",),  # completes a command of kbot view
    ("workbench/timeline/recording.py", "--record"): ("sim", "launch"),  # kbot view has nothing to record
}

_OPTION = re.compile(r"(?<![\w(-])--[a-z][a-z0-9-]*[a-z0-9]")
"""An option. CSS has names such as `var(--line)`."""
_COMMAND = re.compile(r"(?<![\w./-])kbot ([a-z]+)\b")
_END = re.compile(r"`|\n|\. |; |: |, | and | or |\)|$")
"""Ends the part of a text that belongs to the command before it."""


class Named(NamedTuple):
    """A command in a text: its verb, the lower-case words and the options after it, and where it ends."""

    verb: str
    words: tuple[str, ...]
    options: tuple[str, ...]
    start: int
    end: int


def commands_in(text: str) -> Iterator[Named]:
    for match in _COMMAND.finditer(text):
        end = _END.search(text, match.end())
        assert end is not None
        rest = text[match.end() : end.start()]
        words = tuple(re.findall(r"(?<!\S)[a-z]+(?!\S)", rest.partition("--")[0]))
        yield Named(match[1], words, tuple(_OPTION.findall(rest)), match.start(), end.start())


class Text(NamedTuple):
    """A string of the source. `is_docstring`: only readers of the source see it, except in `cli`."""

    file: str
    line: int
    text: str
    is_docstring: bool

    def __str__(self) -> str:
        return f"{self.file}:{self.line}: {self.text.strip()[:100]!r}"


def literals(path: Path) -> Iterator[Text]:
    """The strings of a file. A value in an f-string becomes a NUL."""
    file, inside, alone = path.relative_to(ROOT).as_posix(), set[ast.AST](), set[ast.AST]()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Expr):
            alone.add(node.value)
        if isinstance(node, ast.JoinedStr):
            inside.update(node.values)
            parts = (part.value if isinstance(part, ast.Constant) else "\0" for part in node.values)
            yield Text(file, node.lineno, "".join(map(str, parts)), False)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and node not in inside:
            yield Text(file, node.lineno, node.value, node in alone and not file.startswith("cli/"))


@cache
def texts() -> tuple[Text, ...]:
    """Every string in the source, and every rule page."""
    pages = (Text(f"checks/page of {rule.code}", 0, rule.page, False) for rule in all_rules().values())
    return (*(text for path in sorted(ROOT.rglob("*.py")) for text in literals(path)), *pages)


def documents() -> Iterator[Text]:
    """The pages of the documentation."""
    root = Path(__file__).parents[2]
    for path in (root / "README.md", *sorted((root / "docs").rglob("*.md"))):
        yield Text(path.relative_to(root).as_posix(), 0, path.read_text("utf-8"), True)


@cache
def options_of(verb: str) -> Mapping[str, frozenset[str]]:
    """The options of a verb (with an empty name) and of each of its subcommands."""
    command = group.get_command(click.Context(group), verb)
    assert command is not None
    every = {"": command, **(command.commands if isinstance(command, click.Group) else {})}
    return {
        name: frozenset(
            {
                "--help",
                *(OF_ROSBAG if name == "play" else ()),
                *(o for p in c.params for o in (*p.opts, *p.secondary_opts)),
            }
        )
        for name, c in every.items()
    }


def has_option(verb: str, option: str) -> bool:
    return any(option in options for options in options_of(verb).values())


def printed_by(file: str) -> tuple[str, ...]:
    entry = max((prefix for prefix in PRINTED_BY if file.startswith(prefix)), key=len, default="")
    return PRINTED_BY.get(entry, ())


def test_commands_in_texts_exist() -> None:
    """`kbot VERB` in backticks, and the subcommand and options after any `kbot VERB`."""
    wrong = list[str]()
    for text in (*texts(), *documents()):
        for named in commands_in(text.text):
            if named.verb not in VERBS:
                # KBot answers the verbs of other tools, such as `kbot roslaunch`
                if text.text[: named.start].endswith("`") and not instead_of([named.verb], VERBS):
                    wrong.append(f"{text}: no verb {named.verb}")
                continue
            options = options_of(named.verb)
            below = options.get(named.words[0] if named.words else "")
            if len(options) > 1 and below is None and named.options:
                wrong.append(f"{text}: no subcommand {named.words[0]}")
            known = below if below is not None else options[""]
            wrong += [f"{text}: kbot {named.verb} has no {o}" for o in named.options if o not in known]
    assert wrong == []


def test_options_without_a_verb_exist_for_every_verb_that_prints_them() -> None:
    wrong = list[str]()
    for text in texts():
        if (
            text.is_docstring
            or text.file.startswith(OF_OTHER_TOOLS)
            or not re.search(r"\s", text.text.strip())
        ):
            continue
        of_commands = [(named.start, named.end) for named in commands_in(text.text) if named.verb in VERBS]
        for match in _OPTION.finditer(text.text):
            option = match[0]
            if (
                any(start <= match.start() < end for start, end in of_commands)
                or (text.file, option) == OF_XACRO
            ):
                continue
            verbs = ONLY_IN.get((text.file, option)) or printed_by(text.file)
            if not verbs and not any(has_option(verb, option) for verb in VERBS):
                wrong.append(f"{text}: no verb has {option}")
            wrong += [
                f"{text}: kbot {verb} has no {option}" for verb in verbs if not has_option(verb, option)
            ]
    assert wrong == []
