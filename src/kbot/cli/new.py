"""`kbot new`: a robot package to start from, for KBot, ROS 1 and ROS 2."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

from kbot.cli.arguments import examples
from kbot.templates import Sizes, make_package

_SIZES = Sizes()


@click.command(
    "new",
    epilog=examples(
        "kbot new my_robot",
        "kbot new my_robot --length 0.4 --width 0.3 --separation 0.36 --wheel-radius 0.08",
        "kbot new my_robot --in ~/catkin_ws/src",
    ),
)
@click.argument("name")
@click.option(
    "--in",
    "parent",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    default=Path(),
    metavar="DIR",
    help="The folder to make the package in.  [default: the current one]",
)
@click.option(
    "--length", type=float, default=_SIZES.length, show_default=True, metavar="M", help="Of the body."
)
@click.option(
    "--width", type=float, default=_SIZES.width, show_default=True, metavar="M", help="Of the body."
)
@click.option(
    "--height", type=float, default=_SIZES.height, show_default=True, metavar="M", help="Of the body."
)
@click.option("--wheel-radius", type=float, default=_SIZES.wheel_radius, show_default=True, metavar="M")
@click.option("--wheel-width", type=float, default=_SIZES.wheel_width, show_default=True, metavar="M")
@click.option(
    "--separation",
    type=float,
    metavar="M",
    help="Between the middles of the wheels.  [default: as the body and the wheels need]",
)
def command(
    name: str,
    parent: Path,
    length: float,
    width: float,
    height: float,
    wheel_radius: float,
    wheel_width: float,
    separation: float | None,
) -> None:
    """Make a package NAME with a robot that drives: two wheels, a ball caster, sizes in metres.

    What is there is never written over. The package builds with catkin and colcon; its launch files run
    with roslaunch, ros2 launch and kbot launch.
    """
    sizes = Sizes.of(length, width, height, wheel_radius, wheel_width)
    folder = parent / name
    written = make_package(
        folder, name, sizes if separation is None else replace(sizes, separation=separation)
    )
    for file in written:
        click.echo(f"  {folder / file}")
    robot = folder / "urdf" / f"{name}.xacro"
    click.echo(f"\nDrive it:  kbot sim {robot}\nCheck it:  kbot check {folder}")
