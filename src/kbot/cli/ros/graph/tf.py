"""`kbot tf`: print the coordinate frames of a running KBot."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

import click

from kbot.cli.arguments import examples, json_option, rate_option
from kbot.cli.output import fail, print_json
from kbot.cli.ros.graph.common import at_option, connect, print_waiting_note, seconds, to_line
from kbot.text.suggest import did_you_mean

if TYPE_CHECKING:
    from kbot.kinematics.transform import Transform
    from kbot.ros.graph.client import GraphClient

TOPICS = ("/tf_static", "/tf")
TREE_SECONDS = 1.0
"""Seconds for which `tree` collects frames."""
KNOWN_SECONDS = 0.5
"""Seconds within which every moving frame is published: KBot publishes /tf at 50 Hz, and at 10 Hz if a
joint_state_publisher moves the joints."""


@click.group("tf", epilog=examples("kbot tf tree", "kbot tf echo odom base_link --once"))
def command() -> None:
    """Print the coordinate frames of a running KBot, from /tf and /tf_static.

    Start KBot first, for example `kbot sim kbot` in another terminal.
    """


@command.command("tree", epilog=examples("kbot tf tree"))
@json_option
@at_option
def tree(as_json: bool, at: str) -> None:
    """Print the tree of frames.

    The command subscribes to /tf and /tf_static for one second and prints the frames that it
    receives.
    """
    frames = _Frames()
    with connect(at) as graph:
        for topic, message in graph.messages(*_tf_topics(graph.topics()), seconds=TREE_SECONDS):
            frames.add(topic, message)
    if as_json:
        print_json(
            {child: {"parent": p, "static": child in frames.static} for child, p in frames.parents.items()}
        )
        return
    roots = [name for name in frames.names() if name not in frames.parents]
    for root in sorted(roots):
        click.echo("\n".join(frames.lines(root, 0)))


@command.command("echo", epilog=examples("kbot tf echo odom base_link --rate 5"))
@click.argument("frame")
@click.argument("child")
@rate_option(100.0, "Printing rate in Hz (wall-clock time).")
@click.option("--once", is_flag=True, help="Print one pose and exit.")
@json_option
@at_option
def echo(frame: str, child: str, rate: float, once: bool, as_json: bool, at: str) -> None:
    """Print the pose of CHILD in FRAME until Ctrl-C, like tf2_echo.

    The pose is a translation in m and a rotation, as a quaternion (x, y, z, w) and as roll, pitch, yaw.
    """
    frames = _Frames()
    with connect(at) as graph:
        due = 0.0
        for topic, message in _messages_with(graph, frames, frame, child):
            frames.add(topic, message)
            now = time.monotonic()
            found = frames.between(frame, child)
            if found is None or now < due:
                continue
            due = now + 1.0 / rate
            click.echo(to_line(_plain(frames.stamp, found)) if as_json else _text(frames.stamp, found))
            if once:
                return


def _messages_with(
    graph: GraphClient, frames: _Frames, frame: str, child: str
) -> Iterator[tuple[str, dict[str, Any]]]:  # Any: messages as JSON
    """The messages of /tf and /tf_static, endlessly. The caller adds each to `frames`.

    Raises:
        KbotError: after `KNOWN_SECONDS` one of the two frames is unknown, or they are not connected.
    """
    began, topics = graph.nanoseconds(), _tf_topics(graph.topics())
    yield from graph.messages(*topics, seconds=KNOWN_SECONDS)
    if "/tf" in topics and not frames.has_moving:
        print_waiting_note(graph, began, "/tf")
        for message in graph.receive():
            yield message
            if frames.has_moving:
                break
        yield from graph.receive(KNOWN_SECONDS)
    if frames.between(frame, child) is None:
        _fail_without(frames, frame, child)
    yield from graph.receive()


class _Frames:
    """The frames received so far: the parent of each, and its pose in the parent."""

    def __init__(self) -> None:
        self.parents: dict[str, str] = {}
        self.static: set[str] = set()
        self.stamp = 0.0
        self.has_moving = False
        """Whether a frame was received on /tf."""
        self._poses: dict[str, Transform] = {}

    def add(self, topic: str, message: dict[str, Any]) -> None:
        # imported lazily: it loads numpy, which -h does not need
        from kbot.kinematics.transform import Transform

        for item in message["transforms"]:
            child, transform = item["child_frame_id"], item["transform"]
            q, t = transform["rotation"], transform["translation"]
            self.parents[child] = item["header"]["frame_id"]
            self._poses[child] = Transform.from_quaternion_xyzw(
                (q["x"], q["y"], q["z"], q["w"]), (t["x"], t["y"], t["z"])
            )
            if topic == "/tf_static":
                self.static.add(child)
            else:
                self.has_moving = True
                self.stamp = seconds(item["header"]["stamp"])

    def names(self) -> list[str]:
        return list(dict.fromkeys([*self.parents.values(), *self.parents]))

    def between(self, frame: str, child: str) -> Transform | None:
        """`frame_from_child`, or None while the two frames are not connected."""
        first, second = self._to_root(frame), self._to_root(child)
        if first is None or second is None or first[0] != second[0]:
            return None
        return first[1].inverse() @ second[1]

    def lines(self, frame: str, depth: int) -> list[str]:
        mark = " (static)" if frame in self.static else ""
        children = sorted(child for child, parent in self.parents.items() if parent == frame)
        # received frames may form a loop: the limit ends it
        below = [line for child in children for line in self.lines(child, depth + 1)] if depth < 100 else []
        return ["  " * depth + frame + mark, *below]

    def _to_root(self, frame: str) -> tuple[str, Transform] | None:
        from kbot.kinematics.transform import Transform  # imported lazily, so that -h stays fast

        if frame not in self.names():
            return None
        root_from_frame, name = Transform.identity(), frame
        for _ in self.parents:
            if name not in self.parents:
                break
            root_from_frame = self._poses[name] @ root_from_frame
            name = self.parents[name]
        return name, root_from_frame


def _tf_topics(topics: dict[str, str]) -> list[str]:
    found = [topic for topic in TOPICS if topic in topics]
    return found or fail("this KBot does not publish /tf or /tf_static")


def _fail_without(frames: _Frames, *wanted: str) -> None:
    for name in wanted:
        if name not in frames.names():
            hint = did_you_mean(name, frames.names()) or f"KBot's frames are {', '.join(frames.names())}"
            fail(f"there is no frame '{name}': {hint}")
    fail(f"the frames '{wanted[0]}' and '{wanted[1]}' are not connected. Print the tree with: kbot tf tree")


def _plain(stamp: float, pose: Transform) -> dict[str, object]:
    return {
        "time": stamp,
        "translation": pose.translation.tolist(),
        "quaternion": list(pose.quaternion_xyzw),
        "rpy": list(pose.rpy),
    }


def _text(stamp: float, pose: Transform) -> str:
    """The pose in tf2_echo's format."""

    def row(values: Iterable[float], digits: int = 3) -> str:
        return ", ".join(f"{value:.{digits}f}" for value in values)

    return (
        f"At time {stamp:.3f}\n"
        f"- Translation: [{row(pose.translation.tolist())}]\n"
        f"- Rotation: in Quaternion [{row(pose.quaternion_xyzw)}]\n"
        f"- Rotation: in RPY (radian) [{row(pose.rpy)}]\n"
        f"- Rotation: in RPY (degree) [{row([math.degrees(angle) for angle in pose.rpy])}]"
    )
