"""What a changed robot takes over from the one whose place it takes."""

from __future__ import annotations

import numpy as np

from kbot.kinematics.transform import Transform
from kbot.sim.engine.assembly import Assembly
from kbot.sim.engine.joints import limits
from kbot.sim.models import Models
from kbot.sim.robot import SimulatedRobot


def put_as(new: SimulatedRobot, old: SimulatedRobot, simulation: Models, before: Assembly) -> None:
    """Let a changed robot stand as it stood `before`, its wheels on the same ground, and go on with what it
    was told."""
    held = old.joint_positions
    for joint in new.robot.movable_joints:
        lower, upper = limits(joint)
        if joint.name in held and joint.name not in new.held and lower <= held[joint.name] <= upper:
            new._set_position(joint.name, held[joint.name])
    if new.root_qpos >= 0 and old.root_qpos >= 0:
        higher = simulation._assembly.height(new.root_qpos) - before.height(old.root_qpos)
        stood = old.link_pose(old.robot.root)
        place = stood.translation + np.array([0.0, 0.0, higher])
        simulation.set_model_state(new.name, Transform.from_rotation_translation(stood.rotation, place))
    new.take_over(old)


def make_room(simulation: Models) -> None:
    """Put the robot at its start where it is inside something now, and is not there."""
    robot, assembly = simulation.named(), simulation._assembly
    plan = assembly.plans[robot.name]
    if robot.root_qpos < 0 or not assembly.what_it_is_inside(plan):
        return
    stood = simulation.get_model_state(robot.name).pose
    simulation.set_pose(simulation.start.x, simulation.start.y, simulation.start.yaw)
    if assembly.what_it_is_inside(plan):
        simulation.set_model_state(robot.name, stood)
