"""Leaves out findings that follow from an error, so that a check reports the cause alone."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from kbot.checks.context import Context
from kbot.checks.registry import all_rules
from kbot.text import Diagnostic, Fix, Severity

_LOSES_PARTS = frozenset(
    {
        "P001", "X114", "X117", "X118", "X120", "X121", "X122", "X123", "X124", "X128", "X129", "X131",
        "X190", "S110", "S115",
    }
)  # fmt: skip
"""Errors after which whole parts of the robot are missing."""
_OF_LOST_PARTS = frozenset({"U003", "U006", "U007", "U008", "U014", "J110", "I106", "G106", "G108"})
"""Links, joints, masses, shapes and materials that are missing: the missing part may have had them."""
_LOSES_JOINTS = frozenset({"U011", "U013", "U014", "U015"})
_OF_LOST_JOINTS = frozenset({"U008"})
"""A joint that cannot be read leaves its child without a parent."""
_OF_UNKNOWN_VALUES = frozenset(
    {"D101", "D102", "D103", "D104", "D105", "D106", "D107", "D108", "D109", "D121", "W134", "G111", "C102"}
)
"""Besides the rules of the drive: names that are not found, sizes and sides of the drive, and positions of
parts. With an error in a value, these rules would check a wrong robot."""
_UNKNOWN_NAMES = frozenset({"X103", "X112", "X121", "X129", "U004", "U005", "U011", "U012", "U015", "U201"})
"""Errors in the content of a tag without its prefix, such as a macro that is copied instead of defined."""
WRONG_UNITS = frozenset({"G113", "J108"})
"""Lengths in millimetres, and angles in degrees: sizes are a thousand times too large, directions random."""
_OF_WRONG_UNITS = frozenset({"G104", "G109", "I107", "I108", "I109", "I110", "I111", "I112", "I113", "I117"})
"""Comparisons of masses and tensors with sizes that are wrong."""
_OF_WRONG_MASSES = frozenset({"D115", "D119"})
"""The stability and the motors of a robot with a mass that no material has (I117)."""
UNUSED = frozenset({"S101", "S102", "S103", "S104"})
"""An unknown name may mean the definition that seems unused, and the author may still be typing."""
_FAMILIES = ("P", "X", "U0")
"""Codes of errors that leave a value or an element unknown."""


def is_cause(diagnostic: Diagnostic) -> bool:
    """Whether a finding is an error that can have consequences: values or parts are unknown."""
    return diagnostic.is_error and (diagnostic.code.startswith(_FAMILIES) or diagnostic.code in _LOSES_PARTS)


def without_consequences(found: Iterable[Diagnostic], context: Context) -> list[Diagnostic]:
    """The findings without those that may follow from an error among them."""
    found = [d for d in found if not _is_of_unprefixed(d, context)]
    found = _with_misspelt_attributes([d for d in found if not _is_of_joint(d, found)])
    errors = {d.code for d in found if d.is_error}
    left_out = set(UNUSED) if errors else set[str]()
    if errors & _LOSES_PARTS:
        left_out |= _OF_LOST_PARTS
    if errors & _LOSES_JOINTS:
        left_out |= _OF_LOST_JOINTS
    if any(is_cause(d) for d in found) or any(d.code in WRONG_UNITS for d in found):
        left_out |= _OF_UNKNOWN_VALUES
        left_out |= {code for code, rule in all_rules().items() if rule.needs == "drive"}
    if any(d.code in WRONG_UNITS for d in found):
        left_out |= _OF_WRONG_UNITS
    if any(d.code == "I117" and d.severity is Severity.WARNING for d in found):
        left_out |= _OF_WRONG_MASSES
    return [d for d in found if d.code not in left_out]


def _with_misspelt_attributes(found: list[Diagnostic]) -> list[Diagnostic]:
    """The findings, with one instead of two for an attribute that is missing because it is misspelt."""
    misspelt = [d for d in found if d.code == "U202" and d.fix is not None]
    fixes, joined = list[Fix | None](), list[Diagnostic]()
    for finding in found:
        cause = None
        if finding.code in {"U013", "U015"}:
            cause = next((d for d in misspelt if _writes_attribute(d, finding)), None)
        if cause is not None:
            fixes.append(cause.fix)
            finding = replace(finding, origin=cause.origin, hint=cause.hint, fix=cause.fix)
        joined.append(finding)
    return [d for d in joined if d.code != "U202" or d.fix not in fixes]


def _writes_attribute(misspelt: Diagnostic, lacking: Diagnostic) -> bool:
    """Whether the fix of a misspelt attribute writes the one that its element lacks, in the same call."""
    if misspelt.fix is None or lacking.origin is None or misspelt.origin is None:
        return False
    if misspelt.origin.stack != lacking.origin.stack:
        return False
    tag, edit = lacking.origin.span, misspelt.fix.edits[0]
    is_in_tag = tag.file == edit.span.file and tag.start <= edit.span.start < tag.end
    attribute = "name" if lacking.code == "U015" else lacking.message.rpartition(" ")[2].strip("'")
    return is_in_tag and edit.replacement == attribute


def _is_of_joint(finding: Diagnostic, found: Iterable[Diagnostic]) -> bool:
    """Whether another finding has the cause: a joint that is defined twice, or whose wheel should turn."""
    if finding.code == "U010":  # the second joint of that name is the child's second parent
        twice = (d.message.removesuffix(" is defined twice") for d in found if d.code == "U005")
        return any(finding.message.endswith(f" by {joint}") for joint in twice)
    if finding.code == "J113":  # its fix would remove the axis that the wheel needs
        joint = finding.message.partition(":")[0]
        return any(d.code == "D117" and d.message.partition(":")[0] == joint for d in found)
    return False


def _is_of_unprefixed(diagnostic: Diagnostic, context: Context) -> bool:
    """Whether a finding is an unknown name that a tag without its prefix should define, or is inside it."""
    if diagnostic.code not in _UNKNOWN_NAMES or diagnostic.origin is None:
        return False
    span = diagnostic.origin.span
    return any(
        f"'{element.attributes.get('name')}'" in diagnostic.message
        or (element.source.path == span.file and element.start <= span.start < element.end)
        for element in context.unprefixed
    )
