"""`kbot check`: what is wrong with a robot, at the line that caused it."""

from __future__ import annotations

import sys

import click

from kbot.checks import check_file
from kbot.cli.arguments import examples, package_path_option, split_arguments
from kbot.cli.output import fail, has_color, print_json
from kbot.model.load import resolve_robot_path
from kbot.text import Diagnostic
from kbot.text.render import count, render_text, to_json
from kbot.xacro import Packages

_UNUSABLE = ("P002", "P005", "U001")


@click.command(
    "check",
    epilog=examples(
        "kbot check robot.xacro",
        "kbot check robot.xacro wheel_radius:=0.04 --json",
    ),
)
@click.argument("words", nargs=-1, metavar="FILE... [name:=value ...]")
@click.option("--json", "as_json", is_flag=True, help="One JSON object with 'findings' on stdout.")
@package_path_option
def command(words: tuple[str, ...], as_json: bool, package_path: tuple[str, ...]) -> int:
    """Say what is wrong with the xacro, URDF or launch FILEs.

    Exit status: 0 nothing found, 1 findings, 2 a file that cannot be used.
    """
    files, arguments = split_arguments(words)
    if not files:
        fail("no FILE was given; 'kbot' means the robot that ships with KBot")
    found: list[Diagnostic] = []
    for file in files:
        path = resolve_robot_path(file)
        found += check_file(path, arguments, Packages(package_path))
    if as_json:
        print_json({"findings": [to_json(d) for d in found]})
    else:
        color = has_color(sys.stdout)
        click.echo(render_text(found, color=color, width=None), nl=False)
        if found:
            click.echo(count(found))
    if any(is_unusable(d) for d in found):
        return 2
    return 1 if found else 0


def is_unusable(diagnostic: Diagnostic) -> bool:
    """Whether a finding says that the file is no robot at all: not there, not text, not XML, empty."""
    code, origin = diagnostic.code, diagnostic.origin
    if code == "P001" and origin is not None:
        return not origin.span.source.text.lstrip().startswith("<")
    return code.startswith("F") or code in _UNUSABLE
