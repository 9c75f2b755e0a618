"""The trace of a recorded run, so that two recordings can be compared."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.planar_pose import PlanarPose
from kbot.kinematics.transform import Transform
from kbot.record.reader import Recording
from kbot.record.world_recorder import POSES_TOPIC
from kbot.text import KbotError
from kbot.trials.compare.comparison import Comparison
from kbot.trials.compare.significance import differences
from kbot.trials.measures import all_measures
from kbot.trials.quantities import QUANTITIES
from kbot.trials.results import TrialResult
from kbot.trials.scenario import LONGEST_TRIAL
from kbot.trials.trace import RATE, Trace

_ODOMETRY = ("nav_msgs/msg/Odometry", "nav_msgs/Odometry")
_JOINTS = ("sensor_msgs/msg/JointState", "sensor_msgs/JointState")
_FEWEST = 2
"""Poses from which a motion can be computed."""

Array = NDArray[np.float64]


def compare_recordings(before: str, after: str) -> Comparison:
    """Compare two recorded runs from their first odometry on. There are no sources, so there are no causes.

    Raises:
        KbotError: a file is not a recording, or has no odometry.
    """
    results = []
    for path in (before, after):
        trace = recorded_trace(path)
        values = {measure.name: measure.compute(trace) for measure in all_measures(trace)}
        results.append(TrialResult("recording", 0, all_values=values))
    return Comparison(before, after, tuple(differences(results[:1], results[1:])))


def recorded_trace(path: str) -> Trace:
    """The quantities that a recording shows. All others are NaN.

    A recording of KBot has true poses. In any other, the pose is that of odometry.

    Raises:
        KbotError: the file is not a recording, or has no odometry.
    """
    odometry: list[tuple[float, ...]] = []
    truth: list[tuple[float, ...]] = []
    joints: dict[str, list[tuple[float, float]]] = {}
    root = odometry_topic = ""
    for entry in Recording(path).entries():
        time = entry.nanoseconds * 1e-9
        if entry.type_name in _ODOMETRY and odometry_topic in ("", entry.topic):
            odometry_topic = entry.topic
            pose = entry.message().pose.pose
            odometry.append((time, *_numbers(path, pose.position, pose.orientation)))
        elif entry.topic == POSES_TOPIC:
            for transform in entry.message().transforms:
                root = root or transform.child_frame_id  # the robot comes first
                if transform.child_frame_id == root:
                    place = transform.transform
                    truth.append((time, *_numbers(path, place.translation, place.rotation)))
        elif entry.type_name in _JOINTS:
            state = entry.message()
            for name, position in zip(state.name, state.position, strict=False):
                joints.setdefault(name, []).append((time, float(position)))
    if len(odometry) < _FEWEST:
        raise KbotError(f"{path} has no odometry (nav_msgs/Odometry), so its motion is unknown")
    seconds = odometry[-1][0] - odometry[0][0]
    if seconds > LONGEST_TRIAL:
        raise KbotError(
            f"the odometry of {path} spans {seconds:.0f} s, more than a day. Cut it with kbot bag cut"
        )
    return _trace(odometry, truth if len(truth) >= _FEWEST else odometry, joints)


def _numbers(path: str, position: object, orientation: object) -> tuple[float, ...]:
    """x, y, z, yaw, roll and pitch of a ROS pose. Raises KbotError: it is not a pose."""
    place = [float(getattr(position, axis)) for axis in "xyz"]
    rotation = [float(getattr(orientation, axis)) for axis in "xyzw"]
    if not any(rotation):  # some ROS nodes leave it unset: no rotation
        rotation = [0.0, 0.0, 0.0, 1.0]
    try:
        roll, pitch, yaw = Transform.from_quaternion_xyzw(rotation, place).rpy
    except ValueError as error:
        raise KbotError(f"{path} has a pose that cannot be used: {error}") from None
    return (*place, yaw, roll, pitch)


def _trace(
    odometry: Sequence[tuple[float, ...]],
    truth: Sequence[tuple[float, ...]],
    joints: dict[str, list[tuple[float, float]]],
) -> Trace:
    table, poses = np.array(odometry), np.array(truth)
    table[:, 4], poses[:, 4] = np.unwrap(table[:, 4]), np.unwrap(poses[:, 4])
    times = np.arange(table[0, 0], table[-1, 0] + 0.5 / RATE, 1.0 / RATE)

    def at(rows: Array, column: int) -> Array:
        resampled: Array = np.interp(times, rows[:, 0], rows[:, column])
        return resampled

    x, y, z, yaw, roll, pitch = (at(poses, column) for column in range(1, 7))
    start = PlanarPose(float(x[0]), float(y[0]), float(yaw[0]))
    forward, left = start.local(x, y)
    steps = np.hypot(np.diff(x), np.diff(y))
    # odometry starts in its own frame: it is placed on the true start
    own = np.stack([at(table, 1), at(table, 2)], axis=1)
    odom_from_start = PlanarPose(float(own[0, 0]), float(own[0, 1]), float(at(table, 4)[0]))
    world_from_odom = start @ odom_from_start.inverse()
    odometry_x, odometry_y = world_from_odom.apply(own).T
    columns = {name: np.full(len(times), math.nan) for name in QUANTITIES}
    columns |= {
        "time": times - times[0],
        "x": x,
        "y": y,
        "z": z,
        "yaw": yaw,
        "roll": roll,
        "pitch": pitch,
        "tilt": np.arccos(np.clip(np.cos(roll) * np.cos(pitch), -1.0, 1.0)),
        "forward": forward,
        "left": left,
        "turn": yaw - yaw[0],
        "distance": np.concatenate(([0.0], np.cumsum(steps))),
        "speed": np.concatenate((steps * RATE, steps[-1:] * RATE)),
        "turn_rate": np.gradient(yaw, 1.0 / RATE),
        "odometry_x": odometry_x,
        "odometry_y": odometry_y,
        "odometry_yaw": at(table, 4) + world_from_odom.yaw,
        "odometry_error": np.hypot(odometry_x - x, odometry_y - y),
    }
    positions = {name: np.interp(times, *np.array(rows).T) for name, rows in joints.items()}
    return Trace(columns, positions, {})
