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
"""The limits of the rate, the same as in `kbot bag play`."""
LONGEST = 1e9
"""The largest number of seconds in an option, about 32 years."""
_SUFFIXES = (".bag", ".mcap", ".db3")
_PAUSES = ("--pause", "--start-paused", "-p")
_NO_EFFECT: Mapping[str, str] = {
    "--clock": "KBot itself publishes /clock",
    "--rate-control-topic": "set the rate with --rate",
    "--pause-topics": "playback does not pause",
    "--regex": "select topics with --topics",
    "-x": "select topics with --topics",
    "--exclude": "select topics with --topics",
    "--exclude-topics": "select topics with --topics",
}


def read_playing(node: PlannedNode, *, can_pause: bool = False) -> tuple[Playing | None, list[Diagnostic]]:
    """What a node of rosbag play (ROS 1) or a process of ros2 bag play (ROS 2) would play back. None if its
    recording does not exist. `can_pause` is whether something can continue a paused playback."""
    is_ros_2 = node.package != "rosbag"
    options = read_options(node, _ROS2 if is_ros_2 else _ROS1)
    words = [word for word in options.rest[2 if is_ros_2 else 0 :] if not word.startswith("__")]
    remaps = dict(node.remaps)
    remap_words = (*words, *_given(options, "-m", "--remap"))
    remaps |= dict(word.split(":=", 1) for word in remap_words if ":=" in word)
    named = [word for word in words if ":=" not in word and not _is_number(word)]
    named += [*_given(options, "--bags"), *_given(options, "-i", "--input")]
    topics = list(_given(options, "--topics"))
    if not named and topics:  # argparse reads a bag after --topics as a topic
        named = [topic for topic in topics if topic.endswith(_SUFFIXES)]
        topics = [topic for topic in topics if topic not in named]
    pauses = next((option for option in (_PAUSES if is_ros_2 else _PAUSES[:1]) if options.has(option)), "")
    for option, why in (
        _NO_EFFECT if can_pause else {**_NO_EFFECT, pauses: "playback starts at once"}
    ).items():
        if option and options.has(option):
            options.notes.append(
                Diagnostic("L063", Severity.INFO, f"{option} has no effect: {why}", place_of(node, option))
            )
    missing = [path for path in named if not Path(path).exists()]
    if missing or not named:
        options.notes.append(_no_recording(node, missing))
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
        paused=can_pause and bool(pauses),
    ), options.notes


def _given(options: Options, *names: str) -> tuple[str, ...]:
    return tuple(word for name in names for word in options.given.get(name, ()))


def _bounded(
    options: Options, names: tuple[str, ...], default: float, low: float, high: float, unit: str
) -> float:
    """The number of the first of these options that is given. For a number out of range, adds a note and
    returns the default."""
    name = next((name for name in names if options.has(name)), names[0])
    value = options.number(name, default)
    if low <= value <= high:
        return value
    options.notes.append(
        _rejected(options, name, f"{name} must be {low:g} to {high:g} {unit}, not {value:g}")
    )
    return default


def _duration(options: Options, is_ros_2: bool) -> float | None:
    """The seconds to play back. None means all, which ROS 2 also writes as a negative number."""
    names = ("--playback-duration",) if is_ros_2 else ("--duration", "-u")
    name = next((name for name in names if options.has(name)), None)
    if name is None:
        return None
    least = -LONGEST if is_ros_2 else 0.0
    seconds = _bounded(options, (name,), -1.0, least, LONGEST, "seconds")
    if seconds == 0.0 and options.has("-l", "--loop"):
        options.notes.append(_rejected(options, name, f"{name} 0 with --loop plays nothing"))
        return None
    return seconds if seconds >= 0.0 else None


def _rejected(options: Options, name: str, message: str) -> Diagnostic:
    where = place_of_value(options.node, name)
    return Diagnostic("L062", Severity.ERROR, message, where, "the player rejects it")


def _is_number(word: str) -> bool:
    """Whether a word is a number: the rate after `--clock`, which can be missing."""
    return word.replace(".", "", 1).isdecimal()


def _absolute(topic: str) -> str:
    return names.canonical(f"/{topic}")


def _no_recording(node: PlannedNode, missing: list[str]) -> Diagnostic:
    what = f"the recording {missing[0]} does not exist" if missing else "the node does not name a recording"
    where = place_of(node, missing[0]) if missing else node.spans.get("args", node.origin)
    severity = Severity.ERROR if node.required else Severity.WARNING
    return Diagnostic("L059", severity, f"{what}: {node.full_name} plays nothing", where)
