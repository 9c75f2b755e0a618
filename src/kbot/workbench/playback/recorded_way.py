"""The path of a recorded robot, over the whole recording."""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator
from dataclasses import dataclass

from kbot.kinematics.transform import Transform
from kbot.messages import Odometry, TFMessage
from kbot.model import RobotModel
from kbot.record.entry import RecordedMessage
from kbot.record.formats import read_fields
from kbot.record.recorder import COMMANDS_TOPIC
from kbot.record.world_recorder import POSES_TOPIC
from kbot.text.json_text import parse_json
from kbot.workbench.playback.recorded_run import TF, RecordedRun, RecordedState
from kbot.workbench.scene.foreign_frames import MAP, WORLD, read_transform
from kbot.workbench.timeline.ways import TrailPoint, Way

MOST_PLACES = 3000
Finding = Generator[None, None, list[TrailPoint]]
"""A way that is being read, which may be left alone for a while at each `None`."""
FINEST = 0.05
"""Seconds between two places, at the least."""
PIECE = 1.0
"""Seconds that are read at once."""
LONG_SILENCE = 60
"""Pieces without a message, after which the next message is looked for."""
FASTEST = 30.0
"""m/s that a robot drives at the most: what is further was not driven."""
QUICKEST, ASIDE = 5.0, 0.1
"""m/s² that it gains at the most, and m by which what it was told to drive may be wrong."""
PUTS = frozenset({"place", "reset", "reset_world", "restore", "set_model_state", "set_pose"})
"""What is done to a simulation, by its journal, that puts a robot elsewhere."""


def world_from_root(
    run: RecordedRun, robot: RobotModel, told: RecordedState, truth: Transform | None
) -> Transform:
    """Where the robot truly was, or else as tf has it; what odometry tells is from where it started."""
    if truth is not None:
        return truth
    top, pose = told.top_from(robot.root)
    return pose if top in (WORLD, MAP) else run.start @ pose


@dataclass(frozen=True, slots=True)
class WayPoint:
    """Where the robot was at a time of the recording's clock and one of the messages' stamps, in
    nanoseconds; how fast by its odometry, in m/s, nan where none was heard yet. With `put` it was put there,
    as is told."""

    at: int
    stamp: int
    xy: tuple[float, float]
    speed: float
    put: bool


class RecordedWay:
    """Found out when it is first asked for."""

    def __init__(self, run: RecordedRun, robot: RobotModel) -> None:
        self._run, self._robot = run, robot
        self._known: list[TrailPoint] | None = None

    def __call__(self, spacing: float) -> Finding:
        """Its places, in m, at least `spacing` apart."""
        if self._known is None:
            self._known = yield from _found(self._run, self._robot, spacing)
        return self._known


def _found(run: RecordedRun, robot: RobotModel, spacing: float) -> Finding:
    places = []
    for piece in _places(run, robot):
        places += piece
        yield
    # a simulation of KBot's tells what was done to it, and pushes go unnoticed by its odometry
    told_speeds = not run.facts and any(place.speed > 0.0 for place in places)
    way, before = Way(0, 0.0), None
    for place in places:
        is_jump = before is not None and (place.put or _was_put(before, place, told_speeds))
        way.add((place.at - run.index.start) * 1e-9, *place.xy, spacing, is_jump)
        before = place
    return way.points


def _places(run: RecordedRun, robot: RobotModel) -> Iterator[list[WayPoint]]:
    """Those that are told in each piece of the recording."""
    index = run.index
    moves = [POSES_TOPIC] if POSES_TOPIC in run.topics else _transforms(run)
    topics, name = [COMMANDS_TOPIC, *moves, *run.odometry], _name(run, robot)
    told, speed = RecordedState(robot), math.nan
    for message in run.statics:
        told.hear(message)
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
                told.hear(message)
                if now < due:
                    continue
                due = now + every
                truth = _truth(message, robot.root) if entry.topic == POSES_TOPIC else None
                x, y, _ = world_from_root(run, robot, told, truth).translation
                # what was done at the moment of a place may have come before it or after
                found.append(WayPoint(now, _stamp(message), (float(x), float(y)), speed, put >= last))
                last = now
        after = until
        yield found
        if silent == LONG_SILENCE:  # as where a message was stamped by another clock
            following = next(iter(index.between(topics, after, index.end)), None)
            after, silent = index.end if following is None else following.nanoseconds - 1, 0


def _name(run: RecordedRun, robot: RobotModel) -> str:
    """What the robot was called in the simulation."""
    try:
        name, *_ = parse_json(run.facts["naming"])
    except (KeyError, ValueError, TypeError):
        name = ""
    return str(name) or robot.name


def _puts(entry: RecordedMessage, robot: str) -> bool:
    """Whether the journal tells that the robot was put elsewhere."""
    note = read_fields(entry)
    return note.get("do") in PUTS and note.get("robot", note.get("model", robot)) == robot


def _was_put(before: WayPoint, now: WayPoint, told_speeds: bool) -> bool:
    """Whether it cannot have driven from one place to the next: faster than any robot or, where odometry
    tells speeds, than it was. Messages that were late by their stamps tell of a longer time."""
    away, seconds = math.dist(before.xy, now.xy), (now.at - before.at) * 1e-9
    if away > FASTEST * seconds:
        return True
    speed = max(before.speed, now.speed)
    if not told_speeds or math.isnan(speed):
        return False
    driving = max(seconds, (now.stamp - before.stamp) * 1e-9)
    return away > speed * driving + QUICKEST * seconds**2 + ASIDE


def _speed(odometry: object) -> float:
    """m/s over the ground, nan where it is none."""
    if not isinstance(odometry, Odometry):
        return math.nan
    linear = odometry.twist.twist.linear
    speed = math.hypot(linear.x, linear.y)
    return speed if math.isfinite(speed) else math.nan


def _stamp(message: TFMessage) -> int:
    return max((one.header.stamp.nanoseconds for one in message.transforms), default=0)


def _transforms(run: RecordedRun) -> list[str]:
    return [name for name in run.of_robot if run.index.topics[name] == TF]


def _truth(message: TFMessage, root: str) -> Transform | None:
    found = (read_transform(one) for one in message.transforms if one.child_frame_id == root)
    return next(found, None)
