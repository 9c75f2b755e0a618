"""The way a recorded robot took, from one end of its recording to the other."""

from __future__ import annotations

import json
import math
from collections.abc import Generator

from kbot.kinematics.transform import Transform
from kbot.messages import TFMessage
from kbot.model import Robot
from kbot.record.entry import Entry
from kbot.record.formats import read_fields
from kbot.record.recorder import COMMANDS_TOPIC
from kbot.record.world_recorder import POSES_TOPIC
from kbot.workbench.playback.recorded_run import TF, RecordedRun
from kbot.workbench.playback.told import Told
from kbot.workbench.scene.foreign_frames import MAP, WORLD, read_transform
from kbot.workbench.timeline.ways import Point, Way

MOST_PLACES = 3000
Finding = Generator[None, None, list[Point]]
"""A way that is being read, which may be left alone for a while at each `None`."""
FINEST = 0.05
"""Seconds between two places, at the least."""
PIECE = 1.0
"""Seconds that are read at once."""
FASTEST = 30.0
"""m/s that a robot drives at the most: what is further was not driven."""
PUTS = frozenset({"place", "reset", "reset_world", "restore", "set_model_state", "set_pose"})
"""What is done to a simulation, by its journal, that puts a robot elsewhere."""


def world_from_root(run: RecordedRun, robot: Robot, told: Told, truth: Transform | None) -> Transform:
    """Where the robot truly was, or else as tf has it; what odometry tells is from where it started."""
    if truth is not None:
        return truth
    top, pose = told.top_from(robot.root)
    return pose if top in (WORLD, MAP) else run.start @ pose


class RecordedWay:
    """Found out when it is first asked for."""

    def __init__(self, run: RecordedRun, robot: Robot) -> None:
        self._run, self._robot = run, robot
        self._known: list[Point] | None = None

    def __call__(self, spacing: float) -> Finding:
        """Its places, in m, at least `spacing` apart."""
        if self._known is None:
            self._known = yield from _found(self._run, self._robot, spacing)
        return self._known


def _found(run: RecordedRun, robot: Robot, spacing: float) -> Finding:
    index = run.index
    topics = [POSES_TOPIC] if POSES_TOPIC in run.topics else _transforms(run)
    told, way = Told(robot), Way(0, 0.0)
    name = _name(run, robot)
    last, before, put = index.start, (math.nan, math.nan), -1
    for message in run.statics:
        told.hear(message)
    every = max(round(FINEST * 1e9), (index.end - index.start) // MOST_PLACES)
    due, after = index.start, index.start - 1
    while after < index.end:
        until = min(after + round(PIECE * 1e9), index.end)
        for entry in index.between([COMMANDS_TOPIC, *topics], after, until):
            if entry.topic == COMMANDS_TOPIC:
                put = entry.nanoseconds if _puts(entry, name) else put
                continue
            if entry.topic == POSES_TOPIC and entry.nanoseconds < due:
                continue
            message = run.read(entry)
            told.hear(message)
            if entry.nanoseconds >= due:
                due = entry.nanoseconds + every
                truth = _truth(message, robot.root) if entry.topic == POSES_TOPIC else None
                x, y, _ = world_from_root(run, robot, told, truth).translation
                # what was done at the moment of a place may have come before it or after
                is_jump = put >= last or _is_too_far(before, (x, y), (entry.nanoseconds - last) * 1e-9)
                way.add((entry.nanoseconds - index.start) * 1e-9, float(x), float(y), spacing, is_jump)
                last, before = entry.nanoseconds, (x, y)
        after = until
        yield
    return way.points


def _name(run: RecordedRun, robot: Robot) -> str:
    """What the robot was called in the simulation."""
    try:
        name, *_ = json.loads(run.facts["naming"])
    except (KeyError, ValueError, TypeError):
        name = ""
    return str(name) or robot.name


def _puts(entry: Entry, robot: str) -> bool:
    """Whether the journal tells that the robot was put elsewhere."""
    note = read_fields(entry)
    return note.get("do") in PUTS and note.get("robot", note.get("model", robot)) == robot


def _is_too_far(before: tuple[float, float], now: tuple[float, float], seconds: float) -> bool:
    return math.dist(before, now) > FASTEST * seconds


def _transforms(run: RecordedRun) -> list[str]:
    return [name for name in run.of_robot if run.index.topics[name] == TF]


def _truth(message: TFMessage, root: str) -> Transform | None:
    found = (read_transform(one) for one in message.transforms if one.child_frame_id == root)
    return next(found, None)
