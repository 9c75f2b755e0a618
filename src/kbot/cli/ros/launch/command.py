"""`kbot launch`: what roslaunch would do, with KBot in the place of ROS."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from kbot.cli.arguments import PageOptions, examples, package_path_option, page_options, split_arguments
from kbot.cli.output import fail, is_unusable, report, say_how_to_fix, warn_of_others
from kbot.cli.outputs import record_options
from kbot.cli.progress import loading
from kbot.cli.ros.launch.text import print_answers, table
from kbot.cli.ros.peer_options import peer_options
from kbot.model.load import SHIPPED_NAME, SHIPPED_PACKAGE, load_robot
from kbot.model.spawned import with_controllers
from kbot.ros.launch import Plan, is_ros_2, read_launch, read_launch_2
from kbot.ros.launch.staging import Stage, stage
from kbot.text import Diagnostic, KbotError, Severity
from kbot.text.suggest import did_you_mean
from kbot.xacro import PackageNotFound, Packages

if TYPE_CHECKING:
    from kbot.record.record_options import RecordOptions
    from kbot.ros.peer_options import PeerOptions

_NAMED = 10
"""Launch files of a folder that are named."""


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
@click.option("--files", is_flag=True, help="Print the launch files that are read and exit.")
@click.option("--dump-params", is_flag=True, help="Print the parameters as YAML and exit.")
@click.option("--ros-args", is_flag=True, help="Print the arguments of the launch file and exit.")
@click.option("--args", "args_of", metavar="NODE", help="Print the command line of NODE and exit.")
@click.option("--trust", is_flag=True, help="Run a Python launch file (ROS 2) without asking.")
@click.option(
    "--allow-commands", is_flag=True, help="Let the launch file run any command, not only xacro and cat."
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
def command(
    words: tuple[str, ...],
    package_path: tuple[str, ...],
    dry_run: bool,
    nodes: bool,
    files: bool,
    dump_params: bool,
    ros_args: bool,
    args_of: str | None,
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
    path = _find(named, Packages(package_path))
    packages = Packages(package_path, around=path)
    if is_ros_2(path):
        trusted = trust or (path.endswith(".py") and _ask_for_trust(path))
        with loading(path):
            plan = read_launch_2(path, arguments, packages, allow_commands=allow_commands, trusted=trusted)
    else:
        with loading(path):
            plan = read_launch(
                path, arguments, packages, resolve_anonymous=not nodes, allow_commands=allow_commands
            )
    plan.require()
    if nodes or files or dump_params or ros_args or args_of:
        report(d for d in plan.problems)
        print_answers(
            plan, nodes=nodes, files=files, dump_params=dump_params, ros_args=ros_args, args_of=args_of
        )
        return 0
    with loading(path):
        staged = stage(plan, packages)
        controllers = _of_robots(staged, packages)
    if dry_run:
        found = (*plan.diagnostics, *staged.notes, *controllers)
        report(found)
        say_how_to_fix(found)
        click.echo(table(plan, staged))
        if any(is_unusable(d) for d in found):
            return 2
        return int(any(d.severity is not Severity.INFO for d in found))
    found = (*(d for d in (*plan.diagnostics, *staged.notes) if d.code.startswith("L")), *controllers)
    report(found)
    say_how_to_fix(found)
    if any(note.is_error for note in staged.notes):
        return 2
    if staged.path is None:
        return _without_robot(plan, staged, record, peers)
    if record.path and not staged.simulate:
        fail("--record goes with a launch that simulates; this one shows a robot (it has no spawn_model)")
    click.echo(table(plan, staged))
    with loading(staged.path):
        load_robot(staged.path, staged.arguments, packages=packages).require()
        place = None
        if staged.simulate:
            from kbot.cli.ros.launch.place import find_place

            place = find_place(world, staged.world)
    with page.bound(has_window=staged.window) as address:
        with loading(staged.path):
            from kbot.cli.ros.launch.with_robot import carry_out
        return carry_out(plan, staged, record, peers, place, address, package_path)


def _without_robot(plan: Plan, staged: Stage, record: RecordOptions, peers: PeerOptions) -> int:
    from kbot.cli.ros.launch.programs import run_programs
    from kbot.cli.ros.launch.without_robot import has_something_to_say, run_without_robot

    has_more = has_something_to_say(staged)
    if not (has_more or staged.programs):
        fail(f"{plan.path} sets no parameter to a robot (robot_description from xacro): nothing to show")
    click.echo(table(plan, staged))
    return run_without_robot(plan, staged, record, peers) if has_more else run_programs(plan, staged.programs)


def _of_robots(staged: Stage, packages: Packages) -> tuple[Diagnostic, ...]:
    """What is wrong with the spawned controllers and the hardware of the robots that are simulated."""
    if not (staged.path and staged.simulate):
        return ()
    from kbot.checks.first_look import CONTROL, first_look, folded
    from kbot.sim.preparation import controller_findings

    spawned = [(staged.path, staged.arguments, staged.controllers)]
    spawned += [(other.path, other.arguments, other.controllers) for other in staged.others]
    findings: list[Diagnostic] = []
    for path, arguments, controllers in spawned:
        loaded = load_robot(path, arguments, packages=packages)
        findings += first_look(loaded, CONTROL)
        if controllers and loaded.robot is not None:
            findings += folded(loaded, controller_findings(with_controllers(loaded.robot, controllers)))
    return tuple(findings)


def _ask_for_trust(path: str) -> bool:
    """Asks, where somebody is there to answer."""
    if not Path(path).is_file() or not (sys.stdin.isatty() and sys.stderr.isatty()):
        return False
    return click.confirm(f"{path} is a program. Run it?", err=True)


def _find(named: list[str], packages: Packages) -> str:
    """The launch file of a command line: a path, or a package and the name of a file in it."""
    if len(named) not in (1, 2):
        raise KbotError("a launch file is expected: kbot launch FILE, or kbot launch PACKAGE FILE")
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
    """Whether a PACKAGE is written as a path to a folder, as shells complete it: `robot/`, `./robot`."""
    if not (word in (".", "..") or "/" in word or os.sep in word):
        return False
    if not Path(word).is_dir():
        raise KbotError(f"{word} is not a folder")
    return True


def _file_in(folder: Path, shown: str, name: str) -> str:
    """The one file of a name, or of a path, in a folder."""
    found = [folder / name] if (folder / name).is_file() else sorted(folder.rglob(Path(name).name))
    if not found:
        others = _launch_files(folder)
        near = did_you_mean(name, others)
        raise KbotError(f"{shown} has no launch file {name}{f': {near}' if near else f'. {_it_has(others)}'}")
    if len(found) > 1:
        raise KbotError(f"{shown} has several {name}: {', '.join(map(str, found))}")
    return str(found[0])


def _it_has(names: list[str]) -> str:
    return f"It has: {', '.join(names)}" if names else "It has no launch files."


def _package_folder(word: str, packages: Packages) -> Path:
    """The folder of a package, or of the robot that ships with KBot for the word `kbot`."""
    if word == SHIPPED_NAME:
        return SHIPPED_PACKAGE
    folder = Path(packages.find(word))
    warn_of_others(word, packages)
    return folder


def _in_folder(folder: Path) -> str:
    """What to write where a folder was named."""
    files = sorted(str(file) for file in folder.rglob("*") if _is_launch_file(file))
    if not files:
        return "It has no launch files."
    shown = ", ".join(files[:_NAMED]) + (", ..." if files[_NAMED:] else "")
    return f"Write kbot launch FILE. Its launch files: {shown}"


def _as_package(word: str, packages: Packages) -> str:
    """What to write where a package was named without one of its launch files."""
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
    return sorted(file.name for file in folder.rglob("*") if _is_launch_file(file))


def _is_launch_file(file: Path) -> bool:
    return file.suffix == ".launch" or file.name.endswith((".launch.py", ".launch.xml", ".launch.yaml"))
