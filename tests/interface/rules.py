"""The codes of findings, and the former codes."""

from __future__ import annotations

from collections.abc import Iterator

from kbot.checks import all_rules
from kbot.checks.former_codes import FORMER_CODES


def lines() -> Iterator[str]:
    """One line for each code: its name, its default severity, whether KBot fixes it, and who reports it."""
    for code, rule in sorted(all_rules().items()):
        fix = "" if rule.fix == "none" else f", {rule.fix} fix"
        ros = ", only on ROS" if rule.is_ros_only else ""
        yield f"{code} {rule.name}: {rule.severity}{ros}{fix}, since {rule.since}"
    for code, former in sorted(FORMER_CODES.items()):
        yield f"{code} {former.name}: now {', '.join(former.codes) or 'not reported'}"
