"""The few rules that every verb runs, such as missing meshes. `kbot check` runs all rules."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from kbot.checks.config import Config
from kbot.checks.context import Context
from kbot.checks.merge import merge_findings
from kbot.checks.registry import find_rule
from kbot.checks.runner import as_loaded
from kbot.text import Diagnostic, Severity
from kbot.text.diagnostic import one_per_cause
from kbot.xacro import Expansion, Packages

if TYPE_CHECKING:
    from kbot.model import RobotModel
    from kbot.model.load import Loaded

MESHES = ("G101", "G102")
NUMBERS = ("I102", "G107")
CONTROL = ("D129", "D130")
SIZES = ("D105", "D106")


def merged_findings(loaded: Loaded, found: Sequence[Diagnostic]) -> list[Diagnostic]:
    """Findings about a robot from elsewhere, merged as `kbot check` does: a fault in a macro is one
    finding."""
    document = loaded.expansion.document
    if document is None:
        return list(found)
    return merge_findings(found, as_loaded(loaded, document.source, Config()))


def first_look(loaded: Loaded, codes: Sequence[str]) -> list[Diagnostic]:
    """The findings of the rules with these codes.

    A missing mesh or hardware plugin is a warning here, because the rest of the robot is still shown.
    """
    document = loaded.expansion.document
    if loaded.robot is None or document is None:
        return []
    context = as_loaded(loaded, document.source, Config())
    rules = [rule for rule in map(find_rule, codes) if context.has(rule.needs)]
    found = [rule.diagnostic(finding) for rule in rules for finding in rule.check(context)]
    return [
        replace(d, severity=Severity.WARNING) if d.code in (*MESHES, *CONTROL) else d
        for d in one_per_cause(merge_findings(found, context))
    ]


def look_at_robot(robot: RobotModel, codes: Sequence[str]) -> list[Diagnostic]:
    """The findings of the rules with these codes about a robot that was read earlier, without its text."""
    source = robot.origin.span.source
    nothing = Expansion(source.path, None, None, (), ())
    context = Context(source, nothing, robot, (), Packages(), Config(), {})
    rules = [rule for rule in map(find_rule, codes) if context.has(rule.needs)]
    return list(one_per_cause(rule.diagnostic(finding) for rule in rules for finding in rule.check(context)))
