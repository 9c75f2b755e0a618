"""Launch files: the plan's own findings, ready to be reported."""

from __future__ import annotations

from collections.abc import Mapping

from kbot.checks.below import improved
from kbot.launch import read_launch
from kbot.text import Diagnostic, Source
from kbot.xacro import Packages


def check_launch(source: Source, arguments: Mapping[str, str], packages: Packages) -> list[Diagnostic]:
    """What is wrong with a launch file and what it refers to."""
    plan = read_launch(source.path, arguments, packages, source=source)
    return [improved(d) for d in dict.fromkeys((*plan.problems, *plan.findings))]
