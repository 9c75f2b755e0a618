"""The path of a recorded robot, over the whole recording."""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator
from dataclasses import dataclass

from kbot.kinematics.transform import Transform
from kbot.messages import Odometry, TFMessage
from kbot.messages.types import WORLD
from kbot.model import RobotModel
from kbot.record.entry import RecordedMessage
from kbot.record.formats import read_fields
from kbot.record.recorder import COMMANDS_TOPIC
from kbot.record.world_recorder import POSES_TOPIC
from kbot.text.json_text import parse_json
from kbot.tf.foreign_frames import MAP, read_transform
from kbot.workbench.playback.recorded_run import TF, RecordedRun, RecordedState
from kbot.workbench.timeline.driven_paths import DrivenPath, TrailPoint

MOST_PLACES = 3000
"""Most points of a path that are read."""
Finding = Generator[None, None, list[TrailPoint]]
"""A path that is being read. The caller can pause at each `None`."""
FINEST = 0.05
"""Least seconds between two points."""
PIECE = 1.0
"""Seconds that are read in one step."""
LONG_SILENCE = 60
"""Steps without a message after which reading skips to the next message."""
FASTEST = 30.0
"""Highest speed of a robot in m/s. A longer distance was not driven."""
QUICKEST, ASIDE = 5.0, 0.1
"""Highest acceleration in m/s², and tolerance in m of the distance that odometry reports."""
PUTS = frozenset({"place", "reset", "reset_world", "restore", "set_model_state", "set_pose"})
"""Actions in a simulation's journal that move a robot to another place."""


def world_from_root(
    run: RecordedRun, robot: RobotModel, recorded: RecordedState, truth: Transform | None
) -> Transform:
    """Return the recorded true pose of the robot, otherwise its pose on tf. Odometry starts at
    `run.start`."""
    if truth is not None:
        return truth
    top, pose = recorded.top_from(robot.root)
    return pose if top in (WORLD, MAP) else run.start @ pose


@dataclass(frozen=True, slots=True)
class PathPoint:
    """The robot's position at a time, in nanoseconds of the recording's clock (`at`) and of the message
    stamps (`stamp`).

    `speed` is by odometry in m/s, nan before the first odometry. `put` means that the journal reports a move
    to this place.
    """

    at: int
    stamp: int
    xy: tuple[float, float]
    speed: float
    put: bool


class RecordedPath:
    """The path of a recording. It is read when it is first requested."""

    def __init__(self, run: RecordedRun, robot: RobotModel) -> None:
        self._run, self._robot = run, robot
        self._known: list[TrailPoint] | None = None

    def __call__(self, spacing: float) -> Finding:
        """Return the points of the path in m, at least `spacing` apart."""
        if self._known is None:
            self._known = yield from _found(self._run, self._robot, spacing)
        return self._known


def _found(run: RecordedRun, robot: RobotModel, spacing: float) -> Finding:
    places = []
    for piece in _places(run, robot):
        places += piece
        yield
    # KBot's own recordings have a journal of moves. Their odometry does not notice pushes, so its speed is
    # not used.
    has_speeds = not run.facts and any(place.speed > 0.0 for place in places)
    way, before = DrivenPath(0, 0.0), None
    for place in places:
        is_jump = before is not None and (place.put or _was_put(before, place, has_speeds))
        way.add((place.at - run.index.start) * 1e-9, *place.xy, spacing, is_jump)
        before = place
    return way.points


def _places(run: RecordedRun, robot: RobotModel) -> Iterator[list[PathPoint]]:
    """Yield the points in each piece of the recording."""
    index = run.index
    moves = [POSES_TOPIC] if POSES_TOPIC in run.topics else _transforms(run)
    topics, name = [COMMANDS_TOPIC, *moves, *run.odometry], _name(run, robot)
    recorded, speed = RecordedState(robot), math.nan
    for message in run.statics:
        recorded.receive(message)
    every = max(round(FINEST * 1e9), (index.end - index.start) // MOST_PLACES)
    last, put, due, due_speed, after = index.start, -1, index.start, index.start, index.start - 1
    silent = 0
    while after < index.end:
        until, found = min(after + round(PIECE * 1e9), index.end), []
        silent += 1
        for entry in index.between(topics, after, until):
            now, silent = entry.nanoseconds, 0
            if entry.topic == COMMANDS_TOPIC:
                put = now if _puts(entry, name) else put
            elif entry.topic in run.odometry:
                if now >= due_speed:
                    due_speed, speed = now + every, _speed(run.read(entry))
            elif now >= due or entry.topic != POSES_TOPIC:
                message = run.read(entry)
                recorded.receive(message)
                if now < due or message is None:
                    continue
                due = now + every
                truth = _truth(message, robot.root) if entry.topic == POSES_TOPIC else None
                x, y, _ = world_from_root(run, robot, recorded, truth).translation
                # an action at the same time as a point may have happened before or after it
                found.append(PathPoint(now, _stamp(message), (float(x), float(y)), speed, put >= last))
                last = now
        after = until
        yield found
        if silent == LONG_SILENCE:  # for example after a message with a stamp of another clock
            following = next(iter(index.between(topics, after, index.end)), None)
            after, silent = index.end if following is None else following.nanoseconds - 1, 0


def _name(run: RecordedRun, robot: RobotModel) -> str:
    """Return the robot's name in the simulation."""
    try:
        name, *_ = parse_json(run.facts["naming"])
    except (KeyError, ValueError, TypeError):
        name = ""
    return str(name) or robot.name


def _puts(entry: RecordedMessage, robot: str) -> bool:
    """Return whether a journal entry moved the robot to another place."""
    note = read_fields(entry)
    return note.get("do") in PUTS and note.get("robot", note.get("model", robot)) == robot


def _was_put(before: PathPoint, now: PathPoint, has_speeds: bool) -> bool:
    """Return whether the robot cannot have driven from one point to the next.

    That is the case if it is faster than any robot or, with `has_speeds`, than its own odometry. Messages
    that arrived late have stamps that are further apart, so the longer time counts.
    """
    away, seconds = math.dist(before.xy, now.xy), (now.at - before.at) * 1e-9
    if away > FASTEST * seconds:
        return True
    speed = max(before.speed, now.speed)
    if not has_speeds or math.isnan(speed):
        return False
    driving = max(seconds, (now.stamp - before.stamp) * 1e-9)
    return away > speed * driving + QUICKEST * seconds**2 + ASIDE


def _speed(odometry: object) -> float:
    """Return the speed over the ground in m/s, or nan if it is unknown."""
    if not isinstance(odometry, Odometry):
        return math.nan
    linear = odometry.twist.twist.linear
    speed = math.hypot(linear.x, linear.y)
    return speed if math.isfinite(speed) else math.nan


def _stamp(message: TFMessage) -> int:
    return max((stamped.header.stamp.nanoseconds for stamped in message.transforms), default=0)


def _transforms(run: RecordedRun) -> list[str]:
    return [name for name in run.of_robot if run.index.topics[name] == TF]


def _truth(message: TFMessage, root: str) -> Transform | None:
    found = (read_transform(stamped) for stamped in message.transforms if stamped.child_frame_id == root)
    return next(found, None)
