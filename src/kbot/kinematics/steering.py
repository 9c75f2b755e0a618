"""Wheels that are turned aside to steer, as a car's are: a robot that has them is no differential drive."""

from __future__ import annotations

from collections.abc import Sequence

from kbot.kinematics.drive import DifferentialDrive
from kbot.kinematics.frames import FrameTree, unit_axis
from kbot.kinematics.wheels import Wheel, carrier, find_wheel, movable_ancestor, pose_transform, rigid_links
from kbot.model import Cylinder, Joint, JointType, Robot


def steered_axle(robot: Robot, tree: FrameTree, turning: Sequence[Joint]) -> str:
    """Why the robot steers as a car does, by a wheel whose axle is turned; empty where it does not."""
    for joint in turning:
        above = movable_ancestor(robot, joint)
        if above is None or above.type is not JointType.REVOLUTE:
            continue
        upright = abs((tree.pose(above.child).rotation @ unit_axis(above))[2]) > 0.9
        if upright and isinstance(find_wheel(tree, joint, carrier(robot, above.parent)), Wheel):
            return f"the wheel on '{joint.name}' is steered by '{above.name}', as a car's is"
    return ""


def steered_wheel(tree: FrameTree, drive: DifferentialDrive) -> str:
    """As `steered_axle`, for a wheel on the ground that is turned aside but does not roll by a joint."""
    robot = tree.robot
    ground = float(drive.axle_in_base.translation[2]) - drive.radius
    for joint in robot.joints.values():
        if joint.type is not JointType.REVOLUTE:
            continue
        if abs((tree.pose(joint.child, drive.base).rotation @ unit_axis(joint))[2]) < 0.9:
            continue
        for link in rigid_links(robot, joint.child):
            for collision in robot.links[link].collisions:
                shape = collision.geometry
                pose = tree.pose(link, drive.base) @ pose_transform(collision.pose)
                if not isinstance(shape, Cylinder) or abs(pose.rotation[2, 2]) > 0.1:
                    continue
                if abs(float(pose.translation[2]) - shape.radius - ground) < 0.1 * drive.radius:
                    return f"the wheel '{link}' is steered by '{joint.name}', as a car's is"
    return ""
