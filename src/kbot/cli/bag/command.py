"""The commands of `kbot bag`: inspect, cut, convert, export, play back and replay recordings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import click

from kbot.cli.arguments import (
    HOW_TO_RECORD,
    collect_options,
    examples,
    json_option,
    output_option,
    package_path_option,
    rate_option,
    seconds_option,
)
from kbot.cli.bag.play import Pace
from kbot.cli.bag.play import play as play_back
from kbot.cli.output import fail, print_json
from kbot.cli.picture_options import parse_size, size_option
from kbot.cli.run_outputs import PeerRequest, peer_options
from kbot.text.json_text import parse_json
from kbot.text.render import printable

if TYPE_CHECKING:
    from kbot.record.export import MessageTable
    from kbot.record.reader import Summary


ELSEWHERE = {
    "record": HOW_TO_RECORD,
    "reindex": "to repair an incomplete recording, use kbot bag convert FILE NEW",
    "check": "kbot bag info FILE reports whether a recording is complete",
    "filter": "use kbot bag cut FILE NEW --topic NAME --start S --end S",
    "compress": "kbot bag convert FILE NEW.mcap writes a compressed recording",
}
"""Commands of `rosbag` and `ros2 bag` that KBot does not have, and what to use instead."""

_LISTS = {
    "--topics": "--topic",
    "--exclude-topics": "--exclude-topic",
    "--remap": "--remap",
    "-m": "--remap",
}
"""Options of ROS that take several words, and KBot's option that takes one of them at a time."""


@dataclass(frozen=True, slots=True)
class _Excerpt:
    """The part of the recordings to play back (in s), the topics, and their new names."""

    start: float
    seconds: float | None
    topics: tuple[str, ...]
    left_out: tuple[str, ...]
    remaps: tuple[str, ...]


class Bag(click.Group):
    """Reports what to use instead of a command of `rosbag` or `ros2 bag` that KBot does not have."""

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        word = args[0]
        if word in ELSEWHERE:
            raise click.UsageError(f"no such command: {word}; {ELSEWHERE[word]}", ctx)
        return super().resolve_command(ctx, args)


