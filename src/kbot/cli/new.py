"""`kbot new`: create a robot package for KBot, ROS 1 and ROS 2."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import click
from click.core import ParameterSource

from kbot.cli.arguments import examples
from kbot.cli.output import print_note
from kbot.templates import Sizes, make_package

_SIZES = Sizes()
_SIZE_OPTIONS = ("length", "width", "height", "wheel_radius", "wheel_width", "separation")


def _size(name: str, default: float, text: str) -> Callable[[click.decorators.FC], click.decorators.FC]:
    return click.option(name, type=float, default=default, show_default=True, metavar="M", help=text)


@click.command(
    "new",
    epilog=examples(
        "kbot new my_robot --length 0.4 --width 0.3 --wheel-radius 0.08",
        "kbot new my_robot --in ~/catkin_ws/src",
        ("kbot new my_robot", "in an existing folder: add what is missing"),
    ),
)
@click.argument("name")
@click.option(
    "--in",
    "parent",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    default=Path(),
    metavar="DIR",
    show_default="current folder",
    help="Folder to create the package in.",
)
@_size("--length", _SIZES.length, "Body length in m.")
@_size("--width", _SIZES.width, "Body width in m.")
@_size("--height", _SIZES.height, "Body height in m.")
@_size("--wheel-radius", _SIZES.wheel_radius, "Wheel radius in m.")
@_size("--wheel-width", _SIZES.wheel_width, "Wheel width in m.")
@click.option(
    "--separation",
    type=float,
    metavar="M",
    show_default="width + wheel-width + 0.02",
    help="Distance between the wheel centres in m.",
)
@click.pass_context
def command(
    ctx: click.Context,
    name: str,
    parent: Path,
    length: float,
    width: float,
    height: float,
    wheel_radius: float,
    wheel_width: float,
    separation: float | None,
) -> None:
    """Create a package NAME with a robot that has two driven wheels and a ball caster.

    The package builds with catkin and colcon. Its launch files run with roslaunch, ros2 launch and kbot
    launch.

    If the folder NAME exists, only missing files are added, and nothing is overwritten. If it has a robot in
    urdf/, the new launch files show that robot.
    """
    sizes = Sizes.of(length, width, height, wheel_radius, wheel_width)
    folder = parent / name
    made = make_package(folder, name, sizes if separation is None else replace(sizes, separation=separation))
    for title, files in (("Added:", made.added), ("Kept:", made.kept)):
        if files and made.kept:
            click.echo(title)
        for file in files:
            click.echo(f"  {folder / file}")
    given = [name for name in _SIZE_OPTIONS if ctx.get_parameter_source(name) is ParameterSource.COMMANDLINE]
    if given and made.robot in made.kept:
        option = given[0].replace("_", "-")
        print_note(f"note: --{option} has no effect, because {folder / made.robot} already exists")
    click.echo(f"\nDrive it:  kbot sim {folder / made.robot}\nCheck it:  kbot check {folder}")
