"""Defines what a rule is, and the registry of all rules.

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

from kbot.brief import Brief
from kbot.checks.context import Context
from kbot.checks.former_codes import FORMER_CODES, explained
from kbot.extensions import parts
from kbot.text import Diagnostic, Fix, KbotError, Origin, Related, Severity
from kbot.text.diagnostic import ROS_PREFIX
from kbot.text.notes import note
from kbot.text.suggest import did_you_mean

Needs = Literal["source", "document", "robot", "drive", "below"]


@dataclass(frozen=True, slots=True, repr=False)
class Finding(Brief):
    """What a rule reports about one place. `Rule.diagnostic` adds the rule's code and severity."""

    origin: Origin
    message: str
    hint: str = ""
    related: tuple[Related, ...] = ()
    fix: Fix | None = None
    severity: Severity | None = None
    cause: str = ""


Found = Iterator[Finding]


def reported(faults: Iterable[Diagnostic], code: str) -> Found:
    """Turn the faults of one code that lower packages found into findings of its rule."""
    for fault in faults:
        if fault.code == code and fault.origin is not None:
            yield Finding(fault.origin, fault.message, fault.hint, fault.related, fault.fix, fault.severity)


Check = Callable[[Context], Iterable[Finding]]


@dataclass(frozen=True, slots=True, repr=False)
class Rule(Brief):
    """A rule: its code, name, severity, the version that added it, its page and its function.

    `needs` is what must be available before the rule can run. "below" marks codes that lower packages report
    (files, XML, expansion, the URDF reader, the simulation) and those of launch files. They have a page, but
    no function. `is_ros_only`: KBot accepts what the rule reports, and ROS does not.
    """

    code: str
    name: str
    severity: Severity
    since: str
    needs: Needs
    page: str
    check: Check
    is_ros_only: bool = False

    @property
    def summary(self) -> str:
        """The section `What:` of the page, on one line."""
        return self.page.split("\n\n")[0].removeprefix("What: ").replace("\n", " ")

    @property
    def fix(self) -> Literal["safe", "unsafe", "none"]:
        """Whether `kbot check --fix` or `--unsafe-fixes` can fix it: the first word after `Autofix:`."""
        label = "Autofix:"
        line = next((line for line in self.page.splitlines() if line.startswith(label)), f"{label} none")
        word = line.removeprefix(label).split()[0].strip(".,;:")
        return "safe" if word == "safe" else "unsafe" if word == "unsafe" else "none"

    def diagnostic(self, finding: Finding) -> Diagnostic:
        return Diagnostic(
            self.code,
            finding.severity or self.severity,
            ROS_PREFIX + finding.message if self.is_ros_only else finding.message,
            finding.origin,
            finding.hint,
            finding.related,
            finding.fix,
            finding.cause,
        )

    def _shown(self) -> Iterator[str]:
        yield repr(self.code)
        yield repr(self.name)
        yield repr(str(self.severity))


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
    "lengths",
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
    code: str, name: str, severity: Severity, needs: Needs, since: str = "0.1", *, is_ros_only: bool = False
) -> Callable[[Check], Check]:
    """Register the decorated function as a rule. Its docstring is the source of the rule's page."""

    def add(function: Check) -> Check:
        if code in _RULES or any(other.name == name for other in _RULES.values()):
            raise ValueError(f"{code} {name} is registered twice")
        if code in FORMER_CODES:
            raise ValueError(f"{explained(code)}. A code is never used again")
        page = "What: " + inspect.cleandoc(function.__doc__ or "")
        _RULES[code] = Rule(code, name, severity, since, needs, page, function, is_ros_only)
        return function

    return add


def page(code: str, name: str, text: str, severity: Severity = Severity.ERROR, since: str = "0.1") -> None:
    """Register the page of a code that is reported elsewhere and has no rule function."""
    nothing: Check = lambda context: ()  # noqa: E731 - a def would be longer than its body
    nothing.__doc__ = text
    rule(code, name, severity, "below", since)(nothing)


@cache
def all_rules() -> dict[str, Rule]:
    """All rules by code. The first call imports the modules that define them."""
    added = (module for part in parts() for module in part.RULE_PAGES)
    families = (f"kbot.checks.rules.{family}" for family in _FAMILIES)
    for module in ("kbot.checks.pages", *added, *families):
        import_module(module)
    return _RULES


@cache
def rules_by_need() -> dict[Needs, tuple[Rule, ...]]:
    """The rules that have a function, by what they need."""
    rules = [rule for rule in all_rules().values() if rule.needs != "below"]
    return {
        needs: tuple(r for r in rules if r.needs == needs) for needs in dict.fromkeys(r.needs for r in rules)
    }


def near_rules(word: str, others: Iterable[str] = ()) -> str:
    """A hint with the code, or the entry of `others`, that a misspelled word means.

    `did_you_mean` never changes a number. A code always has three digits, so here a fourth digit, and the
    letters O, I and L in place of digits, count as typos.
    """
    code = word[:1].upper() + word[1:4].upper().translate(str.maketrans("OIL", "011"))
    return f"did you mean '{code}'?" if code in all_rules() else did_you_mean(word, others)


def find_rules(word: str) -> tuple[Rule, ...]:
    """Find a rule by its code or name.

    For a former code or name, return the rules that replaced it, and send a note.

    Raises:
        KbotError: no rule has this code or name, and the message suggests the nearest; or the rule was
            removed.
    """
    rules = all_rules()
    by_name = {r.name: r for r in rules.values()}
    found = rules.get(word.upper()) or by_name.get(word.lower())
    if found is not None:
        return (found,)
    for code, former in FORMER_CODES.items():
        if word.upper() == code or word.lower() == former.name:
            if not former.codes:
                raise KbotError(explained(code))
            note(explained(code))
            return tuple(rules[each] for each in former.codes)
    hint = near_rules(word, by_name)
    raise KbotError(f"unknown rule '{word}'" + (f": {hint}" if hint else ""))


def find_rule(word: str) -> Rule:
    """Find a rule as `find_rules` does. If several rules replaced a former code, return the first."""
    return find_rules(word)[0]
