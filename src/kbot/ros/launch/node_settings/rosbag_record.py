"""Reads the settings of rosbag record and ros2 bag record: the topics and the file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime

from kbot.ros.launch.node_arguments import Options, place_of, read_options
from kbot.ros.launch.plan import PlannedNode
from kbot.text import Diagnostic, Severity

_ROS1: Mapping[str, int] = {
    **dict.fromkeys(("-a", "--all", "-j", "--bz2", "--lz4", "-q", "--quiet", "-p", "--publish"), 0),
    **dict.fromkeys(("--split", "--repeat-latched", "--tcpnodelay", "--udp"), 0),
    **dict.fromkeys(("-O", "--output-name", "-o", "--output-prefix", "-b", "--buffsize", "--chunksize"), 1),
    **dict.fromkeys(("-l", "--limit", "--min-space", "--node", "--duration", "--size", "--max-splits"), 1),
    **dict.fromkeys(("-e", "--regex"), 0),
    **dict.fromkeys(("-x", "--exclude"), 1),
}
_ROS2: Mapping[str, int] = {
    **dict.fromkeys(("-a", "--all", "--include-hidden-topics", "--use-sim-time", "--no-discovery"), 0),
    **dict.fromkeys(("-o", "--output", "-s", "--storage", "-e", "--regex", "-x", "--exclude"), 1),
    **dict.fromkeys(("-d", "--max-bag-duration", "-b", "--max-bag-size", "--max-cache-size"), 1),
    **dict.fromkeys(("--compression-mode", "--compression-format", "-f", "--serialization-format"), 1),
    "--topics": -1,
}
_NO_EFFECT = ("-e", "--regex", "-x", "--exclude", "--node", "--duration", "--split", "-l", "--limit")


@dataclass(frozen=True, slots=True)
class RecordRequest:
    """The file and the topics of a recording. Without topics, it has all topics."""

    path: str
    topics: tuple[str, ...]


def read_recording(node: PlannedNode, now: datetime) -> tuple[RecordRequest, list[Diagnostic]]:
    """What a node of rosbag record (ROS 1) or a process of ros2 bag record (ROS 2) would record.

    If the arguments do not name the file, its name is made from `now`, as those programs do.
    """
    ros2 = node.package != "rosbag"
    options = read_options(node, _ROS2 if ros2 else _ROS1)
    words = options.rest[2:] if ros2 else options.rest
    topics = [*words, *options.given.get("--topics", ())]
    for option in _NO_EFFECT:
        if options.has(option):
            message = f"{option} has no effect: KBot records the named topics from start to end"
            options.notes.append(Diagnostic("L063", Severity.WARNING, message, place_of(node, option)))
    chosen = () if options.has("-a", "--all", "-e", "--regex") else tuple(topics)
    path = _rosbag2(options, now) if ros2 else _bag(options, now)
    return RecordRequest(path, tuple(f"/{t.lstrip('/')}" for t in chosen if ":=" not in t)), options.notes


def _bag(options: Options, now: datetime) -> str:
    stamp = now.strftime("%Y-%m-%d-%H-%M-%S")
    prefix = options.text("-o", "--output-prefix")
    name = options.text("-O", "--output-name") or (f"{prefix}_{stamp}" if prefix else stamp)
    return name if name.endswith(".bag") else f"{name}.bag"


def _rosbag2(options: Options, now: datetime) -> str:
    return options.text("-o", "--output") or now.strftime("rosbag2_%Y_%m_%d-%H_%M_%S")
