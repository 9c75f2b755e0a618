"""`kbot identify`: estimate a robot's true wheel sizes and sensor pose from a log of a drive."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from typing import TYPE_CHECKING

import click

from kbot.cli.arguments import (
    examples,
    json_option,
    package_path_option,
    resolve_typed_names,
    split_arguments,
)
from kbot.cli.output import fail, print_json
from kbot.cli.progress import busy

if TYPE_CHECKING:
    from kbot.identify.result import Identification


@click.command(
    "identify",
    epilog=examples(
        ("kbot identify drive.csv robot.xacro", "print values and intervals"),
        "kbot identify drive.csv robot.xacro --sensor laser_link",
    ),
)
@click.argument("words", nargs=-1, metavar="LOG FILE [name:=value ...]")
@click.option(
    "--sensor",
    metavar="LINK",
    show_default="the only lidar",
    help="Link whose motion the reference of the log measures.",
)
@click.option(
    "--reference",
    metavar="TOPIC",
    show_default="true poses, a localisation, or else scans",
    help="Topic of a recording with the reference: poses, or scans of a lidar.",
)
@json_option
@package_path_option
def command(
    words: tuple[str, ...],
    sensor: str | None,
    reference: str | None,
    as_json: bool,
    package_path: tuple[str, ...],
) -> int:
    """Estimate a robot's true parameters from a log of a drive.

    LOG is a CSV file or a recording (MCAP, ROS 1 bag, rosbag2). FILE describes the robot. name:=value sets a
    xacro argument of FILE or, if FILE has no argument of that name, a top-level property.

    The estimates are the radii of the left and right wheel, the wheel separation, and the pose of the sensor
    in the frame at the middle of the axle, each with its 95 % interval. What the log cannot show is listed.

    Exit status: 0 the log shows at least one parameter; 1 it shows none; 2 unusable input.
    """
    try:
        names, values = split_arguments(words)
        if len(names) != 2:
            fail(f"expected a LOG and a FILE, not {len(names)} files")
        with busy("identifying"):
            result = _identify(names[0], names[1], values, sensor, reference, package_path)
    except (Exception, KeyboardInterrupt):
        if as_json:
            from kbot.identify.result import NO_RESULT

            print_json(NO_RESULT)
        raise
    if as_json:
        print_json(result.to_json())
    else:
        click.echo(result.to_text())
    return 0 if result.parameters else 1


def _identify(
    log: str,
    file: str,
    values: Mapping[str, str],
    sensor: str | None,
    reference: str | None,
    package_path: Sequence[str],
) -> Identification:
    if find_spec("scipy") is None:
        fail("SciPy is not installed: pip install 'kbot[identify]'")
    from kbot.identify.csv_file import read_csv  # imported lazily, so that -h stays fast
    from kbot.identify.identification import identify
    from kbot.identify.nominal import read_nominal
    from kbot.identify.recording import read_recording
    from kbot.record.names import is_recording

    given = resolve_typed_names(file, values, package_path)
    nominal = read_nominal(file, given.arguments, given.properties, package_path, sensor)
    if not is_recording(log):
        return identify(read_csv(log), nominal)
    drive_log, link = read_recording(log, nominal, reference)
    return identify(drive_log, nominal.with_sensor(sensor or link))
