"""`kbot launch`: parses the options, finds the launch file and runs it."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from kbot.cli.arguments import (
    PageOptions,
    collect_options,
    examples,
    package_path_option,
    page_options,
    split_arguments,
)
from kbot.cli.keys import keys
from kbot.cli.output import fail, is_unusable, print_fix_command, print_note, report
from kbot.cli.progress import loading
from kbot.cli.ros.launch.text import Questions, print_answers, table
from kbot.cli.ros.peer_flags import peer_options
from kbot.cli.run_outputs import record_options, run_outputs
from kbot.model.load import SHIPPED_NAME, SHIPPED_PACKAGE, load_robot
from kbot.text import KbotError, Severity
from kbot.text.file_kind import LAUNCH, MAY_BE_LAUNCH, kind_of_file
from kbot.text.folders import files_below
from kbot.text.suggest import did_you_mean
from kbot.xacro import PackageNotFound, Packages

if TYPE_CHECKING:
    from kbot.record.record_options import RecordOptions
    from kbot.record.run_outputs import RunOutputs
    from kbot.ros.launch import Plan
    from kbot.ros.launch.staging import Stage
    from kbot.ros.peer_options import PeerOptions
    from kbot.tf.static_transforms import StaticTransform

_NEEDS_SIMULATION = "needs a launch file that simulates a robot"

_NAMED = 10
"""Launch files of a folder that an error lists."""


@click.command(
    "launch",
    epilog=examples(
        "kbot launch kbot_description kbot_base_rviz.launch",
        "kbot launch robot.launch gui:=false",
        ("kbot launch robot.launch --ros1", "connect to rostopic, tf and rviz"),
        ("kbot launch robot.launch.py --trust", "run a Python launch file"),
        ("kbot launch robot.launch --dry-run", "print what would run"),
        ("kbot launch robot.launch --dump-params", "print the parameters as YAML"),
    ),
)
@click.argument("words", nargs=-1, metavar="[PACKAGE] FILE [arg:=value ...]")
@package_path_option
@click.option("--dry-run", is_flag=True, help="Print what would run and exit.")
@click.option("--nodes", is_flag=True, help="Print the names of the nodes and exit.")
@click.option("--files", is_flag=True, help="Print the path of every launch file that is read, then exit.")
@click.option("--dump-params", is_flag=True, help="Print the parameters as YAML and exit.")
@click.option("--ros-args", is_flag=True, help="Print the arguments of the launch file and exit.")
@click.option("--args", "args_of", metavar="NODE", help="Print the command line of NODE and exit.")
@click.option("--trust", is_flag=True, help="Run a Python launch file (ROS 2) without asking.")
@click.option(
    "--allow-commands",
    is_flag=True,
    help="Let the launch file run any command, not only xacro, cat and (ROS 2) `ros2 param get`.",
)
@click.option(
    "--world",
    metavar="W",
    show_default="that of the launch file",
    help="World to simulate in: a built-in name, an SDF file or a map.yaml.",
)
@record_options
@peer_options
@page_options
@collect_options("questions", Questions)
def command(
    words: tuple[str, ...],
    package_path: tuple[str, ...],
    dry_run: bool,
    questions: Questions,
    trust: bool,
    allow_commands: bool,
    world: str | None,
    page: PageOptions,
    record: RecordOptions,
    peers: PeerOptions,
) -> int:
    """Run a ROS 1 or ROS 2 launch file without ROS.

    Name the launch file by its path, or by its package and file name. arg:=value sets an argument of
    the launch file.

    KBot's page and simulation replace rviz and Gazebo. Your own Python nodes run beside them. Errors
    that ROS would raise are reported with file, line and a fix.
    """
    named, arguments = split_arguments(words)
    from kbot.ros.launch import is_ros_2, read_launch, read_launch_2  # imported lazily, so that -h stays fast

    path = _find(named, Packages(package_path))
    packages = Packages(package_path, around=path)
    if is_ros_2(path):
        trusted = trust or (path.endswith(".py") and _ask_for_trust(path))
        with loading(path):
            plan = read_launch_2(path, arguments, packages, allow_commands=allow_commands, trusted=trusted)
    else:
        with loading(path):
            plan = read_launch(
                path,
                arguments,
                packages,
                resolve_anonymous=not questions.nodes,
                allow_commands=allow_commands,
            )
    plan.require()
    if questions:
        report(plan.problems)
        print_answers(plan, questions)
        return 0
    os.environ.update(plan.environment)  # the robot is read again below, and xacro reads these variables
    with loading(path):
        # imported lazily: it loads numpy, which -h does not need
        from kbot.ros.launch.running.findings import simulation_findings
        from kbot.ros.launch.staging import stage

        staged = stage(plan, packages)
        found = simulation_findings(staged, packages)
    if dry_run:
        found = (*plan.diagnostics, *staged.notes, *found)
        report(found)
        print_fix_command(found)
        click.echo(table(plan, staged))
        if any(is_unusable(d) for d in found):
            return 2
        return int(any(d.severity is not Severity.INFO for d in found))
    # a robot's own errors are reported when it is loaded; without one, they are why there is none
    of_files = (d for d in plan.diagnostics if staged.robot is None or d.code.startswith("L"))
    found = (*of_files, *staged.notes, *found)
    report(found)
    print_fix_command(found)
    if any(note.is_error for note in staged.notes):
        return 2
    if staged.robot is None:
        return _without_robot(plan, staged, record, peers)
    if record.path and not staged.is_simulated:
        fail(f"--record {_NEEDS_SIMULATION}. This one only shows a robot: it has no spawn_model node")
    click.echo(table(plan, staged))
    with loading(staged.robot.path):
        load_robot(staged.robot.path, staged.robot.arguments, packages=packages).require()
        chosen = None
        if staged.is_simulated:
            from kbot.ros.launch.running.world import choose_world  # with the worlds' geometry

            chosen = choose_world(world, staged.gazebo.world, print_note)
            report(chosen.world.diagnostics)
    with page.bound(has_window=staged.has_window) as address:
        with loading(staged.robot.path):
            from kbot.ros.launch.running.robot_run import RobotRun  # with the workbench

            of_launch = [finding for finding in found if finding.code.startswith("L")]
            run = RobotRun(plan, staged, LaunchTerminal(), package_path, of_launch)
        return run.run(record, peers, chosen, address)


class LaunchTerminal:
    """The terminal and the run's outputs, as `kbot.ros.launch.running` needs them."""

    note = staticmethod(print_note)
    report = staticmethod(report)
    loading = staticmethod(loading)
    keys = staticmethod(keys)

    def outputs(
        self, record: RecordOptions, peers: PeerOptions, transforms: Sequence[StaticTransform]
    ) -> AbstractContextManager[RunOutputs]:
        return run_outputs(record, peers, transforms, served=True)


