"""A moment as the pages are told it."""

from __future__ import annotations

from kbot.model import Robot
from kbot.workbench.driving.motion import Moment, flat
from kbot.workbench.protocol import State


def state_message(
    moment: Moment,
    robot: Robot,
    *,
    revision: int,
    paused: bool,
    speed: float,
    rate: float,
    driver: int,
    resets: int,
    at: float,
) -> State:
    """The state of the robot in the scene of a revision, its numbers as short as they can be seen."""
    return State(
        revision=revision,
        time=round(moment.time, 6),
        paused=paused,
        speed=speed,
        rate=round(rate, 3),
        positions=tuple(round(moment.positions[joint.name], 6) for joint in robot.movable_joints),
        poses=flat(moment.poses[link] for link in robot.links),
        bodies=moment.bodies,
        frames=tuple((name, parent) for name, (parent, _) in moment.frames.items()),
        frame_poses=flat(pose for _, pose in moment.frames.values()),
        command=moment.command,
        twist=tuple(round(v, 5) for v in moment.twist),
        odometry=tuple(round(v, 6) for v in moment.odometry),
        driver=driver,
        resets=resets,
        at=round(at, 4),
        faults=moment.faults,
        fallen=moment.fallen,
        jumps=moment.jumps,
    )
