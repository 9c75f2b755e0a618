"""Bases that steer by turning wheels aside: tricycles and cars, found from the model.

Every wheel rolls about the same point (Siegwart, Introduction to Autonomous Mobile Robots, 3.2): one at x, y
from the middle of the fixed axle goes (v - w y, w x) when that goes ahead at v and turns at w.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

from kbot.kinematics.controllers import steering_plugin_joints, velocity_joints
from kbot.kinematics.differential_drive import drive_of, find_drive
from kbot.kinematics.drive import DifferentialDrive, NoDrive
from kbot.kinematics.frames import FrameTree, unit_axis
from kbot.kinematics.wheels import Wheel, find_wheel, movable_ancestor
from kbot.model import Joint, JointType, Robot

_UPRIGHT = 0.9
"""Cosine by which a steering axis may lean."""


@dataclass(frozen=True, slots=True)
class SteeringWheel:
    """A wheel that is turned aside: `x`, `y` (m) of its middle in the frame of the fixed axle. `upward` is
    1.0 where a positive angle of `joint` turns it to the left, else -1.0. It rolls on the joint `rolls`."""

    joint: str
    rolls: str
    x: float
    y: float
    upward: float
    lower: float
    upper: float


@dataclass(frozen=True, slots=True)
class SteeredDrive(DifferentialDrive):
    """The fixed axle as a differential drive has it, the wheels that steer, and the joints that drive."""

    steering: tuple[SteeringWheel, ...]
    traction: tuple[str, ...]

    @property
    def joints(self) -> tuple[str, ...]:
        """Those that drive."""
        return self.traction


def find_base(robot: Robot) -> DifferentialDrive | NoDrive:
    """How a robot drives: by two sides, or by wheels that steer; else why it does not. Never raises."""
    tree = FrameTree(robot)
    drive = find_drive(robot, tree)
    if isinstance(drive, DifferentialDrive):
        return drive
    return _steered(robot, tree) or drive


def _steered(robot: Robot, tree: FrameTree) -> SteeredDrive | None:
    turning = [joint for joint in robot.joints.values() if joint.type is JointType.CONTINUOUS]
    steered = [(joint, above) for joint in turning if (above := _steering_joint(tree, joint)) is not None]
    rigid = [joint for joint in turning if movable_ancestor(robot, joint) is None]
    axle = drive_of(robot, tree, rigid)
    if not steered or isinstance(axle, NoDrive) or len(axle.left) != 1:
        return None
    found = [(above, find_wheel(tree, joint, axle.base)) for joint, above in steered]
    wheels = [(above, wheel) for above, wheel in found if isinstance(wheel, Wheel)]
    steering = tuple(_placed(tree, axle, above, wheel) for above, wheel in wheels)
    if not steering or any(abs(wheel.x) < axle.radius for wheel in steering):
        return None
    own = {field.name: getattr(axle, field.name) for field in fields(DifferentialDrive)}
    all_wheels = {**axle.wheels, **{wheel.joint: wheel for _, wheel in wheels}}
    leftward = axle.axle_in_base.rotation[:, 1]
    own["wheels"] = all_wheels
    own["forward"] = {
        name: 1.0 if wheel.axis @ leftward > 0.0 else -1.0 for name, wheel in all_wheels.items()
    }
    links = {wheel.link for wheel in all_wheels.values()}
    own["casters"] = tuple(link for link in axle.casters if link not in links)
    named = [*steering_plugin_joints(robot), *velocity_joints(robot)]
    traction = tuple(dict.fromkeys(joint.name for joint in named if joint.name in all_wheels))
    return SteeredDrive(**own, steering=steering, traction=traction or (*axle.left, *axle.right))


def _steering_joint(tree: FrameTree, joint: Joint) -> Joint | None:
    """The upright joint above a wheel that turns it aside within limits; a swivel caster's has none."""
    above = movable_ancestor(tree.robot, joint)
    if (
        above is None
        or above.type is not JointType.REVOLUTE
        or movable_ancestor(tree.robot, above) is not None
    ):
        return None
    axis = tree.pose(above.child).rotation @ unit_axis(above)
    return above if abs(axis[2]) > _UPRIGHT else None


def _placed(tree: FrameTree, axle: DifferentialDrive, above: Joint, wheel: Wheel) -> SteeringWheel:
    x, y, _ = axle.axle_in_base.inverse().apply(wheel.center).tolist()
    axis = tree.pose(above.child).rotation @ unit_axis(above)
    limit = above.limit
    lower, upper = (limit.lower or 0.0, limit.upper or 0.0) if limit is not None else (0.0, 0.0)
    return SteeringWheel(above.name, wheel.joint, x, y, 1.0 if axis[2] > 0.0 else -1.0, lower, upper)
