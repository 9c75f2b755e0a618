"""joint_state_publisher: its settings, and joints that depend on others as it computes them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from kbot.model import Mimic, RobotModel

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
