"""joint_state_publisher: says where the joints are when nothing else does."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from math import isfinite, pi

from kbot.messages import types as msg
from kbot.messages.bus import Bus
from kbot.messages.clock import Clock
from kbot.model import Joint, JointType, Mimic, RobotModel
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean

RATE = 10.0


@dataclass(frozen=True, slots=True)
class Dependent:
    """position = factor * position of `parent` + offset."""

    parent: str
    factor: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, slots=True)
class JointStateSettings:
    """`rate` in Hz; `zeros` where joints start, in rad or m; `sources` topics
    whose joint states are taken over."""

    rate: float = RATE
    zeros: Mapping[str, float] = field(default_factory=dict)
    dependent: Mapping[str, Dependent] = field(default_factory=dict)
    sources: tuple[str, ...] = ()
    use_mimic_tags: bool = True


class JointStatePublisher:
    """Says `joint_states` at `rate` (Hz of the clock's time) for every joint with a position.

    Parameters are those of the ROS node: `rate`, `source_list` (topics whose joint states are taken
    over), `use_mimic_tags`, `use_smallest_joint_limits` (the safety controller's where they are
    narrower), `zeros` and `dependent_joints`; `publish_default_positions`, `_velocities` and `_efforts`
    say which lists a message has. A joint starts at 0, or in the middle of a range that leaves 0 out; a
    continuous one turns between -pi and pi.
    """

    def __init__(
        self,
        robot: RobotModel,
        bus: Bus,
        clock: Clock,
        *,
        rate: float = RATE,
        source_list: Iterable[str] = (),
        zeros: Mapping[str, float] | None = None,
        dependent_joints: Mapping[str, Dependent] | None = None,
        use_mimic_tags: bool = True,
        use_smallest_joint_limits: bool = True,
        publish_default_positions: bool = True,
        publish_default_velocities: bool = False,
        publish_default_efforts: bool = False,
        namespace: str = "",
    ) -> None:
        self._clock = clock
        self._joints = robot.movable_joints
        self._dependent = dict(dependent_joints or {})
        if use_mimic_tags:
            for joint in self._joints:
                if joint.mimic is not None:
                    mimic = joint.mimic
                    self._dependent.setdefault(
                        joint.name, Dependent(mimic.joint, mimic.multiplier, mimic.offset)
                    )
        self.ranges = {
            joint.name: _range(joint, use_smallest_joint_limits)
            for joint in self._joints
            if joint.name not in self._dependent
        }
        self.positions = {name: _start(low, high) for name, (low, high) in self.ranges.items()}
        self._velocities: dict[str, float] = {}
        self._efforts: dict[str, float] = {}
        self._with = publish_default_positions, publish_default_velocities, publish_default_efforts
        for name, zero in (zeros or {}).items():
            self.set(name, zero)
        self._topic = bus.advertise(f"{namespace}/joint_states", msg.JointState, rate=rate)
        self._subscriptions = [bus.subscribe(topic, msg.JointState, self.hear) for topic in source_list]
        self._timer = clock.every(rate, self.publish)

    def close(self) -> None:
        """Say and hear no more."""
        self._timer.cancel()
        for subscription in self._subscriptions:
            subscription.close()

    def set(self, joint: str, position: float) -> None:
        """Put a joint at a position (rad or m), held within its range.

        Raises:
            KbotError: no such joint, one that follows another, or a number that is not finite.
        """
        if joint in self._dependent:
            raise KbotError(f"joint '{joint}' follows '{self._dependent[joint].parent}'")
        if joint not in self.ranges:
            hint = did_you_mean(joint, self.ranges)
            raise KbotError(f"there is no joint '{joint}' with a position" + (f": {hint}" if hint else ""))
        if not isfinite(position):
            raise KbotError(f"the position of joint '{joint}' is a finite number, not {position}")
        low, high = self.ranges[joint]
        self.positions[joint] = min(max(position, low), high)

    def hear(self, message: msg.JointState) -> None:
        """Take over what another source says of joints that are known."""
        for index, name in enumerate(message.name):
            if name not in self.positions:
                continue
            if index < len(message.position):
                self.positions[name] = message.position[index]
            if index < len(message.velocity):
                self._velocities[name] = message.velocity[index]
            if index < len(message.effort):
                self._efforts[name] = message.effort[index]

    def publish(self) -> None:
        """Say where every joint is now."""
        names = tuple(joint.name for joint in self._joints)
        has_position, has_velocity, has_effort = self._with
        has_velocity, has_effort = has_velocity or bool(self._velocities), has_effort or bool(self._efforts)
        self._topic.publish(
            msg.JointState(
                msg.Header(self._clock.stamp),
                names,
                tuple(self.position(name) for name in names) if has_position else (),
                tuple(self._velocities.get(n, 0.0) for n in names) if has_velocity else (),
                tuple(self._efforts.get(n, 0.0) for n in names) if has_effort else (),
            )
        )

    def position(self, joint: str) -> float:
        """Where a joint is, in rad or m; a dependent one where the chain of those it follows has it."""
        factor, offset, seen = 1.0, 0.0, {joint}
        while joint in self._dependent:
            rule = self._dependent[joint]
            offset += factor * rule.offset
            factor *= rule.factor
            joint = rule.parent
            if joint in seen:
                return offset
            seen.add(joint)
        return factor * self.positions.get(joint, 0.0) + offset


def with_dependent_joints(
    robot: RobotModel, dependent: Mapping[str, Dependent], use_mimic_tags: bool = True
) -> RobotModel:
    """The robot whose joints follow each other as the node's parameters have it, as if by mimic tags; names
    that it has not are left out."""
    joints = dict(robot.joints)
    for name, joint in robot.joints.items():
        mimic = joint.mimic if use_mimic_tags else None
        rule = dependent.get(name)
        if rule is not None and rule.parent in joints:
            mimic = Mimic(rule.parent, rule.factor, rule.offset, joint.origin)
        if mimic is not joint.mimic:
            joints[name] = replace(joint, mimic=mimic)
    return replace(robot, joints=joints)


def _range(joint: Joint, smallest: bool) -> tuple[float, float]:
    if joint.type is JointType.CONTINUOUS or joint.limit is None:
        return (-pi, pi) if joint.type is JointType.CONTINUOUS else (0.0, 0.0)
    low, high = joint.range
    if smallest and joint.safety is not None:
        low = max(low, joint.safety.soft_lower_limit)
        high = min(high, joint.safety.soft_upper_limit)
    return low, high


def _start(low: float, high: float) -> float:
    return 0.0 if low <= 0.0 <= high else (low + high) / 2.0
