"""What a recorded run shows, so that two recordings can be compared."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.planar_pose import PlanarPose
from kbot.kinematics.transform import Transform
from kbot.messages import types as msg
from kbot.messages.sensing import LaserScan
from kbot.record.entry import RecordedMessage
from kbot.record.reader import Recording
from kbot.record.world_recorder import POSES_TOPIC
from kbot.text import KbotError
from kbot.trials.compare.comparison import Comparison
from kbot.trials.compare.declarations import Declarations, Setting, Settings, of_pose, of_topic
from kbot.trials.compare.significance import Difference, differences
from kbot.trials.measures import all_measures
from kbot.trials.quantities import QUANTITIES
from kbot.trials.results import TrialResult
from kbot.trials.scans import SCAN_RATE, Scans, compared_beams
from kbot.trials.scenario import LONGEST_TRIAL
from kbot.trials.trace import RATE, Trace

_ODOMETRY = ("nav_msgs/msg/Odometry", "nav_msgs/Odometry")
_JOINTS = ("sensor_msgs/msg/JointState", "sensor_msgs/JointState")
_SCANS = ("sensor_msgs/msg/LaserScan", "sensor_msgs/LaserScan")
_STATIC = "/tf_static"
_REGULAR = "sensor_msgs/"
"""The start of the types of messages that have a rate, beside odometry."""
_RATE_CHANGE = 0.1
"""The smallest change of a rate that counts, as a share: recorders and their machines add jitter."""
_FEWEST_OF_RATE = 10
"""Messages from which a rate is computed."""
_FEWEST = 2
"""Poses from which a motion can be computed."""

Array = NDArray[np.float64]


def compare_recordings(before: str, after: str) -> Comparison:
    """Compare two recorded runs from their first odometry on. There are no sources, so there are no causes.

    Topics and frames that only one recording has are not compared: the other may not have recorded them.

    Raises:
        KbotError: a file is not a recording, or has no odometry.
    """
    one, other = _recorded(before), _recorded(after)
    results = []
    for run in (one, other):
        values = {measure.name: measure.compute(run.trace) for measure in all_measures(run.trace)}
        scans = {topic.lstrip("/"): scans.scans() for topic, scans in run.seen.scans.items()}
        results.append(TrialResult("recording", 0, all_values=values, scans=scans))
    measured = (*differences(results[:1], results[1:]), *_rate_differences(one.seen, other.seen))
    settings = one.seen.declarations().differences(other.seen.declarations())
    declared = tuple(each for each in settings if each.setting != "exists")
    return Comparison(before, after, measured, declared=declared)


@dataclass(frozen=True)
class _Run:
    trace: Trace
    seen: _Seen


class _RecordedScans:
    """The scans of a topic, at most `SCAN_RATE` a second from the first odometry on."""

    def __init__(self, first: LaserScan) -> None:
        angles = first.angle_min + first.angle_increment * np.arange(len(first.ranges))
        self._beams = compared_beams(len(angles))
        self._directions = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)[self._beams]
        self._count, self._range_max = len(angles), float(first.range_max)
        self._due = -math.inf
        self._ranges: list[NDArray[np.float32]] = []
        self.settings: dict[str, Setting] = {
            "samples": float(len(angles)),
            "angle_min": float(first.angle_min),
            "angle_max": float(first.angle_max),
            "range_min": float(first.range_min),
            "range_max": float(first.range_max),
        }

    def add(self, time: float, scan: LaserScan) -> None:
        if time < self._due or len(scan.ranges) != self._count:
            return
        self._due = max(self._due, time - 1.0 / SCAN_RATE) + 1.0 / SCAN_RATE
        ranges = np.asarray(scan.ranges, dtype=np.float32)[self._beams]
        self._ranges.append(np.where(np.isnan(ranges), np.float32(np.inf), ranges))

    def scans(self) -> Scans:
        ranges = np.array(self._ranges, dtype=np.float32).reshape(-1, len(self._directions))
        return Scans(self._directions, self._range_max, ranges)


@dataclass
class _Seen:
    """What a recording shows apart from the robot's motion, by topic or frame."""

    topics: dict[str, Settings] = field(default_factory=dict)
    frames: dict[str, Settings] = field(default_factory=dict)
    scans: dict[str, _RecordedScans] = field(default_factory=dict)
    times: dict[str, tuple[int, float, float]] = field(default_factory=dict)
    """The number of messages, and the times of the first and the last in s, of topics with a rate."""

    def add(self, entry: RecordedMessage, time: float, *, is_driving: bool) -> None:
        """`is_driving`: there was odometry before."""
        if entry.topic not in self.topics:
            self.topics[entry.topic] = _topic(entry)
        if entry.type_name.startswith(_REGULAR) or entry.type_name in _ODOMETRY:
            count, first, _ = self.times.get(entry.topic, (0, time, time))
            self.times[entry.topic] = count + 1, first, time
        if entry.topic == _STATIC:
            self.frames |= dict(_static_frames(entry.message()))
        elif entry.type_name in _SCANS and is_driving:
            scan = entry.message()
            if len(scan.ranges):
                self.scans.setdefault(entry.topic, _RecordedScans(scan)).add(time, scan)

    def declarations(self) -> Declarations:
        parts = {f"topic {topic}": settings for topic, settings in self.topics.items()}
        parts |= {f"frame {frame}": settings for frame, settings in self.frames.items()}
        parts |= {f"sensor {topic}": scans.settings for topic, scans in self.scans.items()}
        return Declarations(parts, {})

    def rate(self, topic: str) -> float:
        """Messages per second of a topic, NaN for few messages."""
        count, first, last = self.times[topic]
        return (count - 1) / (last - first) if count >= _FEWEST_OF_RATE and last > first else math.nan


def _topic(entry: RecordedMessage) -> Settings:
    kind = entry.type_name.replace("/msg/", "/")  # ROS 1 and ROS 2 name the same type
    if entry.type_name not in (*_ODOMETRY, *_SCANS):
        return of_topic(kind)
    return of_topic(kind, entry.message())


def _static_frames(message: msg.TFMessage) -> Iterator[tuple[str, Settings]]:
    for each in message.transforms:
        place, turn = each.transform.translation, each.transform.rotation
        try:
            pose = Transform.from_quaternion_xyzw(
                [turn.x, turn.y, turn.z, turn.w], [place.x, place.y, place.z]
            )
        except ValueError:
            continue  # it is not a rotation, so that no program can use it
        yield each.child_frame_id, {"parent": each.header.frame_id, **of_pose(pose)}


def _rate_differences(before: _Seen, after: _Seen) -> Iterator[Difference]:
    for topic in before.times:
        if topic in after.times:
            rate = before.rate(topic)
            threshold = _RATE_CHANGE * rate if rate > 0.0 else 0.0
            name = f"rate/{topic.lstrip('/')}"
            yield Difference("recording", name, "Hz", rate, after.rate(topic), threshold)


def _recorded(path: str) -> _Run:
    """The quantities that a recording shows, all others NaN, and what else it shows.

    A recording of KBot has true poses. In any other, the pose is that of odometry.

    Raises:
        KbotError: the file is not a recording, or has no odometry.
    """
    seen = _Seen()
    odometry: list[tuple[float, ...]] = []
    truth: list[tuple[float, ...]] = []
    joints: dict[str, list[tuple[float, float]]] = {}
    root = odometry_topic = ""
    for entry in Recording(path).entries():
        time = entry.nanoseconds * 1e-9
        seen.add(entry, time, is_driving=bool(odometry))
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
    return _Run(_trace(odometry, truth if len(truth) >= _FEWEST else odometry, joints), seen)


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
