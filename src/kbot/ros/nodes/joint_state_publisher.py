"""joint_state_publisher: its settings, and its parameter `dependent_joints`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from kbot.model import Mimic, RobotModel

RATE = 10.0
"""Hz, the node's default."""


@dataclass(frozen=True, slots=True)
class Dependent:
    """A joint whose position is `factor` * the position of `parent` + `offset`."""

    parent: str
    factor: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, slots=True)
class JointStateSettings:
    """`rate` in Hz. `zeros` are the start positions in rad or m. `sources` are topics of joint states that
    set the positions."""

    rate: float = RATE
    zeros: Mapping[str, float] = field(default_factory=dict)
    dependent: Mapping[str, Dependent] = field(default_factory=dict)
    sources: tuple[str, ...] = ()
    use_mimic_tags: bool = True


def with_dependent_joints(
    robot: RobotModel, dependent: Mapping[str, Dependent], use_mimic_tags: bool = True
) -> RobotModel:
    """The robot with a mimic tag for each of the `dependent` joints. Unknown names are ignored."""
    joints = dict(robot.joints)
    for name, joint in robot.joints.items():
        mimic = joint.mimic if use_mimic_tags else None
        rule = dependent.get(name)
        if rule is not None and rule.parent in joints:
            mimic = Mimic(rule.parent, rule.factor, rule.offset, joint.origin)
        if mimic is not joint.mimic:
            joints[name] = replace(joint, mimic=mimic)
    return replace(robot, joints=joints)
