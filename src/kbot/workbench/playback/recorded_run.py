"""A recording to display: its robot, start, end and frames."""

from __future__ import annotations

import math
import weakref
from collections.abc import Collection, Iterable, Iterator
from dataclasses import fields
from itertools import chain, islice
from pathlib import Path
from typing import Any

import numpy as np

from kbot.kinematics.frames import FrameTree, unit_axis
from kbot.kinematics.transform import Transform
from kbot.messages import JointState, Odometry, TFMessage
from kbot.model import JointType, RobotModel
from kbot.record.encodings.serialization import decode_cdr
from kbot.record.encodings.types import known_type
from kbot.record.entry import RecordedMessage
from kbot.record.index import open_index
from kbot.record.world_recorder import POSES_TOPIC
from kbot.text import KbotError
from kbot.text.json_text import parse_json
from kbot.text.temporary import TemporaryFolder
from kbot.text.xml_text import escaped
from kbot.tf.foreign_frames import plain, read_transform


class RecordedState:
    """Receives messages one after the other, and holds the latest values."""

    def __init__(self, robot: RobotModel) -> None:
        self._robot = robot
        self.tree = FrameTree(robot)
        self.movable = {joint.name: joint for joint in robot.movable_joints}
        self._edges: dict[str, tuple[str, Transform]] = {}
        """`parent_from_child`, by child."""
        self._positions: dict[str, float] = {}
        self.odometry = (0.0, 0.0, 0.0)
        """x, y, yaw in m and rad."""
        self.twist = (0.0, 0.0)
        """m/s forward and rad/s turning."""

    def forget(self) -> None:
        """Forget frames and joints. Odometry is kept until the next message."""
        self._edges.clear()
        self._positions.clear()

    def receive(self, message: Any) -> None:  # noqa: ANN401 - a message of any type
        """Receive a message of tf, joint states or odometry. Other messages are ignored."""
        if isinstance(message, TFMessage):
            for stamped in message.transforms:
                transform = read_transform(stamped)
                if transform is not None:
                    self._edges[plain(stamped.child_frame_id)] = plain(stamped.header.frame_id), transform
        elif isinstance(message, JointState):
            for name, position in zip(message.name, message.position, strict=False):
                if name in self.movable and math.isfinite(position):
                    self._positions[name] = float(position)
        elif isinstance(message, Odometry):
            self._receive_odometry(message)

    def _receive_odometry(self, message: Odometry) -> None:
        pose, speed = message.pose.pose, message.twist.twist
        numbers = (pose.position.x, pose.position.y, pose.orientation.yaw, speed.linear.x, speed.angular.z)
        if all(map(math.isfinite, numbers)):
            self.odometry, self.twist = numbers[:3], numbers[3:]

    def positions(self) -> dict[str, float]:
        """Return joint positions (rad, m) from joint states, otherwise from tf."""
        found = dict(self._positions)
        for name, joint in self.movable.items():
            parent, moved = self._edges.get(joint.child, ("", None))
            if name in found or moved is None or parent != joint.parent or joint.mimic is not None:
                continue
            motion = self.tree.pose(joint.child, joint.parent, {}).inverse() @ moved
            axis = unit_axis(joint)
            if joint.type is JointType.PRISMATIC:
                found[name] = float(motion.translation @ axis)
            else:
                *turn, w = motion.quaternion_xyzw
                found[name] = 2.0 * math.atan2(float(np.dot(turn, axis)), w)
        return found

    def top_from(self, frame: str) -> tuple[str, Transform]:
        """Return the topmost frame on tf above a frame, and the pose of the frame in it."""
        pose, seen = Transform.identity(), {frame}
        while frame in self._edges:
            frame, parent_from_child = self._edges[frame]
            pose = parent_from_child @ pose
            if frame in seen:
                return frame, Transform.identity()
            seen.add(frame)
        return frame, pose


STRING, TF, JOINT_STATE = "std_msgs/msg/String", "tf2_msgs/msg/TFMessage", "sensor_msgs/msg/JointState"
DESCRIPTION, JOINT_STATES = "robot_description", "joint_states"
TF_STATIC, TF_OF_ALL = "/tf_static", ("/tf", "/tf_static", POSES_TOPIC)
FIRST_SECONDS = 2.0
"""Seconds at the start and at the end of a recording in which every frame is expected once."""
MOST_STATIC_BYTES = 1 << 24
"""Limit for /tf_static: 100,000 transforms, which take 2 s to read. A robot has less than 1000."""
MOST_SAMPLED_BYTES = MOST_STATIC_BYTES // 2
"""Limit for the messages at the start and for those at the end, so that both take 2 s to read. 1000 joints
at 100 Hz take 5 MB in FIRST_SECONDS."""
OTHER_CLOCK = 5.0
"""Seconds between a message's stamp and its recording time from which they count as different clocks."""


