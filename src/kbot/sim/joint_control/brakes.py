"""Finds the joints of a driving robot that nothing commands, which a brake therefore holds.

On a real robot the motor or the brake of such a joint holds an arm up while the robot drives. Without one,
the arm would drop and drag on the floor.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator

from kbot.kinematics.drive.drive import DifferentialDrive, NoDrive
from kbot.kinematics.drive.part_names import WHEEL
from kbot.kinematics.drive.wheels import is_caster
from kbot.model import Joint, JointType, RobotModel

_LIMITED = (JointType.REVOLUTE, JointType.PRISMATIC)


def braked_joints(
    robot: RobotModel, drive: DifferentialDrive | NoDrive, free: Collection[str]
) -> tuple[str, ...]:
    """The joints among `free`, those that nothing commands, that are held at their start positions.

    These are the joints of arms, heads and lifts: revolute and prismatic joints, whose limits mean that a
    motor moves them, and the continuous joints above and below these. Other joints move freely, as in Gazebo:

    - all joints of a robot that does not drive, such as an arm or a pendulum on a table
    - joints on which the robot stands: suspensions, casters with their swivels, and the hitch of a trailer
    - continuous joints that carry no joint with limits, and are not carried by one: a pendulum, a fan
    - mimic joints, which follow another joint
    """
    if isinstance(drive, NoDrive):
        return ()
    standing = {drive.wheels[name].link for name in drive.joints}.union(drive.casters)
    for joint in robot.joints.values():
        if is_caster(joint) or WHEEL.search(joint.name) or WHEEL.search(joint.child):
            standing.add(joint.child)
    legs = {joint.name for link in standing for joint in _joints_above(robot, link)}
    able = [joint for joint in robot.movable_joints if joint.name in free and joint.name not in legs]
    limited = {joint.name for joint in able if joint.type in _LIMITED and joint.range[0] < joint.range[1]}
    carrying = {above.name for name in limited for above in _joints_above(robot, robot.joints[name].parent)}
    return tuple(
        joint.name
        for joint in able
        if joint.name in limited
        or (
            joint.type is JointType.CONTINUOUS
            and (joint.name in carrying or any(a.name in limited for a in _joints_above(robot, joint.parent)))
        )
    )


def _joints_above(robot: RobotModel, link: str) -> Iterator[Joint]:
    """The joints from a link up to the root."""
    while link != robot.root:
        yield robot.parent_joint[link]
        link = robot.parent_joint[link].parent
