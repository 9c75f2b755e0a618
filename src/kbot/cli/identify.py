"""`kbot identify`: estimate a robot's true wheel sizes and sensor pose from a log of a drive."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
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
from kbot.text.errors import KbotError
from kbot.text.extras import needs_extra

if TYPE_CHECKING:
    from kbot.identify.log import DriveLog
    from kbot.identify.nominal import Nominal
    from kbot.identify.result import Identification


@click.command(
    "identify",
    epilog=examples(
        ("kbot identify drive.csv robot.xacro", "print values and intervals"),
        ("kbot identify run.mcap robot.xacro --fix", "write the values"),
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
@click.option("--fix", is_flag=True, help="Write the values into FILE and its includes, after a diff.")
@click.option("--yes", "confirmed", is_flag=True, help="Write without a question. Needs --fix.")
@json_option
@package_path_option
def command(
    words: tuple[str, ...],
    sensor: str | None,
    reference: str | None,
    fix: bool,
    confirmed: bool,
    as_json: bool,
    package_path: tuple[str, ...],
) -> int:
    """Estimate a robot's true parameters from a log of a drive.

    LOG is a CSV file or a recording (MCAP, ROS 1 bag, rosbag2). FILE describes the robot. name:=value sets a
    xacro argument of FILE or, if FILE has no argument of that name, a top-level property.

    The estimates are the radii of the left and right wheel, the wheel separation, the pose of the sensor in
    the frame at the middle of the axle, the scales of encoders and gyro, and the delay and time constant with
    which the wheels follow commands. Each has its 95 % interval. What the log cannot show is listed.

    Exit status: 0 the log shows at least one parameter; 1 it shows none; 2 unusable input.
    """
    try:
        if confirmed and not fix:
            fail("--yes writes without a question, and needs --fix")
        names, values = split_arguments(words)
        if len(names) != 2:
            fail(f"expected LOG and FILE, got {len(names)} argument{'' if len(names) == 1 else 's'}")
        request = _Request(names[0], names[1], values, sensor, reference, package_path)
        with busy("identifying"):
            log, nominal, result = _identify(request)
    except (Exception, KeyboardInterrupt):
        if as_json:
            from kbot.identify.result import NO_RESULT

            print_json(NO_RESULT)
        raise
    if as_json:
        print_json(result.to_json())
    else:
        click.echo(result.to_text())
    if fix and result.parameters:
        _write(request, log, nominal, result, confirmed=confirmed, to_stderr=as_json)
    return 0 if result.parameters else 1


@dataclass(frozen=True, slots=True)
class _Request:
    """What the user typed."""

    log: str
    file: str
    values: Mapping[str, str]
    sensor: str | None
    reference: str | None
    package_path: Sequence[str]

    def nominal(self) -> Nominal:
        """Read the robot."""
        from kbot.identify.nominal import read_nominal

        given = resolve_typed_names(self.file, self.values, self.package_path)
        return read_nominal(self.file, given.arguments, given.properties, self.package_path, self.sensor)


def _identify(request: _Request) -> tuple[DriveLog, Nominal, Identification]:
    if find_spec("scipy") is None:
        fail(needs_extra("kbot identify", "identify"))
    from kbot.identify.csv_file import read_csv  # imported lazily, so that -h stays fast
    from kbot.identify.identification import identify
    from kbot.identify.recording import read_recording
    from kbot.record.names import is_recording

    nominal = request.nominal()
    if is_recording(request.log):
        log, link = read_recording(request.log, nominal, request.reference, request.sensor)
        nominal = nominal.with_sensor(link)
    else:
        if request.reference is not None:
            fail(f"--reference is a topic of a recording, and {request.log} is not one. Remove --reference")
        log = read_csv(request.log)
    return log, nominal, identify(log, nominal)


def _write(
    request: _Request,
    log: DriveLog,
    nominal: Nominal,
    result: Identification,
    *,
    confirmed: bool,
    to_stderr: bool,
) -> None:
    """Show the changes of the robot's files as a diff, ask, write them, and compare the simulated runs."""
    from kbot.checks.formats import relative
    from kbot.identify.agreement import Agreement, agreement
    from kbot.identify.fix import robot_fix
    from kbot.model.load import resolve_robot_path
    from kbot.text.edits import unified_diff
    from kbot.text.files import rewrite
    from kbot.xacro.packages import is_shipped, may_change

    found = robot_fix(nominal, result)
    click.echo("", err=to_stderr)
    for line in found.not_written:
        click.echo(f"not written: {line}", err=to_stderr)
    if not found.edits:
        click.echo("nothing to write", err=to_stderr)
        return
    for line in found.written:
        click.echo(f"to write: {line}", err=to_stderr)
    texts = found.texts()
    for path, (before, after) in texts.items():
        click.echo(unified_diff(before, after, relative(path)), nl=False, err=to_stderr)
        if is_shipped(path):
            fail(f"{path} is part of KBot. Copy the robot with kbot new, and use its file")
        is_named = Path(path).resolve() == Path(resolve_robot_path(request.file)).resolve()
        if not (is_named or may_change(path)):
            fail(
                f"{path} is outside the working directory. Copy this file into your package, or run the "
                "command in the folder of its package"
            )
    if not confirmed:
        if not sys.stdin.isatty():
            fail("the changes are not written. Add --yes to write them without a question")
        if not click.confirm("Write these changes?", err=to_stderr):
            return
    try:
        with busy("simulating the log"):
            ran: Agreement | KbotError = agreement(log, nominal, result.is_disturbed)
    except KbotError as error:
        ran = error
    rewrite(texts)
    click.echo(f"wrote {', '.join(map(relative, texts))}", err=to_stderr)
    if isinstance(ran, KbotError):
        click.echo(f"simulated runs are not compared: {ran}", err=to_stderr)
        return
    changed = request.nominal()
    with busy("simulating the log"):
        if nominal.sensor_link is not None:
            changed = changed.with_sensor(nominal.sensor_link)
        fixed = agreement(log, changed, result.is_disturbed)
    click.echo(
        f"simulated drives of {ran.seconds:g} s end {fixed.distance:.3g} m and {fixed.angle:.3g} rad from "
        f"the log, before {ran.distance:.3g} m and {ran.angle:.3g} rad (median of {ran.drives})",
        err=to_stderr,
    )
    if fixed.is_farther_than(ran):
        click.echo("the drives end farther from the log than before: see what is not written", err=to_stderr)