BASES = ("base_footprint", "base_link")
"""The frames of a robot that the others are shown around, if the robot itself is not known."""
MOST_SEARCHED = 100
"""Messages in which the frame of a sensor is searched."""


class RecordedRun:
    """An open recording. `description` is a file that describes the robot to display."""

    def __init__(self, path: str, robot: str = "") -> None:
        """`robot` is the file of a robot to display instead of the recorded one.

        Raises:
            KbotError: there is no such recording, or it does not contain what is needed to display it.
        """
        self.path = path
        self.index = open_index(path)
        notes = self.index.notes
        self.facts = notes.get("kbot") or notes.get("kbot.cut", {})
        """What KBot's recorder stored about the run. It is empty for recordings of other programs."""
        self.topics = {
            name: kind
            for name, type_name in sorted(self.index.topics.items())
            if (kind := known_type(type_name)) is not None
        }
        """Names and types of the topics that can be displayed."""
        self.moves = [name for name, kind in self.index.topics.items() if kind in (TF, JOINT_STATE)]
        """The topics with the robot's pose and its joint positions."""
        described, text = self._find_description()
        own = self._namespace(described)
        joints = [name for name in self.moves if self.index.topics[name] == JOINT_STATE]
        frames = [name for name in self.moves if self.index.topics[name] == TF]
        self.of_robot = [
            *_among(joints, {f"{own}/{JOINT_STATES}"}, {f"/{JOINT_STATES}"}, _within(own, joints)),
            *_among(frames, {*TF_OF_ALL, *_within(own, frames)} if own else set(TF_OF_ALL)),
        ]
        """The topics in `moves` of the robot on display, not of another robot with the same joint names."""
        odometry = [name for name, kind in self.topics.items() if kind is Odometry]
        self.odometry = _among(odometry, {f"{own}/odom"}, _within(own, odometry))[:1]
        """The odometry topic of the robot, if there is one."""
        self.urdf = "" if robot else text
        """The recorded description on display. Empty if there is none, or if another robot is displayed."""
        self.has_robot = bool(robot or text)
        """Whether a robot is known. Otherwise only frames and sensors are displayed."""
        if not self.topics:
            raise KbotError(f"{path} has no topics that KBot can display")
        if self.has_robot and not self.moves:
            raise KbotError(
                f"{path} has neither /tf nor /joint_states, so nothing would move. Record one of them too"
            )
        self.statics = self._read_statics()
        self.description = robot or self._write(text or self._frame_alone())
        self.stamp_offset = self._offset()
        """Nanoseconds from the recording's clock to the clock of its stamps."""

    @property
    def start(self) -> Transform:
        """The robot's pose in the world when its odometry was at zero."""
        try:
            x, y, yaw = map(float, parse_json(self.facts["start"]))
        except (KeyError, ValueError, TypeError):
            return Transform.identity()
        return Transform.from_xyz_rpy((x, y, 0.0), (0.0, 0.0, yaw))

    @property
    def seed(self) -> int:
        """The seed of the recorded run, or 0 if it was not stored."""
        seed = self.facts.get("seed", "0")
        return int(seed) if seed.isdecimal() else 0

    @property
    def seconds(self) -> float:
        return (self.index.end - self.index.start) * 1e-9

    def rate(self, topic: str) -> float:
        """Return the mean number of messages per second; 0 for fewer than two messages or if it is
        unknown."""
        count = self.index.counts.get(topic, 0)
        return count / self.seconds if count > 1 and self.seconds > 0.0 else 0.0

    def seconds_at(self, nanoseconds: int) -> float:
        """Convert a time of the recording's clock to the stamps of its messages, in s."""
        return (nanoseconds + self.stamp_offset) * 1e-9

    def read(self, entry: RecordedMessage) -> Any:  # noqa: ANN401 - a message of the topic's type
        """Return the message, or None for a type that KBot does not have, and for a message about movement
        with more than MOST_SAMPLED_BYTES. Raises KbotError if the bytes are invalid."""
        kind = self.topics.get(entry.topic)
        is_frequent = kind in (TFMessage, JointState) and entry.topic != TF_STATIC  # that has its own limit
        if is_frequent and len(entry.data) > MOST_SAMPLED_BYTES:
            return None
        return None if kind is None else decode_cdr(entry.cdr, kind)

    def samples(self) -> Iterator[RecordedMessage]:
        """Yield messages about movement at the start and at the end, up to MOST_SAMPLED_BYTES of each."""
        span = round(FIRST_SECONDS * 1e9)
        start, end = self.index.start, self.index.end
        for after, until in (
            (start - 1, min(start + span, end)),
            (max(start + span, end - span), end),
        ):
            left = MOST_SAMPLED_BYTES
            for entry in self.index.between(self.moves, after, until):
                left -= len(entry.data)
                if left < 0:
                    break
                yield entry

    def _read_statics(self) -> list[TFMessage]:
        """Return all messages on /tf_static. Raises KbotError if there are too many to hold in memory."""
        statics, left = [], MOST_STATIC_BYTES
        for entry in self.index.between((TF_STATIC,), self.index.start - 1, self.index.end):
            left -= len(entry.data)
            if left < 0:
                raise KbotError(f"{self.path} has more than {MOST_STATIC_BYTES:,} bytes on {TF_STATIC}")
            if isinstance(message := self.read(entry), TFMessage):
                statics.append(message)
        return statics

    def _find_description(self) -> tuple[str, str]:
        """Return topic and text of the recorded robot, or empty strings. A description in the root namespace
        comes first."""
        for name in sorted(self.index.topics, key=lambda name: name.count("/")):
            if self.index.topics[name] == STRING and name.endswith(f"/{DESCRIPTION}"):
                entry = self.index.newest(name, self.index.end)
                if entry is not None and (text := str(entry.message().data)).strip():
                    return name, text
        return "", ""

    def _frame_alone(self) -> str:
        """Return the description of a robot that consists of one frame: its base on tf, otherwise the frame
        of a sensor."""
        messages = chain(self.statics, (self.read(entry) for entry in self.samples()))
        transforms = (t for message in messages if isinstance(message, TFMessage) for t in message.transforms)
        frames = (plain(name) for t in transforms for name in (t.child_frame_id, t.header.frame_id))
        found: dict[str, str] = {}
        for name in frames:
            found.setdefault(name.rpartition("/")[2], name)
            if BASES[0] in found:  # the first of BASES comes before all others
                break
        of_base = (found[base] for base in BASES if base in found)
        frame = next(of_base, "") or next(iter(found.values()), "") or self._frame_of_sensor()
        return f'<robot name="frames"><link name="{escaped(frame or BASES[-1])}"/></robot>'

    def _frame_of_sensor(self) -> str:
        # messages without a header are not decoded: a list of transforms takes long
        topics = [
            name for name, kind in self.topics.items() if "header" in {field.name for field in fields(kind)}
        ]
        entries = self.index.between(topics, self.index.start - 1, self.index.end)
        headers = (getattr(self.read(entry), "header", None) for entry in islice(entries, MOST_SEARCHED))
        return next((plain(header.frame_id) for header in headers if header and header.frame_id), "")

    def _namespace(self, described: str) -> str:
        """Return the robot's namespace, for example `/a`: the stored one, otherwise that of its
        description."""
        try:
            _, namespace, _ = parse_json(self.facts["naming"])
        except (KeyError, ValueError, TypeError):
            return described.removesuffix(f"/{DESCRIPTION}")
        return f"/{namespace}" if namespace else ""

    def _write(self, text: str) -> str:
        folder = TemporaryFolder("recording")
        weakref.finalize(self, folder.remove)
        file = folder.path / f"{Path(self.path).stem or 'robot'}.urdf"
        file.write_text(text, encoding="utf-8")
        return str(file)

    def _offset(self) -> int:
        for entry in self.samples():
            message = self.read(entry)
            first = message.transforms[:1] if isinstance(message, TFMessage) else (message,)
            for stamped in first:
                offset: int = stamped.header.stamp.nanoseconds - entry.nanoseconds
                return offset if abs(offset) > OTHER_CLOCK * 1e9 else 0
        return 0


def _within(namespace: str, topics: Iterable[str]) -> set[str]:
    return {name for name in topics if name.startswith(f"{namespace}/")}


def _among(topics: list[str], *wanted: Collection[str]) -> list[str]:
    """Return the topics in the first of the wanted sets that any of them is in, otherwise all topics."""
    for names in wanted:
        if found := [name for name in topics if name in names]:
            return found
    return topics
