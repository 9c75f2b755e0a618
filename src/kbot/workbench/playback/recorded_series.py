"""Values over time from a recording, for plots."""

from __future__ import annotations

from collections.abc import Sequence

from kbot.model import RobotModel
from kbot.record.world_recorder import POSES_TOPIC
from kbot.workbench.playback.recorded_run import RecordedRun, RecordedState
from kbot.workbench.timeline.series import MOST_MOMENTS, Field, Making, SeriesTable, number_at

FINEST = 0.02
"""Least seconds between two values."""
PIECE = 1.0
"""Seconds that are read in one step."""


def series_of_run(
    run: RecordedRun, robot: RobotModel, fields: Sequence[Field], start: float, end: float
) -> Making:
    """Return values from `start` to `end` seconds of a recording, evenly spaced."""
    index = run.index
    topics = {field.topic for field in fields if field.topic in run.topics}
    moving = (
        [name for name in (*run.of_robot, *run.odometry) if name != POSES_TOPIC]
        if any(not field.topic for field in fields)
        else []
    )
    recorded, newest = RecordedState(robot), dict[str, object]()
    first = index.start + round(start * 1e9)
    last = min(index.start + round(end * 1e9), index.end)
    for topic in (*topics, *moving):
        entry = index.newest(topic, first)
        if entry is not None:
            message = run.read(entry)
            recorded.receive(message)
            newest[topic] = message
    step = max(round(FINEST * 1e9), (last - first) // MOST_MOMENTS + 1)
    table = SeriesTable(is_thinned=step > FINEST * 1e9)

    def row(moment: int) -> tuple[float | None, ...]:
        if index.damage(moment) is not None:
            return (None,) * len(fields)
        state: dict[str, object] = {"odometry": recorded.odometry, "twist": recorded.twist}
        if any(field.path[0] == "positions" for field in fields if not field.topic):
            state["positions"] = recorded.positions()
        return tuple(number_at(newest.get(f.topic) if f.topic else state, f.path) for f in fields)

    due, after = first, first
    while after <= last:
        until = min(after + round(PIECE * 1e9), last + 1)
        for entry in index.between({*topics, *moving}, after, until):
            while due < entry.nanoseconds:
                table.add((due - index.start) * 1e-9, run.seconds_at(due), row(due))
                due += step
            message = run.read(entry)
            if entry.topic in moving:
                recorded.receive(message)
            if entry.topic in topics:
                newest[entry.topic] = message
        after = until
        if until > last:
            break
        yield
    while due <= last:
        table.add((due - index.start) * 1e-9, run.seconds_at(due), row(due))
        due += step
    return table