class Play(click.Command):
    """Accepts what rosbag and ros2 bag accept: `--topics A B …` up to the next option, a plain `A:=B`, and
    `--clock` with a rate."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        words: list[str] = []
        option = before = ""
        for word, after in zip(args, [*args[1:], "-"], strict=True):
            if word.startswith("-"):
                option = _LISTS.get(word, "")
                if option and after.startswith("-"):
                    raise click.UsageError(f"{word} needs at least one value", ctx)
                words += [] if option else [word]
            elif ":=" in word:
                words += ["--remap", word]
            elif before != "--clock" or not _is_number(word):
                words += [option, word] if option else [word]
            before = word
        return super().parse_args(ctx, words)


def read_remaps(words: tuple[str, ...]) -> dict[str, str]:
    """New names by old names, from words like `/odom:=/odometry`. Raises UsageError for any other word."""
    for word in words:
        if not all(word.partition(":=")):
            raise click.UsageError(f"--remap takes OLD:=NEW, not '{word}'")
    return dict(word.split(":=", 1) for word in words)


def _is_number(word: str) -> bool:
    return word.replace(".", "", 1).isdecimal()


_WALL_CLOCK = 1e9
"""Seconds (September 2001). Later times are taken for wall-clock times, earlier ones for simulated times."""
_MAKERS = {"kbot": "KBot", "mujoco": "MuJoCo", "python": "Python", "machine": "on"}

MOST_SHOWN = 200
"""Characters of a foreign fact that are shown. rosbag2 stores all its metadata in one."""

Rows = list[tuple[str, str]]


def bag_text(path: str, found: Summary) -> str:
    """The text of `kbot bag info`: size, time span, metadata and topics, one per line."""
    lines = [f"{path}: {found.kind}, {found.count} messages over {found.seconds:.3f} s"]
    rows: Rows = [("size", _size(path))]
    if found.start is not None and found.end is not None:
        rows.append(("time", f"{_time(found.start)} to {_time(found.end)}"))
    for name, values in found.notes.items():
        rows += ((printable(label), printable(value)) for label, value in _facts(name, values))
    wide = max(len(label) for label, _ in rows)
    lines += [f"  {label:<{wide}}  {value}" for label, value in rows]
    topics = [
        (printable(name), topic.count, printable(topic.type_name))
        for name, topic in sorted(found.topics.items())
    ]
    wide = max((len(name) for name, _, _ in topics), default=0)
    lines += [f"  {name:<{wide}}  {count:>8}  {type_name}" for name, count, type_name in topics]
    lines += [
        printable(f"The messages of {name} cannot be read: {why}") for name, why in found.unusable.items()
    ]
    if found.broken:
        until = f" up to {found.end * 1e-9:.3f} s" if found.end is not None else ""
        lines.append(
            f"The recording is incomplete: {printable(found.broken)}. Its {found.count} messages{until} can "
            "be read."
        )
    return "\n".join(lines)


def _size(path: str) -> str:
    place = Path(path)
    files = [file for file in place.iterdir() if file.is_file()] if place.is_dir() else [place]
    size = float(sum(file.stat().st_size for file in files))
    for unit in ("bytes", "kB", "MB"):
        if size < 1000.0:
            return f"{size:.3g} {unit}" if unit != "bytes" else f"{size:.0f} {unit}"
        size /= 1000.0
    return f"{size:.3g} GB"


def _time(nanoseconds: int) -> str:
    seconds = nanoseconds * 1e-9
    if seconds < _WALL_CLOCK:
        return f"{seconds:.3f} s"
    return f"{datetime.fromtimestamp(seconds, UTC):%Y-%m-%d %H:%M:%S} UTC ({seconds:.3f} s)"


def _facts(name: str, values: Mapping[str, str]) -> Rows:
    """The rows of one metadata record: KBot's own in words, all others unchanged."""
    if name in ("kbot", "kbot.cut"):
        return list(_run(values, is_part=name == "kbot.cut"))
    if name == "kbot.end":
        steps, time, state = (values.get(key, "?") for key in ("steps", "time", "state_sha256"))
        return [("end", f"after {steps} steps, at {_number(time)} s, in the state {state[:12]}")]
    return [(f"{name}.{key}" if name else key, _one_line(value)) for key, value in values.items()]


def _one_line(value: str) -> str:
    text = " ".join(value.split())
    return text if len(text) <= MOST_SHOWN else f"{text[:MOST_SHOWN]}…"


def _run(values: Mapping[str, str], *, is_part: bool) -> Iterator[tuple[str, str]]:
    name, namespace, prefix = _list(values, "naming", 3)
    robot = values.get("robot", "?")
    called = f", named {name}" if name and name != robot else ""
    beneath = f", topics under /{namespace}" if namespace else ""
    framed = f", frame prefix {prefix}" if prefix else ""
    yield "robot", robot + called + beneath + framed
    yield "world", values.get("world", "?")
    x, y, yaw = (_number(value) for value in _list(values, "start", 3))
    if x:
        yield "start", f"x {x} m, y {y} m, yaw {yaw} rad"
    step, contacts = _number(values.get("timestep", "?")), values.get("contacts", "?")
    yield "physics", f"steps of {step} s, contacts {contacts}, seed {values.get('seed', '?')}"
    if is_part:
        yield "part", "cut from a longer recording"
    elif values.get("first_step", "0") != "0":
        yield "begun", f"at step {values['first_step']} of the run"
    yield "made by", ", ".join(f"{maker} {values[key]}" for key, maker in _MAKERS.items() if key in values)
    transforms = values.get("static_transforms", "[]")
    if transforms != "[]":
        yield "static", f"{len(_list(values, 'static_transforms', 0))} transforms of the launch"


def _list(values: Mapping[str, str], key: str, length: int) -> list[str]:
    """A list that is stored as JSON. If its length is wrong, `length` empty texts; 0 accepts any length."""
    try:
        found = parse_json(values.get(key, "[]"))
    except ValueError:
        found = []
    found = [str(item) for item in found] if isinstance(found, list) else []
    return found if not length or len(found) == length else [""] * length


