"""One description under the rules: expansion, reader and rules together, each fault said once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from kbot.checks.config import Config
from kbot.checks.context import Context
from kbot.checks.merge import said_once
from kbot.checks.registry import rules_by_need
from kbot.model.read import read_robot
from kbot.text import Diagnostic, Source, Span
from kbot.xacro import expand_text

if TYPE_CHECKING:
    from kbot.model.load import Loaded
    from kbot.xacro import Packages

_OF_THE_WHOLE = frozenset({"U002", "U003", "X100", "X103", "X112", "X121", "X129"})
"""What a part of a robot does not have itself: name, links, and what the file that includes it defines."""

_LOSES = frozenset(
    {"P001", "X114", "X117", "X118", "X120", "X121", "X122", "X123", "X124", "X128", "X129", "X131", "X190"}
)
"""Errors with which whole parts of a robot are lost."""
_OF_WHAT_IS_LOST = frozenset({"D101", "D102", "D103", "D104", "D121"})
"""Names that nothing has: what was lost may have had them."""


def examine(
    source: Source,
    arguments: Mapping[str, str],
    packages: Packages,
    config: Config,
    properties: Mapping[str, str] | None = None,
) -> Context:
    """Expand and read a description, keeping all that is wrong, ready for the rules."""
    expansion = expand_text(source.text, source.path, arguments, properties=properties, packages=packages)
    problems, robot = list(expansion.diagnostics), None
    if expansion.document is not None:
        reading = read_robot(expansion.document, packages)
        robot = reading.robot
        problems += _not_said_before(problems, reading.diagnostics)
    return Context(source, expansion, robot, tuple(problems), packages, config, arguments)


def as_loaded(loaded: Loaded, source: Source, config: Config) -> Context:
    """What was loaded from a source, ready for the rules."""
    return Context(source, loaded.expansion, loaded.robot, loaded.diagnostics, loaded.packages, config, {})


def findings(context: Context) -> list[Diagnostic]:
    """What the floors below said and what the rules say; the same fault in a macro once.

    Where parts of the robot were lost, how the rest would drive and what it lacks are consequences: left out.
    """
    is_whole = not any(d.is_error and d.code in _LOSES for d in context.problems)
    found = [d for d in context.problems if not (context.is_part and d.code in _OF_THE_WHOLE)]
    for needs, rules in rules_by_need().items():
        for rule in rules if context.has(needs) and (is_whole or needs != "drive") else ():
            if not is_whole and rule.code in _OF_WHAT_IS_LOST:
                continue
            found += [rule.diagnostic(finding) for finding in rule.check(context)]
    return said_once(found, context)


def _not_said_before(said: list[Diagnostic], new: tuple[Diagnostic, ...]) -> list[Diagnostic]:
    """Reader errors, less those about a place that expansion failed at and left as it was written."""
    places = [d.origin.span for d in said if d.is_error and d.origin]
    return [
        d
        for d in new
        if not places
        or not d.origin
        or (
            not (d.code in ("U012", "U013") and ("${" in d.message or "$(" in d.message))
            and not any(_overlap(p, d.origin.span) for p in places)
        )
    ]


def _overlap(a: Span, b: Span) -> bool:
    return a.file == b.file and a.start < b.end and b.start < a.end
