"""`kbot info`: links, joints, masses, drive geometry and bounds of a robot."""

from __future__ import annotations

import click

from kbot.cli.arguments import (
    examples,
    file_and_arguments,
    json_option,
    package_path_option,
    resolve_typed_names,
)
from kbot.cli.output import print_json, report
from kbot.cli.progress import loading


@click.command(
    "info",
    epilog=examples("kbot info kbot", "kbot info robot.xacro wheel_radius:=0.04 --json"),
)
@click.argument("words", nargs=-1, metavar="FILE [name:=value ...]")
@package_path_option
@json_option
def command(words: tuple[str, ...], package_path: tuple[str, ...], as_json: bool) -> int:
    """Print links, joints, masses, drive geometry and size of a robot.

    name:=value sets a xacro argument of FILE or, if FILE has no argument of that name, a top-level
    property.

    Exit status: 0 success; 1 a mass or a size is not positive; 2 FILE cannot be used.
    """
    from kbot.checks.first_look import MESHES, NUMBERS, first_look  # imported lazily, so that -h stays fast
    from kbot.kinematics.robot_info import describe, describe_as_text
    from kbot.model.load import load_robot
    from kbot.xacro import Packages

    file, values = file_and_arguments(words)
    given = resolve_typed_names(file, values, package_path)
    with loading(file):
        loaded = load_robot(file, given.arguments, given.properties, Packages(package_path))
        robot = loaded.require()
        found = first_look(loaded, (*NUMBERS, *MESHES))
    report([*loaded.diagnostics, *found])
    if as_json:
        print_json(describe(robot))
    else:
        click.echo(describe_as_text(robot))
    return int(any(d.is_error for d in found))
