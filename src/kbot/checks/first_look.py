"""The few findings that every verb reports, such as missing meshes. `kbot check` reports all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from kbot.checks.config import Config
from kbot.checks.merge import said_once
from kbot.checks.registry import find_rule
from kbot.checks.runner import as_loaded
from kbot.text import Diagnostic, Severity

if TYPE_CHECKING:
    from kbot.model.load import Loaded

MESHES = ("G101", "G102")
NUMBERS = ("I102", "G107")
CONTROL = ("D129", "D130")
SIZES = ("D105", "D106")


def folded(loaded: Loaded, found: Sequence[Diagnostic]) -> list[Diagnostic]:
    """What was found of a robot elsewhere, as `kbot check` has it: a fault in a macro is said once."""
    document = loaded.expansion.document
    if document is None:
        return list(found)
    return said_once(found, as_loaded(loaded, document.source, Config()))


def first_look(loaded: Loaded, codes: Sequence[str]) -> list[Diagnostic]:
    """What the rules of these codes say of a robot; of a missing mesh or hardware as a warning, for the rest
    is shown."""
    document = loaded.expansion.document
    if loaded.robot is None or document is None:
        return []
    context = as_loaded(loaded, document.source, Config())
    rules = [rule for rule in map(find_rule, codes) if context.has(rule.needs)]
    found = [rule.diagnostic(finding) for rule in rules for finding in rule.check(context)]
    return [
        replace(d, severity=Severity.WARNING) if d.code in (*MESHES, *CONTROL) else d
        for d in said_once(found, context)
    ]