def _without_robot(plan: Plan, staged: Stage, record: RecordOptions, peers: PeerOptions) -> int:
    from kbot.ros.launch.running.programs import run_programs  # imported lazily, for a fast start-up
    from kbot.ros.launch.running.without_robot import run_without_robot

    if not (staged.stand_ins.has_publishers or staged.programs):
        fail(
            f"{plan.path} has nothing to show: none of its parameters, such as robot_description, "
            "contains a robot"
        )
    click.echo(table(plan, staged))
    if not staged.stand_ins.has_publishers:
        return run_programs(plan, staged.programs, print_note)
    if record.path:
        fail(f"--record {_NEEDS_SIMULATION}. This one has no robot")
    return run_without_robot(plan, staged, peers, LaunchTerminal())


def _ask_for_trust(path: str) -> bool:
    """Ask whether to run the program, if there is a terminal to ask in."""
    if not Path(path).is_file() or not (sys.stdin.isatty() and sys.stderr.isatty()):
        return False
    return click.confirm(f"{path} is a program. Run it?", err=True)


def _find(named: list[str], packages: Packages) -> str:
    """The path of the launch file, given by its path or by its package and name."""
    if len(named) not in (1, 2):
        raise KbotError("expected one launch file: kbot launch FILE, or kbot launch PACKAGE FILE")
    package = named[0]
    if len(named) == 1:
        if Path(package).is_dir():
            raise KbotError(f"{package} is a folder. {_in_folder(Path(package))}")
        if Path(package).exists() or not re.fullmatch(r"\w+", package):
            return package
        raise KbotError(_as_package(package, packages))
    name = named[1]
    if _is_path(package):
        return _file_in(Path(package), f"the folder {package}", name)
    try:
        folder = _package_folder(package, packages)
    except PackageNotFound as error:
        if error.folder is None:
            raise
        file = _file_in(Path(error.folder), f"the folder {package}", name)
        raise KbotError(f"{error.hint}, or give the launch file by its path: kbot launch {file}") from None
    return _file_in(folder, f"the package '{package}'", name)


def _is_path(word: str) -> bool:
    """Whether PACKAGE is the path of a folder, as shells complete it: `robot/`, `./robot`."""
    if not (word in (".", "..") or "/" in word or os.sep in word):
        return False
    if not Path(word).is_dir():
        raise KbotError(f"{word} is not a folder")
    return True


def _file_in(folder: Path, shown: str, name: str) -> str:
    """The file of this name or relative path in a folder. Errors name the folder `shown`."""
    found = [str(folder / name)] if (folder / name).is_file() else _named(folder, Path(name).name)
    if not found:
        others = _launch_files(folder)
        near = did_you_mean(name, others)
        raise KbotError(f"{shown} has no launch file {name}{f': {near}' if near else f'. {_it_has(others)}'}")
    if len(found) > 1:
        raise KbotError(f"{shown} has several {name}: {', '.join(found)}")
    return found[0]


def _named(folder: Path, name: str) -> list[str]:
    return sorted(files_below(folder, lambda other: other == name))


def _it_has(names: list[str]) -> str:
    return f"It has: {', '.join(names)}" if names else "It has no launch files."


def _package_folder(word: str, packages: Packages) -> Path:
    """The folder of a package. `kbot` is the package of the robot that ships with KBot."""
    if word == SHIPPED_NAME:
        return SHIPPED_PACKAGE
    return Path(packages.find(word))


def _in_folder(folder: Path) -> str:
    """What to write instead of a folder, for an error."""
    files = _launch_paths(folder)
    if not files:
        return "It has no launch files."
    shown = ", ".join(files[:_NAMED]) + (", ..." if files[_NAMED:] else "")
    return f"Write kbot launch FILE. Its launch files: {shown}"


def _as_package(word: str, packages: Packages) -> str:
    """What to write instead of a package without a launch file, for an error."""
    try:
        names = _launch_files(_package_folder(word, packages))
    except PackageNotFound as error:
        if error.nearest:
            return f"{word} is not a file or package: {error.nearest}"
        return f"{word} is not a file or package. Write kbot launch FILE, or kbot launch PACKAGE FILE."
    if not names:
        return f"{word} is a package. It has no launch files."
    return f"{word} is a package. Write kbot launch {word} FILE. Its launch files: {', '.join(names)}"


def _launch_files(folder: Path) -> list[str]:
    return sorted(Path(file).name for file in _launch_paths(folder))


def _launch_paths(folder: Path) -> list[str]:
    files = files_below(folder, lambda name: name.endswith(MAY_BE_LAUNCH))
    return sorted(file for file in files if kind_of_file(file) == LAUNCH)
