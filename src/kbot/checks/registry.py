"""What a rule is, and the registry of all rules.

A rule is a function from a context to findings, without side effects. Its docstring is the source of its
page (`kbot rule CODE`): a paragraph that names the fault, then the paragraphs `Why:`, `Example:`, `Fix:` and
`Autofix:`. The page shows the first paragraph under the heading `What:`.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from typing import Literal

from kbot.checks.context import Context
from kbot.extensions import parts
from kbot.text import Diagnostic, Fix, KbotError, Origin, Related, Severity
from kbot.text.suggest import did_you_mean

Needs = Literal["source", "document", "robot", "drive", "below"]


@dataclass(frozen=True, slots=True)
class Finding:
    """What a rule says about one place; the runner adds the rule's code and severity."""

    origin: Origin
    message: str
    hint: str = ""
    related: tuple[Related, ...] = ()
    fix: Fix | None = None
    severity: Severity | None = None


Found = Iterator[Finding]


def reported(faults: Iterable[Diagnostic], code: str) -> Found:
    """The faults of a code that the packages below found, as findings of its rule."""
    for fault in faults:
        if fault.code == code and fault.origin is not None:
            yield Finding(fault.origin, fault.message, fault.hint, fault.related, severity=fault.severity)


Check = Callable[[Context], Iterable[Finding]]


@dataclass(frozen=True, slots=True)
class Rule:
    """A rule's name, code, severity, the version it came with, its page and its function.

    `needs` says what has to be there before it can run. "below" marks the codes that the floors
    below give (files, XML, expansion, the model's reader, launch): they have a page, no function.
    """

    code: str
    name: str
    severity: Severity
    since: str
    needs: Needs
    page: str
    check: Check

    @property
    def summary(self) -> str:
        """The section `What:` of the page, on one line."""
        return self.page.split("\n\n")[0].removeprefix("What: ").replace("\n", " ")

    @property
    def fix(self) -> Literal["safe", "unsafe", "none"]:
        """Whether `kbot check --fix` or `--unsafe-fixes` fixes it, from the `Autofix:` of its page."""
        label = "Autofix:"
        line = next((line for line in self.page.splitlines() if line.startswith(label)), f"{label} none")
        word = line.removeprefix(label).split()[0].strip(".,;:")
        return "safe" if word == "safe" else "unsafe" if word == "unsafe" else "none"

    def diagnostic(self, finding: Finding) -> Diagnostic:
        return Diagnostic(
            self.code,
            finding.severity or self.severity,
            finding.message,
            finding.origin,
            finding.hint,
            finding.related,
            finding.fix,
        )


_RULES: dict[str, Rule] = {}
_FAMILIES = (
    "unused",
    "source",
    "structure",
    "joints",
    "limits",
    "inertia",
    "tensors",
    "magnitudes",
    "geometry",
    "meshes",
    "wheels",
    "motors",
    "contact",
    "stability",
    "controllers",
    "ros2_control",
    "drive_sizes",
    "skid_steer",
    "sensors",
)


def rule(
    code: str, name: str, severity: Severity, needs: Needs, since: str = "0.1"
) -> Callable[[Check], Check]:
    """Register the decorated function as a rule; its docstring is the rule's page."""

    def add(function: Check) -> Check:
        if code in _RULES or any(other.name == name for other in _RULES.values()):
            raise ValueError(f"{code} {name} is registered twice")
        page = "What: " + inspect.cleandoc(function.__doc__ or "")
        _RULES[code] = Rule(code, name, severity, since, needs, page, function)
        return function

    return add


def page(code: str, name: str, text: str, severity: Severity = Severity.ERROR, since: str = "0.1") -> None:
    """Register the page of a code that a floor below gives."""
    nothing: Check = lambda context: ()  # noqa: E731 - as short as what it does
    nothing.__doc__ = text
    rule(code, name, severity, "below", since)(nothing)


@cache
def all_rules() -> dict[str, Rule]:
    """Every rule by code, the families imported on first use."""
    added = (module for part in parts() for module in part.RULE_PAGES)
    families = (f"kbot.checks.rules.{family}" for family in _FAMILIES)
    for module in ("kbot.checks.pages", *added, *families):
        import_module(module)
    return _RULES


@cache
def rules_by_need() -> dict[Needs, tuple[Rule, ...]]:
    """The rules that have a function, by what has to be there before it can run."""
    rules = [rule for rule in all_rules().values() if rule.needs != "below"]
    return {
        needs: tuple(r for r in rules if r.needs == needs) for needs in dict.fromkeys(r.needs for r in rules)
    }


def near_rules(word: str, others: Iterable[str] = ()) -> str:
    """A hint of the code, or the one of `others`, that a misspelled word means.

    A suggestion never changes a number, but that of a code has three digits: a fourth one, and letters that
    look like digits, are slips.
    """
    code = word[:1].upper() + word[1:4].upper().translate(str.maketrans("OIL", "011"))
    return f"did you mean '{code}'?" if code in all_rules() else did_you_mean(word, others)


def find_rule(word: str) -> Rule:
    """A rule by its code or its name.

    Raises:
        KbotError: there is none; it names the nearest.
    """
    rules = all_rules()
    by_name = {r.name: r for r in rules.values()}
    found = rules.get(word.upper()) or by_name.get(word.lower())
    if found is None:
        hint = near_rules(word, by_name)
        raise KbotError(f"there is no rule '{word}'" + (f": {hint}" if hint else ""))
    return found
