"""Checks a launch file and the robots that it loads."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from kbot.checks.config import Config
from kbot.checks.file_kinds import FileKind
from kbot.checks.runner import examine, findings
from kbot.kinematics.drive.declared import declared_drives
from kbot.model.load import load_robot
from kbot.ros.launch import Plan, is_ros_2, read_launch, read_launch_2
from kbot.ros.launch.node_settings.rviz import missing_displays
from kbot.ros.launch.plan import Param, RobotDescription
from kbot.text import DescriptionError, Diagnostic, Origin, Related, Severity, Source, read_source
from kbot.text.file_kind import LAUNCH
from kbot.xacro import Packages

_SPAWNERS = ("spawn_model", "spawn_entity.py", "create")
_STEPS_OF_ROBOTS = 1_000_000
"""Limit on the expansion steps of all robots that a launch file loads. A check takes up to three times as
long as the expansion, so all checks together take about 3 s. The largest of 168 real robots takes 33,000
steps."""
_PUBLISHERS = ("joint_state_publisher", "joint_state_publisher_gui")


def check_launch(
    source: Source, arguments: Mapping[str, str], packages: Packages, config: Config
) -> tuple[list[Diagnostic], list[Source]]:
    """The findings of a launch file and of the robots that it loads, and the sources that were read."""
    if is_ros_2(source.path, source.text):
        plan = read_launch_2(source.path, arguments, packages, source=source)
    else:
        plan = read_launch(source.path, arguments, packages, source=source)
    found = dict.fromkeys((*plan.problems, *plan.findings))
    # a check does not run Python launch files: for an included one, L080 is not a finding
    own = [d for d in found if d.code != "L080" or (d.origin and d.origin.span.file == source.path)]
    sources = [source]
    of_robots: list[Diagnostic] = []
    steps = _STEPS_OF_ROBOTS
    for description, origin in _descriptions(plan):
        try:
            entry = read_source(description.path)
        except DescriptionError as error:
            of_robots += error.diagnostics
            continue
        if steps < 0:
            message = f"{description.path} is not checked: the launch file has too many robots"
            of_robots.append(
                Diagnostic("K003", Severity.INFO, message, origin, f"run kbot check {description.path}")
            )
            continue
        context = examine(entry, description.arguments, packages.beside(entry.path), config)
        of_robots += findings(context)
        steps -= context.expansion.steps
        sources += [file.source for file in context.sources]
    reported = {_key(d) for d in of_robots}
    own += [*missing_displays(plan.nodes), *_two_publishers(plan, packages)]
    own = [d for d in own if _key(d) not in reported]
    return list(dict.fromkeys((*own, *of_robots))), sources


def _descriptions(plan: Plan) -> list[tuple[RobotDescription, Origin]]:
    """The robot files that parameters load, with the origin of the parameter. A file that is loaded again
    with the same arguments is listed once, with the origin of the first parameter."""
    found: dict[tuple[str, tuple[tuple[str, str], ...]], Param] = {}
    for param in plan.params.values():
        if param.description is not None:
            key = param.description.path, tuple(sorted(param.description.arguments.items()))
            found.setdefault(key, param)
    return [(param.description, param.origin) for param in found.values() if param.description]


def _key(diagnostic: Diagnostic) -> tuple[str, str]:
    return diagnostic.code, str(diagnostic.origin)


def _two_publishers(plan: Plan, packages: Packages) -> Iterator[Diagnostic]:
    """D122: joint_state_publisher runs beside a simulated robot whose plugin publishes the wheels' states."""
    publishers = [n for n in plan.nodes if n.package in _PUBLISHERS or n.type in _PUBLISHERS]
    if not publishers or not any(n.type in _SPAWNERS for n in plan.nodes):
        return
    for param in plan.params.values():
        if param.description is None:
            continue
        robot = load_robot(param.description.path, param.description.arguments, packages=packages).robot
        for driver in declared_drives(robot) if robot else ():
            if driver.publishes_joints is not None:
                yield Diagnostic(
                    "D122",
                    Severity.WARNING,
                    f"joint_state_publisher and the plugin '{driver.name}' both publish the wheels' states: "
                    "the wheels flicker between two angles",
                    publishers[0].origin,
                    "remove joint_state_publisher from the launch file that simulates the robot",
                    (Related(f"'{driver.name}'", driver.publishes_joints.key),),
                )


LAUNCH_FILES = FileKind(LAUNCH, check_launch, has_arguments=True)
