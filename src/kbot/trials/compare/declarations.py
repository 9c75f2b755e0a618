"""What a robot declares and a run does not measure: its sensors, its topics, and the frames of its links.

Each is a part with settings, such as the part `sensor scan` with the setting `yaw`. A difference in any of
them is a change for the programs that use the robot, also if it drives as before.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import partial
from typing import Any, NamedTuple, TypeAlias, TypeVar

from kbot.kinematics.frames import FrameTree
from kbot.kinematics.transform import Transform
from kbot.messages import TFMessage
from kbot.model import RobotModel
from kbot.model.extensions import extensions
from kbot.sensors.declared import declared_sensors
from kbot.sensors.force_torque import ForceTorque
from kbot.sensors.noise import Noise
from kbot.sensors.sensor import Spec
from kbot.sim import Simulation
from kbot.sim.recipe import CONTROL_PERIOD
from kbot.text import Element
from kbot.text.numbers import NUMBER

_TOLERANCE = 1e-9
"""Relative difference of equal numbers, and absolute in m and rad: poses are products of rotations, which
round at 1e-16."""
_UNITS: Mapping[str, str] = {
    **dict.fromkeys(("x", "y", "z", "range_min", "range_max", "near", "far", "spacing"), "m"),
    **dict.fromkeys(("roll", "pitch", "yaw", "fov", "field_of_view", "angle_min", "angle_max"), "rad"),
    **dict.fromkeys(("elevation_min", "elevation_max"), "rad"),
    "rate": "Hz",
    "latency": "s",
}
"""The unit by the last word of a setting's name."""
_NOT_SETTINGS = ("name", "origin", "robot", "pose", "frame", "topic", "info_topic", "depth_topic")
"""Fields of a sensor's specification that are not settings, or from which a setting is computed."""
_EXTENSIONS = ("gazebo", "ros2_control")
"""The extensions that declare sensors."""

T = TypeVar("T")
Setting: TypeAlias = "float | str"
Settings = Mapping[str, Setting]


@dataclass(frozen=True, slots=True)
class DeclaredDifference:
    """A setting that two robots declare differently. None: one of them does not have it.

    part     what the setting belongs to, such as `sensor scan`, `topic /odom` or `frame camera`
    setting  its name; `exists` if one robot does not have the part
    """

    part: str
    setting: str
    unit: str
    before: Setting | None
    after: Setting | None

    @property
    def is_significant(self) -> bool:
        return True

    @property
    def size(self) -> float:
        """0: measured differences come first, because sizes of settings cannot be compared with theirs."""
        return 0.0

    @property
    def key(self) -> tuple[str, str]:
        return self.part, self.setting

    @property
    def label(self) -> str:
        return f"{self.part} {self.setting}"

    def to_json(self) -> dict[str, object]:
        return {
            "part": self.part,
            "setting": self.setting,
            "unit": self.unit,
            "before": self.before,
            "after": self.after,
        }


class Declarations(NamedTuple):
    """The settings of each part.

    read     as KBot uses them
    written  those of `<sensor>` elements as they are written, also what KBot does not use
    """

    read: Mapping[str, Settings]
    written: Mapping[str, Settings]

    def differences(self, after: Declarations) -> tuple[DeclaredDifference, ...]:
        """The settings that differ, in the order of the parts of `self`, then of `after`."""
        found: list[DeclaredDifference] = []
        for part in dict.fromkeys((*self.read, *after.read, *self.written, *after.written)):
            differing = _differing(part, self.read.get(part), after.read.get(part))
            # a sensor that KBot reads as before may still be declared in another way
            found += differing or _differing(part, self.written.get(part), after.written.get(part))
        return tuple(found)


def declarations(robot: RobotModel) -> Declarations:
    """The sensors, topics and frames of a robot.

    Its topics are those of a simulation, with the frames of their messages.

    Raises:
        DescriptionError: the robot cannot be simulated.
    """
    read = {**dict(_sensors(robot)), **dict(_topics(robot)), **dict(_frames(robot))}
    return Declarations(read, dict(_written(robot)))


# Any: messages of a simulation and of a recording have classes of their own
def of_topic(kind: type | str, message: Any = None) -> dict[str, Setting]:  # noqa: ANN401
    """The settings of a topic: its type, and the frames and covariances of a message."""
    found: dict[str, Setting] = {"type": kind if isinstance(kind, str) else kind.__name__}
    if hasattr(message, "transforms"):
        pairs = ((each.header.frame_id, each.child_frame_id) for each in message.transforms)
        return {**found, "frames": ", ".join(sorted(f"{child} in {parent}" for parent, child in pairs))}
    header = getattr(message, "header", None)
    if header is not None:
        found["frame"] = str(header.frame_id)
    if hasattr(message, "child_frame_id") and hasattr(message, "twist"):
        found["child_frame"] = str(message.child_frame_id)
        found["pose covariance"] = _of_covariance(message.pose.covariance)
        found["twist covariance"] = _of_covariance(message.twist.covariance)
    return found


def of_pose(pose: Transform) -> dict[str, Setting]:
    """The settings x, y, z in m and roll, pitch, yaw in rad of a pose."""
    angles = (angle + 2.0 * math.pi if angle < -math.pi + _TOLERANCE else angle for angle in pose.rpy)
    values = (*pose.translation.tolist(), *angles)
    return dict(zip(("x", "y", "z", "roll", "pitch", "yaw"), values, strict=True))


