"""Leaves out findings that follow from an error, so that a check reports the cause alone."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections import defaultdict
from collections.abc import Callable, Iterable
from dataclasses import replace
from itertools import accumulate

from kbot.checks.context import Context
from kbot.checks.registry import all_rules
from kbot.text import Call, Diagnostic, Element, Fix, Severity

_LOSES_PARTS = frozenset(
    {
        "P001", "X114", "X117", "X118", "X120", "X121", "X122", "X123", "X124", "X128", "X129", "X131",
        "X190", "S110", "S115",
    }
)  # fmt: skip
"""Errors after which whole parts of the robot are missing."""
_OF_LOST_PARTS = frozenset({"U003", "U006", "U007", "U008", "U014", "J110", "I106", "G106", "G108"})
"""Links, joints, masses, shapes and materials that are missing: the missing part may have had them."""
_LOSES_NAMES = frozenset({"X112", "X114"})
_OF_LOST_NAMES = frozenset({"U003", "U004", "U005", "U006"})
"""A missing argument or package: links have no prefix, so that their names are equal or unknown, or are in a
file that is skipped."""
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
    is_of_unprefixed = _of_unprefixed(context.unprefixed)
    found = [d for d in found if not is_of_unprefixed(d)]
    is_of_joint = _of_joints(found)
    found = _with_misspelt_attributes([d for d in found if not is_of_joint(d)])
    errors = {d.code for d in found if d.is_error}
    left_out = set(UNUSED) if errors else set[str]()
    if errors & _LOSES_PARTS:
        left_out |= _OF_LOST_PARTS
    if _LOSES_NAMES & {d.code for d in found}:  # also the warning about a file that is skipped
        left_out |= _OF_LOST_NAMES
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
    misspelt = _Misspelt(d for d in found if d.code == "U202")
    fixes, joined = set[Fix | None](), list[Diagnostic]()
    for finding in found:
        cause = misspelt.cause_of(finding) if finding.code in {"U013", "U015"} else None
        if cause is not None:
            fixes.add(cause.fix)
            finding = replace(finding, origin=cause.origin, hint=cause.hint, fix=cause.fix)
        joined.append(finding)
    return [d for d in joined if d.code != "U202" or d.fix not in fixes]


class _Misspelt:
    """Misspelt attributes, by the file, the call and the name that the fix writes. A broken file may have
    thousands."""

    def __init__(self, found: Iterable[Diagnostic]) -> None:
        self._places = defaultdict[tuple[str, Call | None, str], list[tuple[int, int, Diagnostic]]](list)
        for index, finding in enumerate(found):
            if finding.fix is not None and finding.origin is not None:
                edit = finding.fix.edits[0]
                key = (edit.span.file, finding.origin.call, edit.replacement)
                self._places[key].append((edit.span.start, index, finding))
        for places in self._places.values():
            places.sort(key=_start)

    def cause_of(self, lacking: Diagnostic) -> Diagnostic | None:
        """The first misspelt attribute whose fix writes the one that an element lacks, in the same call."""
        if lacking.origin is None:
            return None
        tag = lacking.origin.span
        attribute = "name" if lacking.code == "U015" else lacking.message.rpartition(" ")[2].strip("'")
        places = self._places.get((tag.file, lacking.origin.call, attribute), [])
        first, end = (bisect_left(places, at, key=_start) for at in (tag.start, tag.end))
        inside = [(index, finding) for _, index, finding in places[first:end]]
        return min(inside, key=lambda place: place[0])[1] if inside else None


def _start(place: tuple[int, int, Diagnostic]) -> int:
    return place[0]


def _of_joints(found: Iterable[Diagnostic]) -> Callable[[Diagnostic], bool]:
    """A test of whether another finding has the cause: a joint that is defined twice, or whose wheel should
    turn."""
    twice = {f" by {d.message.removesuffix(' is defined twice')}" for d in found if d.code == "U005"}
    lengths = {len(end) for end in twice}
    turning = {d.message.partition(":")[0] for d in found if d.code == "D117"}

    def is_of_joint(finding: Diagnostic) -> bool:
        if finding.code == "U010":  # the second joint of that name is the child's second parent
            return any(finding.message[-length:] in twice for length in lengths)
        # the fix of J113 would remove the axis that the wheel needs
        return finding.code == "J113" and finding.message.partition(":")[0] in turning

    return is_of_joint


def _of_unprefixed(unprefixed: Iterable[Element]) -> Callable[[Diagnostic], bool]:
    """A test of whether a finding is an unknown name that a tag without its prefix should define, or is in
    its content."""
    names = {f"'{element.attributes.get('name')}'" for element in unprefixed}
    lengths = {len(name) for name in names}
    places = defaultdict[str, list[tuple[int, int]]](list)
    for element in unprefixed:
        places[element.source.path].append((element.start, element.end))
    # by file, in order: where the tags start, and the furthest end of all tags up to there
    starts, ends = dict[str, list[int]](), dict[str, list[int]]()
    for file, spans in places.items():
        spans.sort()
        starts[file] = [start for start, _ in spans]
        ends[file] = list(accumulate((end for _, end in spans), max))

    def is_of_unprefixed(finding: Diagnostic) -> bool:
        if finding.code not in _UNKNOWN_NAMES or finding.origin is None or not names:
            return False
        span, message = finding.origin.span, finding.message
        before = bisect_right(starts.get(span.file, ()), span.start)
        if before and span.start < ends[span.file][before - 1]:
            return True
        quotes = (at for at, character in enumerate(message) if character == "'")
        return any(message[at : at + length] in names for at in quotes for length in lengths)

    return is_of_unprefixed