def _number(text: str) -> str:
    try:
        return f"{float(text):g}"
    except ValueError:
        return text


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

    Exit status: 0 complete; 1 incomplete, damaged, or with messages that cannot be read.
    """
    from kbot.record import Recording  # imported lazily, so that -h stays fast

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
                "unusable": found.unusable,
                "broken": found.broken,
            }
        )
    else:
        click.echo(bag_text(recording, found))
    return int(bool(found.broken or found.unusable))


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

    The suffix of NEW selects the format: .mcap, .bag (ROS 1), or none for a rosbag2 folder.
    """
    _copy(recording, target, None, None, topics)


def _copy(
    recording: str, target: str, start: float | None, end: float | None, topics: tuple[str, ...]
) -> None:
    from kbot.record.copy import copy_recording

    copied = copy_recording(recording, target, start=start, end=end, topics=topics)
    for topic, reason in copied.left_out.items():
        click.echo(printable(f"{topic} is left out: {reason}"), err=True)
    if copied.broken:
        click.echo(f"{recording} is incomplete: {copied.broken}", err=True)
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
    help="Output format. parquet needs the extra parquet.",
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
    from kbot.record.export import MessageTable
    from kbot.record.writer import spare_recording, spare_recordings
    from kbot.text.files import write_bytes, write_text

    if output is not None:
        spare_recording(recording, output)
        spare_recordings(output)
    kind = kind or {".svg": "svg", ".parquet": "parquet"}.get(Path(output or "").suffix.lower(), "csv")
    if kind == "parquet" and output is None:
        fail("a Parquet file is binary and cannot be printed. Add -o FILE")
    table = MessageTable.of(recording, topic)
    if kind == "svg" and not fields:
        fail(
            f"a plot needs --field NAME. The numeric fields of {topic}: "
            + (", ".join(table.numbers) or "none")
        )
    table = table.only(fields)
    if kind == "parquet":
        write_bytes(str(output), table.parquet())
        return
    text = _plot(table, size) if kind == "svg" else table.csv()
    if output is None:
        click.echo(text, nl=False)
    else:
        write_text(output, text)


def _plot(table: MessageTable, size: str) -> str:
    from kbot.render.plot import Curve, plot_svg

    width, height = parse_size(size)
    if min(width, height) < SMALLEST_PLOT:
        fail(f"--size {size}: width and height of a plot must be at least {SMALLEST_PLOT} pixels")
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
@click.option("--clock", is_flag=True, expose_value=False, help="Has no effect: /clock is always published.")
@_topics
@click.option(
    "--exclude-topic", "left_out", multiple=True, metavar="NAME", help="Topic to leave out. Can be repeated."
)
@click.option(
    "--remap", "remaps", multiple=True, metavar="OLD:=NEW", help="Publish OLD as NEW. Can be repeated."
)
@peer_options
@collect_options("excerpt", _Excerpt)
@collect_options("pace", Pace)
def play(
    recordings: tuple[str, ...],
    excerpt: _Excerpt,
    pace: Pace,
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
    from kbot.record.player import Player

    player = Player(
        *recordings,
        topics=excerpt.topics,
        left_out=excerpt.left_out,
        remaps=read_remaps(excerpt.remaps),
        start=excerpt.start,
        seconds=excerpt.seconds,
    )
    if pace.loop and player.length == 0.0:
        fail(f"--loop has nothing to repeat: the selected part of {player.path} lasts 0 s")
    play_back(player, peers, pace)


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
    state = {
        True: "the engine ended in the same state",
        False: "the engine ended in a different state",
        None: "",
    }
    result = [
        again.difference or f"{again.compared} messages are the same, bit for bit",
        state[again.same_state],
    ]
    click.echo("; ".join(filter(None, result)))
    if again.left_out:
        topics = printable(", ".join(f"{topic} {count}" for topic, count in again.left_out.items()))
        click.echo(
            f"{sum(again.left_out.values())} messages were not compared ({topics}): a replay repeats only "
            "the robots and the clock, not sensors, nodes, programs and recorded world states"
        )
    return 0 if again.is_same else 1