def _differing(part: str, before: Settings | None, after: Settings | None) -> list[DeclaredDifference]:
    if before is None and after is None:
        return []
    if before is None or after is None:
        exists = ("no", "yes") if before is None else ("yes", "no")
        return [DeclaredDifference(part, "exists", "", *exists)]
    return [
        DeclaredDifference(part, name, _unit(name), before.get(name), after.get(name))
        for name in dict.fromkeys((*before, *after))
        if not _is_same(before.get(name), after.get(name))
    ]


def _is_same(one: Setting | None, other: Setting | None) -> bool:
    if isinstance(one, float) and isinstance(other, float):
        return math.isclose(one, other, rel_tol=_TOLERANCE, abs_tol=_TOLERANCE)
    return one == other


def _unit(setting: str) -> str:
    return _UNITS.get(setting.rpartition(" ")[2], "")


def _sensors(robot: RobotModel) -> Iterator[tuple[str, Settings]]:
    tree = FrameTree(robot)
    specs = declared_sensors(robot).specs
    for name, spec in _numbered((spec.label, spec) for spec in specs):
        root_from_link = tree.pose(_mount(robot, spec))
        settings: dict[str, Setting] = {
            "kind": type(spec).__name__,
            **of_pose(root_from_link @ spec.pose),
            **_of_spec(spec),
            "topic": ", ".join(spec.topics),
            "frame": spec.frame or spec.link,
        }
        yield f"sensor {name}", settings


def _mount(robot: RobotModel, spec: Spec) -> str:
    """The link that carries a sensor. The link of a force-torque sensor only names a frame."""
    if isinstance(spec, ForceTorque) and spec.joint in robot.joints:
        return robot.joints[spec.joint].child
    return spec.link if spec.link in robot.links else robot.root


def _of_spec(spec: Spec) -> dict[str, Setting]:
    found: dict[str, Setting] = {}
    for field in fields(spec):
        value = getattr(spec, field.name)
        if field.name in _NOT_SETTINGS:
            continue
        if isinstance(value, Noise):
            found |= {f"{field.name} {each.name}": getattr(value, each.name) for each in fields(value)}
        elif isinstance(value, Transform):
            found |= {f"{field.name} {name}": number for name, number in of_pose(value).items()}
        else:
            found[field.name] = _plain(value)
    return found


def _plain(value: object) -> Setting:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int | float):
        return float(value)
    return ", ".join(map(str, value)) if isinstance(value, tuple) else str(value or "")


def _of_covariance(values: Sequence[float]) -> str:
    """The diagonal of a covariance matrix of 6 x 6, or all its numbers if others are not 0."""
    diagonal = values[::7]
    is_diagonal = sum(map(bool, values)) == sum(map(bool, diagonal))
    text = " ".join(f"{value:g}" for value in (diagonal if is_diagonal else values))
    return f"diagonal {text}" if is_diagonal else text


def _topics(robot: RobotModel) -> Iterator[tuple[str, Settings]]:
    """The topics of a simulation without sensors, whose topics are settings of the sensors."""
    simulation = Simulation(robot)
    bus = simulation.bus
    topics, last = bus.topics, dict[str, object]()
    for topic, kind in topics.items():
        bus.subscribe(topic, kind, partial(last.__setitem__, topic), passive=True)
    simulation.run(2.0 * CONTROL_PERIOD)  # each is published once in a period
    for topic, kind in topics.items():
        direction = "subscribed" if topic in bus.inputs else "published"
        # the transforms of links are parts of their own, and are on /tf without this one
        part = f"odometry on {topic}" if kind is TFMessage else f"topic {topic}"
        yield (
            part,
            {
                **of_topic(kind, last.get(topic)),
                "direction": direction,
                "rate": bus.rate(topic),
            },
        )


def _frames(robot: RobotModel) -> Iterator[tuple[str, Settings]]:
    """The frames of links in their parents, as on /tf and /tf_static with all joints at zero."""
    for joint in robot.joints.values():
        pose = Transform.from_xyz_rpy(joint.pose.xyz, joint.pose.rpy)
        yield f"frame {joint.child}", {"parent": joint.parent, **of_pose(pose)}


def _written(robot: RobotModel) -> Iterator[tuple[str, Settings]]:
    elements = (
        sensor
        for tag in _EXTENSIONS
        for extension in extensions(robot, tag)
        for sensor in extension.elements("sensor")
    )
    named = ((each.attributes.get("name") or each.attributes.get("type", ""), each) for each in elements)
    for name, element in _numbered(named):
        yield f"sensor {name}", dict(_flat("", element))


def _flat(path: str, element: Element) -> Iterator[tuple[str, Setting]]:
    """The attributes and texts of an element and of those in it, by their paths."""
    for name, value in element.attributes.items():
        yield f"{path}@{name}", _word(value)
    if element.text.strip():
        yield path or "text", _word(element.text)
    for tag, child in _numbered((child.tag, child) for child in element.elements()):
        yield from _flat(f"{path}/{tag}" if path else tag, child)


def _word(text: str) -> Setting:
    plain = " ".join(text.split())
    return float(plain) if NUMBER.fullmatch(plain) else plain


def _numbered(items: Iterable[tuple[str, T]]) -> Iterator[tuple[str, T]]:
    """The items, with a number after a name that an earlier item has."""
    counts: dict[str, int] = {}
    for name, item in items:
        counts[name] = counts.get(name, 0) + 1
        yield name if counts[name] == 1 else f"{name} {counts[name]}", item
