"""`kbot bag`: what is in a recording, parts of it, other formats, tables; said and done again."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from kbot.cli.arguments import examples, package_path_option
from kbot.cli.bag.words import Bag, Play, read_remaps
from kbot.cli.companions import bridge_options
from kbot.cli.numbers import Within
from kbot.cli.output import fail, print_json

if TYPE_CHECKING:
    from kbot.bridges.companion_options import CompanionOptions
    from kbot.record.export import Table

SMALLEST_PLOT = 200
SECONDS = Within(0.0, 9.2e9)
"""Times that 64 bits of nanoseconds hold."""


@click.group(
    "bag",
    cls=Bag,
    epilog=examples(
        "kbot bag info run.mcap",
        "kbot bag cut run.mcap part.mcap --start 2 --end 5 --topic /odom",
        "kbot bag convert run.mcap run.bag          for ROS 1; a name without suffix is a rosbag2 folder",
        "kbot bag export run.mcap --topic /odom -o odom.csv",
        "kbot bag play run.mcap --ros1              say it again to rviz, rostopic, Foxglove",
        "kbot bag replay run.mcap                   drive again as recorded, and compare bit for bit",
    ),
)
def command() -> None:
    """Look into recordings: .mcap, .bag of ROS 1, or folders of rosbag2."""


def _recording(function: click.decorators.FC) -> click.decorators.FC:
    return click.argument("recording", metavar="FILE")(function)


def _topics(function: click.decorators.FC) -> click.decorators.FC:
    return click.option(
        "--topic", "topics", multiple=True, metavar="NAME", help="Only this; may be repeated."
    )(function)


@command.command("info", epilog=examples("kbot bag info run.mcap --json"))
@_recording
@click.option("--json", "as_json", is_flag=True, help="Print it as one JSON object.")
def info(recording: str, as_json: bool) -> int:
    """Say what is in a recording, and whether it is whole."""
    from kbot.cli.bag.info import bag_text
    from kbot.record import Recording

    found = Recording(recording).summary()
    if as_json:
        print_json(
            {
                "file": recording,
                "format": found.kind,
                "messages": found.count,
                "seconds": found.seconds,
                "topics": {
                    name: {"type": t.type_name, "messages": t.count} for name, t in found.topics.items()
                },
                "notes": found.notes,
                "broken": found.broken,
            }
        )
        return int(bool(found.broken))
    click.echo(bag_text(recording, found))
    return int(bool(found.broken))


@command.command("cut", epilog=examples("kbot bag cut run.mcap part.mcap --start 2 --end 5"))
@_recording
@click.argument("target", metavar="NEW")
@click.option("--start", type=SECONDS, metavar="S", help="Seconds of the recording's clock.")
@click.option("--end", type=SECONDS, metavar="S", help="Seconds of the recording's clock.")
@_topics
def cut(recording: str, target: str, start: float | None, end: float | None, topics: tuple[str, ...]) -> None:
    """Write a part of a recording to a new one."""
    _copy(recording, target, start, end, topics)


@command.command("convert", epilog=examples("kbot bag convert run.mcap run.bag"))
@_recording
@click.argument("target", metavar="NEW")
@_topics
def convert(recording: str, target: str, topics: tuple[str, ...]) -> None:
    """Write a recording in another format: .mcap, .bag, or a folder of rosbag2 (no suffix)."""
    _copy(recording, target, None, None, topics)


def _copy(
    recording: str, target: str, start: float | None, end: float | None, topics: tuple[str, ...]
) -> None:
    from kbot.record.copy import copy_recording

    copied = copy_recording(recording, target, start=start, end=end, topics=topics)
    if copied.broken:
        click.echo(f"{recording} is not whole: {copied.broken}", err=True)
    click.echo(f"{target}: {copied.messages} messages")


@command.command(
    "export",
    epilog=examples(
        "kbot bag export run.mcap --topic /odom -o odom.csv",
        "kbot bag export run.mcap --topic /scan --to parquet -o scan.parquet",
        "kbot bag export run.mcap --topic /odom --field twist.twist.linear.x -o speed.svg     a plot",
    ),
)
@_recording
@click.option("--topic", required=True, metavar="NAME", help="The topic whose messages become rows.")
@click.option(
    "--to",
    "kind",
    type=click.Choice(["csv", "parquet", "svg"]),
    help="Kind of table, or svg for a plot; Parquet needs the extra parquet.  "
    "[default: by FILE's ending, or csv]",
)
@click.option(
    "--field",
    "fields",
    multiple=True,
    metavar="NAME",
    help="Only this column; may be repeated. A plot needs it.",
)
@click.option("--size", metavar="WxH", default="1000x400", show_default=True, help="Pixels of a plot.")
@click.option("-o", "--output", metavar="FILE", help="Where to write it.  [default: print it]")
def export(
    recording: str, topic: str, kind: str | None, fields: tuple[str, ...], size: str, output: str | None
) -> None:
    """Write a topic as a table, one row a message, `time` in seconds first; or as a plot against time."""
    from kbot.record.export import Table
    from kbot.record.writer import spare_recording, spare_recordings
    from kbot.text.files import write_bytes, write_text

    if output is not None:
        spare_recording(recording, output)
        spare_recordings(output)
    kind = kind or {".svg": "svg", ".parquet": "parquet"}.get(Path(output or "").suffix.lower(), "csv")
    if kind == "parquet" and output is None:
        fail("a Parquet file is no text to print: name it with -o FILE")
    table = Table.of(recording, topic)
    if kind == "svg" and not fields:
        fail(f"a plot is of --field NAME; {topic} has {', '.join(table.numbers) or 'no numbers'}")
    table = table.only(fields)
    if kind == "parquet":
        write_bytes(str(output), table.parquet())
        return
    text = _plot(table, size) if kind == "svg" else table.csv()
    if output is None:
        click.echo(text, nl=False)
    else:
        write_text(output, text)


def _plot(table: Table, size: str) -> str:
    from kbot.cli.picture_options import parse_size
    from kbot.workbench.export.plot import Curve, plot_svg

    width, height = parse_size(size)
    if min(width, height) < SMALLEST_PLOT:
        fail(f"--size {size}: a plot has at least {SMALLEST_PLOT} pixels a side")
    curves = [Curve(name, table.column(name)) for name in table.columns[1:]]
    return plot_svg(table.times, curves, width, height)


@command.command(
    "play",
    cls=Play,
    epilog=examples(
        "kbot bag play run.mcap --foxglove",
        "kbot bag play run.bag --bridges auto -r 2 -s 10 -u 5 --loop",
        "kbot bag play run.bag --ros1 --pause --topics /scan /tf --remap /scan:=/base_scan",
        "kbot bag play robot.bag camera.bag --ros1  several, as one",
        "kbot bag play run.mcap                     then: kbot topic echo /odom",
    ),
)
@click.argument("recordings", metavar="FILE...", nargs=-1, required=True)
@click.option(
    "-s",
    "--start",
    "--start-offset",
    "start",
    type=SECONDS,
    default=0.0,
    metavar="S",
    help="Begin S seconds after its first message.",
)
@click.option(
    "-u",
    "--duration",
    "--playback-duration",
    "seconds",
    type=SECONDS,
    metavar="S",
    help="Say S seconds of it.  [default: all]",
)
@click.option(
    "-r",
    "--rate",
    type=Within(0.01, 100.0),
    default=1.0,
    show_default=True,
    metavar="X",
    help="So many times as fast.",
)
@click.option(
    "-d", "--delay", type=SECONDS, default=0.0, metavar="S", help="Wait S seconds before it begins."
)
@click.option("-l", "--loop", is_flag=True, help="Begin anew at the end, until Ctrl-C.")
@click.option(
    "-p", "--pause", "--start-paused", "paused", is_flag=True, help="Begin paused: Space lets it go on."
)
@click.option(
    "--clock", "tells_time", is_flag=True, help="As it always does: /clock is the recording's time."
)
@_topics
@click.option("--exclude-topic", "left_out", multiple=True, metavar="NAME", help="Not this; may be repeated.")
@click.option("--remap", "remaps", multiple=True, metavar="OLD:=NEW", help="Say OLD on NEW; may be repeated.")
@bridge_options
def play(
    recordings: tuple[str, ...],
    start: float,
    seconds: float | None,
    rate: float,
    delay: float,
    loop: bool,
    paused: bool,
    tells_time: bool,
    topics: tuple[str, ...],
    left_out: tuple[str, ...],
    remaps: tuple[str, ...],
    options: CompanionOptions,
) -> None:
    """Say recordings again, several as one, with /clock, to peers on bridges and to `kbot topic`.

    Options are those of `rosbag play` and `ros2 bag play`: `--topics A B` is `--topic A --topic B`, and so
    it is with `--exclude-topics`, `--remap` and `-m`; `A:=B` remaps too. In a terminal Space pauses it and
    goes on, and s lets a tenth of a second pass. Exit status 0: it came to its end, or Ctrl-C ended it.
    """
    from kbot.cli.bag.play import play as say_again
    from kbot.record.player import Player

    player = Player(
        *recordings,
        topics=topics,
        left_out=left_out,
        remaps=read_remaps(remaps),
        start=start,
        seconds=seconds,
    )
    if loop and player.length == 0.0:
        fail(f"0 s of {player.path} would be said: that leaves nothing to be said again and again")
    player.paused = paused
    say_again(player, options, rate=rate, delay=delay, loop=loop)


@command.command("replay", epilog=examples("kbot bag replay run.mcap"))
@_recording
@package_path_option
def replay(recording: str, package_path: tuple[str, ...]) -> int:
    """Do the run again with the recorded robot, world, seed and commands, and compare bit for bit.

    Exit status 0: it came out the same; 1: it did not.
    """
    from kbot.record.replay import replay as run_again
    from kbot.xacro import Packages

    if not Path(recording).exists():
        fail(f"{recording} does not exist")
    again = run_again(recording, Packages(package_path))
    state = {True: "the engine ended in the same state", False: "the engine ended in another state", None: ""}
    told = [
        again.difference or f"{again.compared} messages are the same, bit for bit",
        state[again.same_state],
    ]
    click.echo("; ".join(filter(None, told)))
    if again.left_out:
        topics = ", ".join(f"{topic} {count}" for topic, count in again.left_out.items())
        click.echo(
            f"{sum(again.left_out.values())} messages were not compared ({topics}): only the robots and the "
            "clock speak again, not sensors, nodes, programs and the recorder of the world"
        )
    return 0 if again.is_same else 1
