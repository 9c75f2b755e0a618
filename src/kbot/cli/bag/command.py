"""`kbot bag`: what is in a recording, parts of it, other formats, tables; said and done again."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from kbot.cli.arguments import examples, json_option, output_option, package_path_option
from kbot.cli.bag.words import Bag, Play, read_remaps
from kbot.cli.numbers import rate_option, seconds_option
from kbot.cli.output import fail, print_json
from kbot.cli.outputs import PeerRequest, peer_options
from kbot.cli.picture_options import parse_size, size_option

if TYPE_CHECKING:
    from kbot.record.export import Table

SMALLEST_PLOT = 200


@click.group(
    "bag",
    cls=Bag,
    epilog=examples(
        "kbot bag info run.mcap",
        "kbot bag cut run.mcap part.mcap --start 2 --end 5 --topic /odom",
        ("kbot bag convert run.mcap run.bag", "convert for ROS 1"),
        ("kbot bag play run.mcap --ros1", "play back to rostopic and rviz"),
        ("kbot bag replay run.mcap", "repeat the run and compare"),
        "kbot bag export run.mcap --topic /odom -o odom.csv",
    ),
)
def command() -> None:
    """Inspect, cut, convert, play back or replay recordings: .mcap, .bag (ROS 1) or rosbag2 folders."""


def _recording(function: click.decorators.FC) -> click.decorators.FC:
    return click.argument("recording", metavar="FILE")(function)


def _topics(function: click.decorators.FC) -> click.decorators.FC:
    return click.option(
        "--topic",
        "topics",
        multiple=True,
        metavar="NAME",
        show_default="all topics",
        help="Topic to include. Can be repeated.",
    )(function)


@command.command("info", epilog=examples("kbot bag info run.mcap --json"))
@_recording
@json_option
def info(recording: str, as_json: bool) -> int:
    """Print what a recording contains and whether it is complete.

    Exit status: 0 complete; 1 incomplete or damaged.
    """
    from kbot.cli.bag.info import bag_text  # lazy in this module: -h is fast
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
@seconds_option(
    "--start", show_default="first message", help="Start of the part, in seconds of the recording's clock."
)
@seconds_option(
    "--end", show_default="last message", help="End of the part, in seconds of the recording's clock."
)
@_topics
def cut(recording: str, target: str, start: float | None, end: float | None, topics: tuple[str, ...]) -> None:
    """Write a part of a recording to a new recording.

    `kbot bag info` prints when a recording starts and ends.
    """
    _copy(recording, target, start, end, topics)


@command.command("convert", epilog=examples("kbot bag convert run.mcap run.bag"))
@_recording
@click.argument("target", metavar="NEW")
@_topics
def convert(recording: str, target: str, topics: tuple[str, ...]) -> None:
    """Convert a recording to another format.

    The suffix of NEW selects it: .mcap, .bag (ROS 1), or none for a rosbag2 folder.
    """
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
        "kbot bag export run.mcap --topic /odom --field twist.twist.linear.x -o v.svg",
    ),
)
@_recording
@click.option("--topic", required=True, metavar="NAME", help="Topic to export.")
@click.option(
    "--to",
    "kind",
    type=click.Choice(["csv", "parquet", "svg"]),
    show_default="by the suffix of OUT, else csv",
    help="Output format. parquet needs pip install 'kbot[parquet]'.",
)
@click.option(
    "--field",
    "fields",
    multiple=True,
    metavar="NAME",
    show_default="all fields",
    help="Field to export. Can be repeated. A plot needs at least one.",
)
@size_option("1000x400")
@output_option("--output")
def export(
    recording: str, topic: str, kind: str | None, fields: tuple[str, ...], size: str, output: str | None
) -> None:
    """Write a topic as a table or as a plot over time.

    A table (csv, parquet) has one row per message. Its first column is the time in seconds. A plot (svg)
    has one curve per field.
    """
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
    from kbot.render.plot import Curve, plot_svg

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
        ("kbot bag play run.mcap", "then: kbot topic echo /odom"),
        ("kbot bag play robot.bag camera.bag --ros1", "several recordings as one"),
        "kbot bag play run.bag --bridges auto -r 2 -s 10 -u 5 --loop",
        "kbot bag play run.bag --ros1 --topics /scan /tf --remap /scan:=/base_scan",
    ),
)
@click.argument("recordings", metavar="FILE...", nargs=-1, required=True)
@seconds_option(
    "-s",
    "--start",
    "--start-offset",
    "start",
    default=0.0,
    show_default=True,
    help="Seconds to skip at the start.",
)
@seconds_option(
    "-u",
    "--duration",
    "--playback-duration",
    "seconds",
    show_default="to the end",
    help="Seconds of the recording to play back.",
)
@rate_option(100.0, "Speed of the playback, as a factor.", metavar="X")
@seconds_option(
    "-d", "--delay", default=0.0, show_default=True, help="Seconds to wait before the playback starts."
)
@click.option("-l", "--loop", is_flag=True, help="Repeat the playback until Ctrl-C.")
@click.option("-p", "--pause", "--start-paused", "paused", is_flag=True, help="Start paused.")
@click.option("--clock", "tells_time", is_flag=True, help="Has no effect: /clock is always published.")
@_topics
@click.option(
    "--exclude-topic", "left_out", multiple=True, metavar="NAME", help="Topic to leave out. Can be repeated."
)
@click.option(
    "--remap", "remaps", multiple=True, metavar="OLD:=NEW", help="Publish OLD as NEW. Can be repeated."
)
@peer_options
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
    peers: PeerRequest | None,
) -> None:
    """Play back recordings to connected peers, with /clock.

    The bridge options select the peers. `kbot topic` receives the messages with or without a bridge.
    Several recordings are played back as one.

    In a terminal, Space pauses and resumes, and s advances by 0.1 s. Ctrl-C stops the playback with exit
    status 0.

    The options of `rosbag play` and `ros2 bag play` work too: `--topics A B` and `--exclude-topics A B`
    take several topics. `-m OLD:=NEW` and a plain `OLD:=NEW` are the same as --remap.
    """
    from kbot.cli.bag.play import play as play_back
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
    play_back(player, peers, rate=rate, delay=delay, loop=loop)


@command.command("replay", epilog=examples("kbot bag replay run.mcap"))
@_recording
@package_path_option
def replay(recording: str, package_path: tuple[str, ...]) -> int:
    """Repeat a recorded run and compare it bit for bit.

    KBot simulates the recorded robot in the recorded world, with the recorded seed and commands.

    Exit status: 0 the runs are the same; 1 they differ.
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
