"""Launch files: the plan's own findings, ready to be reported."""

from __future__ import annotations

from collections.abc import Mapping

from kbot.checks.below import improved
from kbot.launch import is_ros_2, read_launch, read_launch_2
from kbot.text import Diagnostic, Source
from kbot.xacro import Packages


def check_launch(source: Source, arguments: Mapping[str, str], packages: Packages) -> list[Diagnostic]:
    """What is wrong with a launch file and what it refers to."""
    if is_ros_2(source.path, source.text):
        plan = read_launch_2(source.path, arguments, packages, source=source)
    else:
        plan = read_launch(source.path, arguments, packages, source=source)
    found = dict.fromkeys((*plan.problems, *plan.findings))
    # an included file in Python is a program, which a check does not run
    own = (d for d in found if d.code != "L080" or (d.origin and d.origin.span.file == source.path))
    return [improved(d) for d in own]
