"""ROS 2 launch files in, a Plan out."""

from __future__ import annotations

from collections.abc import Mapping

from kbot.ros.launch.plan import Plan
from kbot.ros.launch.reporter import Reporter
from kbot.ros.launch.ros2.carry import Carrier
from kbot.ros.launch.ros2.context import LaunchContext
from kbot.ros.launch.ros2.markup import read_xml, read_yaml
from kbot.ros.launch.ros2.modules import PythonFiles
from kbot.text import DescriptionError, Diagnostic, Origin, Severity, Source, read_source
from kbot.text.errors import reading
from kbot.text.suggest import did_you_mean
from kbot.xacro.packages import Packages


def read_launch_2(
    path: str,
    arguments: Mapping[str, str] | None = None,
    packages: Packages | None = None,
    *,
    source: Source | None = None,
    allow_commands: bool = False,
    trusted: bool = False,
) -> Plan:
    """What a ROS 2 launch file in Python, XML or YAML would do.

    Never raises for faults of the file. One in Python is a program: it runs only when `trusted`.
    """
    given = dict(arguments or {})
    try:
        source = source or read_source(path)
    except DescriptionError as error:
        return Plan(path, problems=error.diagnostics)
    reporter = Reporter(packages or Packages(around=path))
    start = Origin(source.whole())
    context = LaunchContext(
        path, reporter.packages, start, reporter.finding, reporter.budget, allow_commands, dict(given)
    )
    python = PythonFiles(context)

    def load(file: Source, carrier: Carrier) -> list[object]:
        if file.path.endswith((".yaml", ".yml")):
            return read_yaml(file, reporter)
        if not file.path.endswith(".py"):
            return read_xml(file, reporter)
        if not trusted:
            message = "a ROS 2 launch file in Python is a program, and was not run"
            hint = "if you trust it: --trust"
            raise DescriptionError([Diagnostic("L080", Severity.ERROR, message, Origin(file.whole()), hint)])
        return python.load(file)

    carrier = Carrier(context, reporter, given, load)
    with reading(path), python.modules_in_place():
        try:
            python.guarded(source, lambda: _read(carrier, source))
        except DescriptionError as error:
            reporter.problems.extend(error.diagnostics)
    for name in given:
        if name not in carrier.arguments and not any(p.is_error for p in reporter.problems):
            hint = did_you_mean(name, carrier.arguments)
            message = f"the launch file declares no argument '{name}'"
            reporter.problem("L024", message, start, hint, warning=True)
    return carrier.plan(path)


def _read(carrier: Carrier, source: Source) -> list[object]:
    carrier.read(source)
    return []
