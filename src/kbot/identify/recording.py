"""Reads logs from recordings (MCAP, ROS 1 bag, rosbag2): joint states, and a reference of the motion.

The reference is, in this order: the topic that the user names, the true poses of a simulation, the transform
from `map` of a localisation, the poses of a localisation or of motion capture, and scan matching.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kbot.identify.log import Array, DriveLog, held, jumps_ahead
from kbot.identify.nominal import Nominal
from kbot.identify.scan_matching import Scan, matched_poses
from kbot.kinematics.frames import FrameTree
from kbot.kinematics.planar_pose import PlanarPose
from kbot.kinematics.transform import Transform
from kbot.messages.types import yaw_of
from kbot.record.entry import RecordedMessage
from kbot.record.formats import read_fields
from kbot.record.reader import Recording
from kbot.record.recorder import COMMANDS_TOPIC
from kbot.record.world_recorder import POSES_TOPIC
from kbot.text import KbotError
from kbot.text.notes import note
from kbot.text.suggest import suggest_or_list

JOINTS, SCAN, IMU = "sensor_msgs/JointState", "sensor_msgs/LaserScan", "sensor_msgs/Imu"
TWISTS = ("geometry_msgs/Twist", "geometry_msgs/TwistStamped")
POSES = (
    "geometry_msgs/PoseWithCovarianceStamped",
    "geometry_msgs/PoseStamped",
    "nav_msgs/Odometry",
)
TRANSFORMS = ("tf2_msgs/TFMessage", "tf/tfMessage")
_FIXED_FRAMES = ("map", "world", "earth")
"""Frames in which a pose is a reference."""
_ODOMETRY_FRAME = "odom"
"""Frame of poses that are computed from the wheels (REP 105, Coordinate Frames for Mobile Platforms)."""
_GOALS = ("goal", "initialpose", "target")
"""Parts of the names of topics whose poses are not those of the robot."""
_PERIOD = 0.1
"""Shortest time in s between two poses of the reference. More poses only cost time."""
_SWAPPED = 0.2
"""Longest time in s by which a message may precede the one before it: a network can swap messages. Time that
goes back further is another run."""
_ROUNDING = 1e-3
"""Angle in rad by which an encoder may exceed its range."""
SOURCES = ("joint_states", "reference", "commands", "gyro")
_FEWEST = 2
"""Motion needs at least this many poses of the reference, and messages of joint states."""


@dataclass
class _Series:
    """Times in s and rows of numbers, in the order of the file."""

    times: list[float] = field(default_factory=list)
    rows: list[tuple[float, ...]] = field(default_factory=list)

    def add(self, time: float, *row: float) -> None:
        self.times.append(time)
        self.rows.append(row)

    def __len__(self) -> int:
        return len(self.times)

    def arrays(self, path: str, topic: str) -> tuple[Array, Array]:
        """Increasing times, and the rows. A repeated time counts once, and swapped messages are sorted.

        Raises:
            KbotError: the clock jumps, or a number is not finite.
        """
        times, rows = np.array(self.times), np.array(self.rows)
        if not (np.isfinite(times).all() and np.isfinite(rows).all()):
            at = int(np.flatnonzero(~np.isfinite(rows).all(axis=1))[0])
            raise KbotError(f"{path}: {topic} at {times[at]:.3f} s has a number that is not finite")
        for index in np.flatnonzero(np.diff(times) < -_SWAPPED):
            raise KbotError(
                f"{path}: the clock jumps back on {topic}: {times[index]:.3f} s, then "
                f"{times[index + 1]:.3f} s. Cut the recording with kbot bag cut"
            )
        order = np.argsort(times, kind="stable")
        times, rows = times[order], rows[order]
        for index in jumps_ahead(times):
            raise KbotError(
                f"{path}: the clock jumps ahead by {times[index + 1] - times[index]:.6g} s on {topic} at "
                f"{times[index]:.3f} s. Cut the recording with kbot bag cut"
            )
        is_new = np.concatenate([[True], np.diff(times) > 0.0])
        return times[is_new], rows[is_new]


@dataclass
class _Contents:
    """What a recording has, by topic."""

    topics: dict[str, str] = field(default_factory=dict)
    joints: dict[tuple[str, str], _Series] = field(default_factory=dict)
    """Positions and velocities by topic and joint, positive forwards."""
    joint_names: set[str] = field(default_factory=set)
    scans: dict[str, list[Scan]] = field(default_factory=dict)
    scan_frames: dict[str, str] = field(default_factory=dict)
    poses: dict[str, _Series] = field(default_factory=dict)
    frames: dict[str, tuple[str, str]] = field(default_factory=dict)
    """Fixed frame and frame of the robot of the poses of a topic."""
    transforms: dict[tuple[str, str], _Series] = field(default_factory=dict)
    commands: dict[str, _Series] = field(default_factory=dict)
    gyros: dict[str, _Series] = field(default_factory=dict)
    gyro_frames: dict[str, str] = field(default_factory=dict)
    delays: list[float] = field(default_factory=list)
    """Time of recording minus the stamp of joint states, in s."""


@dataclass(frozen=True, slots=True)
class _Reference:
    """Times (n,) in s, poses (n, 3) of a link, and whether a pose begins in another fixed frame (n,).

    `is_named` is whether the recording itself names the link, so that no other can be meant.
    """

    topic: str
    link: str
    times: Array
    poses: Array
    is_first: NDArray[np.bool_]
    is_named: bool


def read_recording(
    path: str, nominal: Nominal, reference: str | None, sensor: str | None = None
) -> tuple[DriveLog, str]:
    """Read a log, and the link whose motion its reference measures.

    `reference` is a topic, or None to choose one. `sensor` is the link that the user names as the sensor, or
    None for that of the reference. Times are those of the stamps. Commands have no stamp, and
    a localisation stamps its correction with a time in the future: both have their time of recording, less
    the median time between stamp and recording of the joint states.

    Raises:
        KbotError: the recording cannot be read, lacks joint states or a reference, or its reference is the
            pose of another link than `sensor`.
    """
    contents = _read(path, nominal)
    if not contents.topics:
        raise KbotError(f"{path} has no messages")
    joint_topics, wheel_times, angles = _wheels(path, nominal, contents)
    found = _reference(path, nominal, contents, reference, (wheel_times, angles))
    if found.is_named and sensor not in (None, found.link):
        scans = next(
            (f"For the lidar use --reference {topic}" for topic in contents.scans), "Remove --sensor"
        )
        raise KbotError(f"{path}: {found.topic} has the pose of {found.link}, not of {sensor}. {scans}")
    is_inside = (found.times >= wheel_times[0]) & (found.times <= wheel_times[-1])
    times = found.times[is_inside]
    if len(times) < _FEWEST:
        raise KbotError(f"{path}: the reference and the joint states are not of the same time")
    grid = np.union1d(wheel_times, times)
    grid = grid[np.concatenate([[True], np.diff(grid) > 1e-6])]
    at = np.clip(np.searchsorted(grid, times - 1e-6), 0, len(grid) - 1)
    placed = np.full((len(grid), 3), np.nan)
    placed[at] = found.poses[is_inside]
    turned = np.column_stack([np.interp(grid, wheel_times, angles[:, side]) for side in (0, 1)])
    durations = np.diff(grid)
    speeds = np.diff(turned, axis=0) / durations[:, None]
    command_topic, commands = _commands(path, contents, grid)
    gyro_topic, gyro = _gyro(path, nominal, contents, grid)
    topics = (joint_topics, found.topic, command_topic, gyro_topic)
    # the first interval has no wheel speeds: it only gives the pose at the start
    log = DriveLog(
        path=path,
        durations=np.concatenate([[np.nan], durations]),
        wheel_speeds=np.vstack([[np.nan, np.nan], speeds]),
        displacements=np.full((len(grid), 3), np.nan),
        poses=placed,
        commands=commands,
        gyro=gyro,
        new_frames=at[found.is_first[is_inside]].tolist(),
        sources={name: topic for name, topic in zip(SOURCES, topics, strict=True) if topic},
    )
    return log, sensor or found.link


def _read(path: str, nominal: Nominal) -> _Contents:
    found = _Contents()
    for entry in Recording(path).entries():
        kind = entry.type_name.replace("/msg/", "/")
        found.topics.setdefault(entry.topic, kind)
        if kind == JOINTS:
            _add_joints(found, entry, nominal.drive.forward)
        elif kind == SCAN:
            _add_scan(found, entry)
        elif kind in TRANSFORMS:
            _add_transforms(found, entry)
        elif kind in POSES and not any(word in entry.topic for word in _GOALS):
            _add_pose(found, entry)
        elif kind in TWISTS and "odom" not in entry.topic:
            message = entry.message()
            twist = getattr(message, "twist", message)
            series = found.commands.setdefault(entry.topic, _Series())
            series.add(entry.nanoseconds * 1e-9, float(twist.linear.x), float(twist.angular.z))
        elif entry.topic == COMMANDS_TOPIC:
            _add_command(found, entry)
        elif kind == IMU:
            message = entry.message()
            turn = message.angular_velocity
            found.gyro_frames.setdefault(entry.topic, message.header.frame_id)
            series = found.gyros.setdefault(entry.topic, _Series())
            series.add(_time(message, entry), float(turn.x), float(turn.y), float(turn.z))
    recorded = [*found.commands.values()]
    recorded += [series for (parent, _), series in found.transforms.items() if parent == "map"]
    delay = float(np.median(found.delays)) if found.delays else 0.0
    for series in recorded:
        series.times = [time - delay for time in series.times]
    return found


def _add_command(found: _Contents, entry: RecordedMessage) -> None:
    """Add a command that a simulation of KBot received without a topic."""
    note = read_fields(entry)
    if note.get("do") == "twist":
        linear, angular = note.get("linear"), note.get("angular")
        if not (isinstance(linear, int | float) and isinstance(angular, int | float)):
            raise KbotError(f"{entry.place} was not written by KBot: it is not a twist")
        series = found.commands.setdefault(entry.topic, _Series())
        series.add(entry.nanoseconds * 1e-9, float(linear), float(angular))


def _time(message: Any, entry: RecordedMessage) -> float:  # noqa: ANN401 - a message of ROS
    """The stamp in s, or the time of recording if there is no stamp."""
    stamp = message.header.stamp
    seconds = float(stamp.sec) + float(stamp.nanosec) * 1e-9
    return seconds or entry.nanoseconds * 1e-9


def _add_joints(found: _Contents, entry: RecordedMessage, forward: Mapping[str, float]) -> None:
    message = entry.message()
    names = list(message.name)
    found.joint_names.update(names)
    time = _time(message, entry)
    for name in forward.keys() & names:
        index = names.index(name)
        position, velocity = (
            values[index] * forward[name] if len(values) == len(names) else math.nan
            for values in (message.position, message.velocity)
        )
        found.joints.setdefault((entry.topic, name), _Series()).add(time, position, velocity)
        found.delays.append(entry.nanoseconds * 1e-9 - time)


def _add_scan(found: _Contents, entry: RecordedMessage) -> None:
    message = entry.message()
    found.scan_frames.setdefault(entry.topic, message.header.frame_id)
    ranges = np.asarray(message.ranges, dtype=float)
    angles = message.angle_min + message.angle_increment * np.arange(len(ranges))
    is_valid = np.isfinite(ranges) & (ranges >= message.range_min) & (ranges <= message.range_max)
    points = np.column_stack([ranges * np.cos(angles), ranges * np.sin(angles)])
    points[~is_valid] = np.nan
    found.scans.setdefault(entry.topic, []).append(Scan(_time(message, entry), points.astype(np.float32)))


def _add_transforms(found: _Contents, entry: RecordedMessage) -> None:
    for transform in entry.message().transforms:
        parent, child = (name.lstrip("/") for name in (transform.header.frame_id, transform.child_frame_id))
        place, turn = transform.transform.translation, transform.transform.rotation
        stamp = transform.header.stamp
        time = float(stamp.sec) + float(stamp.nanosec) * 1e-9
        # a localisation stamps its correction with a time in the future
        if parent == "map" or not time:
            time = entry.nanoseconds * 1e-9
        series = found.transforms.setdefault((parent, child), _Series())
        series.add(time, float(place.x), float(place.y), _yaw(turn))
        if entry.topic == POSES_TOPIC:
            found.frames.setdefault(f"{POSES_TOPIC} {child}", (parent, child))


def _add_pose(found: _Contents, entry: RecordedMessage) -> None:
    message = entry.message()
    pose = getattr(message.pose, "pose", message.pose)
    frame = message.header.frame_id.lstrip("/")
    child = getattr(message, "child_frame_id", "").lstrip("/")
    found.frames.setdefault(entry.topic, (frame, child))
    series = found.poses.setdefault(entry.topic, _Series())
    series.add(_time(message, entry), float(pose.position.x), float(pose.position.y), _yaw(pose.orientation))


def _yaw(quaternion: Any) -> float:  # noqa: ANN401 - a message of ROS
    return yaw_of(*(float(getattr(quaternion, axis)) for axis in "xyzw"))


def _listed(contents: _Contents) -> str:
    names = [f"{topic} ({kind.rpartition('/')[2]})" for topic, kind in sorted(contents.topics.items())]
    more = f" and {len(names) - 12} more" if len(names) > 12 else ""
    return ", ".join(names[:12]) + more


def _wheels(path: str, nominal: Nominal, contents: _Contents) -> tuple[str, Array, Array]:
    """The topics, times, and the angles (n, 2) in rad by which the left and right wheels have turned.

    The wheels may be in different messages. The times are those of one wheel, while all wheels have messages.
    """
    if not contents.joint_names:
        raise KbotError(f"{path} has no joint states (sensor_msgs/JointState). It has {_listed(contents)}")
    drive = nominal.drive
    absent = [name for name in drive.joints if name not in contents.joint_names]
    if absent:
        wanted = ", ".join(f"'{name}'" for name in absent)
        listed = ", ".join(sorted(contents.joint_names)[:8])
        raise KbotError(f"{path}: its joint states do not have the wheels {wanted}. They have {listed}")
    topics, turned = dict[str, None](), dict[str, tuple[Array, Array]]()
    for name in drive.joints:
        of_wheel = {topic: series for (topic, joint), series in contents.joints.items() if joint == name}
        topic = max(of_wheel, key=lambda topic: len(of_wheel[topic]))
        topics[topic] = None
        turned[name] = _turned(path, topic, name, of_wheel[topic])
    grid = turned[drive.joints[0]][0]
    starts, ends = zip(*((times[0], times[-1]) for times, _ in turned.values()), strict=True)
    grid = grid[(grid >= max(starts)) & (grid <= min(ends))]
    if len(grid) < _FEWEST:
        raise KbotError(f"{path}: the messages of the wheels on {', '.join(topics)} are not of the same time")
    angles = [
        np.mean([np.interp(grid, *turned[name]) for name in side], axis=0)
        for side in (drive.left, drive.right)
    ]
    return ", ".join(topics), grid, np.column_stack(angles)


def _turned(path: str, topic: str, name: str, series: _Series) -> tuple[Array, Array]:
    """Times, and the angles in rad by which a wheel has turned."""
    rows = np.array(series.rows)
    column = int(not np.isfinite(rows[:, 0]).any())
    if not np.isfinite(rows[:, column]).any():
        raise KbotError(f"{path}: {topic} has neither positions nor velocities of '{name}'")
    used = _Series(series.times, [(value,) for value in rows[:, column].tolist()])
    times, table = used.arrays(path, topic)
    if len(times) < _FEWEST:
        raise KbotError(f"{path}: {topic} has {len(times)} messages, too few for a motion")
    values = table[:, 0]
    if column:  # velocities: the trapezoidal rule
        return times, np.concatenate([[0.0], np.cumsum((values[1:] + values[:-1]) / 2.0 * np.diff(times))])
    low, high = values.min() + _ROUNDING, values.max() - _ROUNDING
    if (low >= -math.pi and high <= math.pi) or (low >= 0.0 and high <= math.tau):
        values = np.unwrap(values)  # encoders that wrap
    return times, values


def _reference(
    path: str,
    nominal: Nominal,
    contents: _Contents,
    reference: str | None,
    wheels: tuple[Array, Array],
) -> _Reference:
    robot = nominal.loaded.require()
    wanted = None if reference is None else "/" + reference.lstrip("/")
    if wanted is not None and wanted not in contents.topics:
        hint = suggest_or_list(wanted, contents.topics)
        raise KbotError(f"{path} has no topic {wanted}: {hint}")
    candidates: list[tuple[str, _Series, str]] = []  # the link is empty if the recording does not name it
    for (parent, child), series in contents.transforms.items():
        if f"{POSES_TOPIC} {child}" in contents.frames and child in robot.links and parent == "world":
            candidates.append((POSES_TOPIC, series, child))
    localised = _localised(contents)
    if localised is not None:
        candidates.append(("/tf", *localised))
    for topic, series in contents.poses.items():
        frame, child = contents.frames[topic]
        is_fixed = frame.rpartition("/")[2] in _FIXED_FRAMES or "truth" in topic
        if topic == wanted and not is_fixed and frame.rpartition("/")[2] == _ODOMETRY_FRAME:
            raise KbotError(
                f"{path}: {topic} in the frame {frame} is computed from the wheels and cannot show their size"
            )
        if is_fixed or topic == wanted:
            candidates.append((topic, series, child))
    for topic, series, link in candidates:
        if wanted in (None, topic) and len(series) >= _FEWEST:
            is_named = link in robot.links
            if link and not is_named:
                note(
                    f"{path}: {topic} has poses of '{link}', which is not a link of the robot. They are "
                    f"taken as those of '{nominal.drive.base}'. Name another link with --sensor"
                )
            times, poses = _thinned(*series.arrays(path, topic))
            none_first = np.zeros(len(times), dtype=bool)
            return _Reference(
                topic, link if is_named else nominal.drive.base, times, poses, none_first, is_named
            )
    for topic, scans in contents.scans.items():
        if wanted in (None, topic):
            frame = contents.scan_frames[topic].lstrip("/")
            lidar = frame if frame in robot.links else nominal.sensor_link
            if lidar is None:
                raise KbotError(
                    f"{path}: {topic} is in the frame '{frame}', which is not a link of the robot. Name the "
                    "lidar's link with --sensor"
                )
            matched = matched_poses(path, topic, scans, wheels, nominal.with_sensor(lidar))
            return _Reference(topic, lidar, *matched, frame in robot.links)
    if wanted is not None:
        raise KbotError(f"{path}: {wanted} is not a reference: it has neither poses nor scans of a lidar")
    raise KbotError(
        f"{path} has no reference: it needs scans of a lidar, a transform from 'map', or poses in one of the "
        f"frames {', '.join(_FIXED_FRAMES)}. It has {_listed(contents)}"
    )


def _localised(contents: _Contents) -> tuple[_Series, str] | None:
    """The pose in `map` after each correction of a localisation, and the frame of the robot.

    Between two corrections the pose is that of the wheels' own odometry, which is not a reference.
    """
    corrections = next(
        ((child, series) for (parent, child), series in contents.transforms.items() if parent == "map"), None
    )
    if corrections is None:
        return None
    odometry, series = corrections
    moving = next(
        ((child, rows) for (parent, child), rows in contents.transforms.items() if parent == odometry), None
    )
    if moving is None:
        return series, odometry  # the localisation moves the robot itself
    base, motion = moving
    times, rows = np.array(motion.times), np.array(motion.rows)
    order = np.argsort(times, kind="stable")
    times, rows = times[order], rows[order]
    rows[:, 2] = np.unwrap(rows[:, 2])
    placed, before = _Series(), None
    for time, row in zip(series.times, series.rows, strict=True):
        if row != before and times[0] <= time <= times[-1]:
            own = [float(np.interp(time, times, rows[:, column])) for column in range(3)]
            pose = PlanarPose(*row) @ PlanarPose(*own)
            placed.add(time, pose.x, pose.y, pose.yaw)
        before = row
    return placed, base


def _thinned(times: Array, poses: Array) -> tuple[Array, Array]:
    """Poses at least `_PERIOD` apart."""
    kept, last = [], -math.inf
    for index, time in enumerate(times.tolist()):
        if time - last >= _PERIOD - 1e-6:
            kept.append(index)
            last = time
    return times[kept], poses[kept]


def _commands(path: str, contents: _Contents, grid: Array) -> tuple[str, Array]:
    """The topic, and (n, 2) the command in effect at the start of each interval, NaN before the first."""
    if not contents.commands:
        return "", np.full((len(grid), 2), np.nan)
    topic, series = max(contents.commands.items(), key=lambda item: len(item[1]))
    times, values = _by_recording(series.times, series.rows, path, topic)
    starts = np.concatenate([grid[:1], grid[:-1]])
    return topic, held(times, values, starts + 1e-9)


def _by_recording(
    times: Sequence[float], rows: Sequence[tuple[float, ...]], path: str, topic: str
) -> tuple[Array, Array]:
    """Commands may pause for long, and are in the order of recording."""
    values = np.array(rows)
    if not np.isfinite(values).all():
        raise KbotError(f"{path}: {topic} has a number that is not finite")
    order = np.argsort(times, kind="stable")
    return np.array(times)[order], values[order]


def _gyro(path: str, nominal: Nominal, contents: _Contents, grid: Array) -> tuple[str, Array]:
    """The topic, and (n,) the mean turning speed about the vertical in each interval, NaN without a gyro."""
    if not contents.gyros:
        return "", np.full(len(grid), np.nan)
    topic, series = max(contents.gyros.items(), key=lambda item: len(item[1]))
    times, rates = series.arrays(path, topic)
    robot = nominal.loaded.require()
    frame = contents.gyro_frames[topic].lstrip("/")
    vertical = np.array([0.0, 0.0, 1.0])
    if frame in robot.links:
        base_from_imu: Transform = FrameTree(robot).pose(frame, in_frame=nominal.drive.base)
        vertical = base_from_imu.rotation[2]
    elif frame:
        note(
            f"{path}: {topic} is in the frame '{frame}', which is not a link of the robot. Its z axis is "
            "taken as vertical"
        )
    turning = rates @ vertical
    angle = np.concatenate([[0.0], np.cumsum((turning[1:] + turning[:-1]) / 2.0 * np.diff(times))])
    means = np.diff(np.interp(grid, times, angle)) / np.diff(grid)
    means[(grid[:-1] < times[0]) | (grid[1:] > times[-1])] = np.nan
    return topic, np.concatenate([[np.nan], means])
