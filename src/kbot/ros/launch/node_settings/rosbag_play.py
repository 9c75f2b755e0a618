"""Reads the settings of rosbag play and ros2 bag play: which recordings are played back, and how."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from kbot.ros import names
from kbot.ros.launch.node_arguments import Options, place_of, place_of_value, read_options
from kbot.ros.launch.plan import PlannedNode
from kbot.ros.nodes.playing import Playing
from kbot.text import Diagnostic, Severity

_ROS1: Mapping[str, int] = {
    **dict.fromkeys(("-q", "--quiet", "-i", "--immediate", "--pause", "--clock", "-l", "--loop"), 0),
    **dict.fromkeys(("-k", "--keep-alive", "--try-future-version", "--skip-empty-bags"), 0),
    **dict.fromkeys(("--wait-for-subscribers", "--bags-only"), 0),
    **dict.fromkeys(("--queue", "--hz", "-d", "--delay", "-r", "--rate", "-s", "--start"), 1),
    **dict.fromkeys(("-u", "--duration", "--skip-empty", "--rate-control-topic"), 1),
    **dict.fromkeys(("--rate-control-max-delay", "-p", "--prefix"), 1),
    **dict.fromkeys(("--topics", "--pause-topics", "--bags"), -1),
}
_ROS2: Mapping[str, int] = {
    **dict.fromkeys(("-l", "--loop", "-p", "--start-paused", "--clock", "--clock-topics-all"), 0),
    **dict.fromkeys(("--disable-keyboard-controls", "--disable-loan-message", "--wait-for-all-acked"), 0),
    **dict.fromkeys(("-s", "--storage", "-r", "--rate", "-d", "--delay", "--start-offset"), 1),
    **dict.fromkeys(("--playback-duration", "--read-ahead-queue-size", "-e", "--regex", "--log-level"), 1),
    **dict.fromkeys(("--qos-profile-overrides-path", "--storage-config-file", "-i", "--input"), 1),
    **dict.fromkeys(("--topics", "--exclude-topics", "-m", "--remap", "-x", "--exclude"), -1),
}
SLOWEST, FASTEST = 0.01, 100.0
"""Rates, as `kbot bag play` has them."""
LONGEST = 1e9
"""Seconds that an option may give."""
_SUFFIXES = (".bag", ".mcap", ".db3")
_PAUSES = ("--pause", "--start-paused", "-p")
_NOT_DONE: Mapping[str, str] = {
    "--clock": "KBot tells the time",
    "--rate-control-topic": "the rate is that of --rate",
    "--pause-topics": "it goes on",
    "--regex": "topics are named one by one",
    "-x": "topics are chosen by --topics",
    "--exclude": "topics are chosen by --topics",
    "--exclude-topics": "topics are chosen by --topics",
}


def read_playing(node: PlannedNode, *, can_wait: bool = False) -> tuple[Playing | None, list[Diagnostic]]:
    """What a player of ROS 1 (rosbag play) or of ROS 2 (ros2 bag play) would say; None where no recording is
    there. `can_wait`: whether something lets one that is paused go on."""
    is_ros_2 = node.package != "rosbag"
    options = read_options(node, _ROS2 if is_ros_2 else _ROS1)
    words = [word for word in options.rest[2 if is_ros_2 else 0 :] if not word.startswith("__")]
    remaps = dict(node.remaps)
    said = (*words, *_given(options, "-m", "--remap"))
    remaps |= dict(word.split(":=", 1) for word in said if ":=" in word)
    named = [word for word in words if ":=" not in word and not _is_number(word)]
    named += [*_given(options, "--bags"), *_given(options, "-i", "--input")]
    topics = list(_given(options, "--topics"))
    if not named and topics:  # argparse takes a bag after --topics for a topic, and so the bag is last
        named = [topic for topic in topics if topic.endswith(_SUFFIXES)]
        topics = [topic for topic in topics if topic not in named]
    pauses = next((option for option in (_PAUSES if is_ros_2 else _PAUSES[:1]) if options.has(option)), "")
    for option, why in (_NOT_DONE if can_wait else {**_NOT_DONE, pauses: "it begins at once"}).items():
        if option and options.has(option):
            options.notes.append(
                Diagnostic("L063", Severity.INFO, f"{option}: {why}", place_of(node, option))
            )
    missing = [path for path in named if not Path(path).exists()]
    if missing or not named:
        options.notes.append(_nothing(node, missing))
        return None, options.notes
    ahead = ("--start-offset",) if is_ros_2 else ("--start", "-s")
    keeps_on = options.has("-k", "--keep-alive")
    return Playing(
        paths=tuple(named),
        origin=node.origin,
        rate=_bounded(options, ("--rate", "-r"), 1.0, SLOWEST, FASTEST, "times"),
        start=_bounded(options, ahead, 0.0, 0.0, LONGEST, "seconds"),
        seconds=_duration(options, is_ros_2),
        delay=_bounded(options, ("--delay", "-d"), 0.0, 0.0, LONGEST, "seconds") + node.delay,
        loop=options.has("-l", "--loop"),
        topics=tuple(_absolute(topic) for topic in topics),
        remaps={_absolute(source): _absolute(target) for source, target in remaps.items()},
        prefix="" if is_ros_2 else (options.text("--prefix", "-p") or "").strip("/"),
        required=node.required and not keeps_on,
        paused=can_wait and bool(pauses),
    ), options.notes


def _given(options: Options, *names: str) -> tuple[str, ...]:
    return tuple(word for name in names for word in options.given.get(name, ()))


def _bounded(
    options: Options, names: tuple[str, ...], default: float, low: float, high: float, unit: str
) -> float:
    """The number that the first of these options gives; what is out of its bounds is a note, and the
    default."""
    name = next((name for name in names if options.has(name)), names[0])
    value = options.number(name, default)
    if low <= value <= high:
        return value
    options.notes.append(_refused(options, name, f"{name} is from {low:g} to {high:g} {unit}, not {value:g}"))
    return default


def _duration(options: Options, is_ros_2: bool) -> float | None:
    """Seconds that are said, None for all: so does ROS 2 take a number below zero."""
    names = ("--playback-duration",) if is_ros_2 else ("--duration", "-u")
    name = next((name for name in names if options.has(name)), None)
    if name is None:
        return None
    least = -LONGEST if is_ros_2 else 0.0
    seconds = _bounded(options, (name,), -1.0, least, LONGEST, "seconds")
    if seconds == 0.0 and options.has("-l", "--loop"):
        options.notes.append(_refused(options, name, f"{name} 0 leaves nothing to be said again and again"))
        return None
    return seconds if seconds >= 0.0 else None


def _refused(options: Options, name: str, message: str) -> Diagnostic:
    where = place_of_value(options.node, name)
    return Diagnostic("L062", Severity.ERROR, message, where, "the player refuses it")


def _is_number(word: str) -> bool:
    """What follows `--clock`, whose rate may be left out."""
    return word.replace(".", "", 1).isdecimal()


def _absolute(topic: str) -> str:
    return names.canonical(f"/{topic}")


def _nothing(node: PlannedNode, missing: list[str]) -> Diagnostic:
    what = f"the recording {missing[0]} is not there" if missing else "no recording is named"
    where = place_of(node, missing[0]) if missing else node.spans.get("args", node.origin)
    severity = Severity.ERROR if node.required else Severity.WARNING
    return Diagnostic("L059", severity, f"{what}: {node.full_name} says nothing", where)
