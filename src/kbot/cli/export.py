"""`kbot export`: export a robot as a picture, web page, 3D model or tree drawing, without a browser."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from kbot.cli.arguments import (
    examples,
    file_and_arguments,
    package_path_option,
    resolve_typed_names,
    split_arguments,
)
from kbot.cli.output import fail, report
from kbot.cli.picture_options import look_options
from kbot.text.files import write_bytes
from kbot.text.numbers import to_float
from kbot.text.suggest import did_you_mean

if TYPE_CHECKING:
    from kbot.model import RobotModel
    from kbot.render.look import Look

FORMATS = ("png", "html", "glb", "tree")
_ENDINGS = {".png": "png", ".html": "html", ".htm": "html", ".glb": "glb"}


@click.command(
    "export",
    epilog=examples(
        "kbot export kbot -o kbot.png --size 1920x1080 --transparent",
        ("kbot export robot.xacro -o robot.html", "page for offline use"),
        ("kbot export arm.urdf -o arm.glb --joint elbow:=1.2", "for glTF viewers"),
        ("kbot export robot.urdf --to tree -o tree.svg", "kinematic tree"),
    ),
)
@click.argument("words", nargs=-1, required=True, metavar="FILE [name:=value ...]")
@click.option(
    "--to",
    "kind",
    type=click.Choice(FORMATS),
    show_default="by the suffix of OUT",
    help="Output format.",
)
@click.option(
    "-o",
    "output",
    metavar="OUT",
    show_default="the robot's name, in the current folder",
    help="File to write the result to; - is stdout.",
)
@click.option(
    "--joint",
    "joints",
    multiple=True,
    metavar="NAME:=VALUE",
    help="Joint position in rad or m. Can be repeated.",
)
@look_options
@package_path_option
def command(
    words: tuple[str, ...],
    kind: str | None,
    output: str | None,
    joints: tuple[str, ...],
    look: Look,
    package_path: tuple[str, ...],
) -> int:
    """Export a robot as a picture, web page, 3D model or drawing of the kinematic tree.

    The formats are png (picture), html (one file with joint sliders), glb (3D model) and tree (SVG drawing
    of the kinematic tree). Missing meshes are reported and left out.

    name:=value sets a xacro argument of FILE or, if FILE has no argument of that name, a top-level
    property.
    """
    file, values = file_and_arguments(words)
    wanted = kind or _by_ending(output)
    from kbot.checks.first_look import MESHES, first_look  # imported lazily, so that -h stays fast
    from kbot.model.extensions import initial_positions
    from kbot.model.load import load_robot
    from kbot.text.file_names import plain_file_name
    from kbot.xacro import Packages

    given = resolve_typed_names(file, values, package_path)
    loaded = load_robot(file, given.arguments, given.properties, Packages(package_path))
    robot = loaded.require()
    positions = {**initial_positions(robot), **_positions(joints, robot)}
    report([*loaded.diagnostics, *first_look(loaded, MESHES)])
    if wanted == "html":
        from kbot.robot import Robot  # keeps the origins, which the page shows

        data = Robot.of(loaded).show(positions).page.encode()
    else:
        data = _drawn(robot, wanted, positions, look)
    _write(output, f"{plain_file_name(robot.name)}.{'svg' if wanted == 'tree' else wanted}", data)
    return 0


def _drawn(robot: RobotModel, kind: str, joints: dict[str, float], look: Look) -> bytes:
    if kind == "glb":
        from kbot.render.glb import glb

        return glb(robot, joints)
    if kind == "tree":
        from kbot.render.tree import tree_svg

        return tree_svg(robot).encode()
    from kbot.render.picture import draw_picture
    from kbot.render.picture_scene import robot_alone

    return draw_picture(robot_alone(robot, joints), look)


def _by_ending(output: str | None) -> str:
    if output is None or output == "-":
        fail(f"the output format is missing. Add --to with one of {', '.join(FORMATS)}")
    ending = Path(output).suffix.lower()
    if ending not in _ENDINGS:
        fail(
            f"the suffix of '{output}' does not select a format. Use .png, .html or .glb, or add --to tree "
            "for an SVG drawing of the kinematic tree"
        )
    return _ENDINGS[ending]


def _positions(words: Sequence[str], robot: RobotModel) -> dict[str, float]:
    others, given = split_arguments(words)
    if others:
        fail(f"--joint takes NAME:=VALUE, for example elbow:=1.2, not '{others[0]}'")
    known = [joint.name for joint in robot.movable_joints]
    positions: dict[str, float] = {}
    for name, text in given.items():
        if name not in known:
            hint = did_you_mean(name, known) or f"its movable joints are {', '.join(known) or 'none'}"
            fail(f"--joint {name}: the robot has no movable joint of this name; {hint}")
        try:
            positions[name] = to_float(text)
        except ValueError:
            fail(f"--joint {name} takes a number in rad or m, not '{text}'")
    return positions


def _write(output: str | None, name: str, data: bytes) -> None:
    if output == "-":
        sys.stdout.buffer.write(data)
        sys.stdout.flush()
        return
    target = name if output is None else output
    if output is None and Path(target).exists():
        fail(f"{target} already exists. Use -o {target} to overwrite it")
    write_bytes(target, data)
    click.echo(target, err=True)
