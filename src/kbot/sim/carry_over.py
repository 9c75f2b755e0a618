"""What a changed robot takes over from the one whose place it takes."""

from __future__ import annotations

import numpy as np

from kbot.kinematics.transform import Transform
from kbot.sim.engine.assembly import Assembly
from kbot.sim.engine.welds import Weld
from kbot.sim.models import Models
from kbot.sim.robot import SimulatedRobot


def go_on_as(new: Models, old: Models) -> tuple[Weld, ...]:
    """Let a simulation at its start, whose first robot is a changed one, go on where another stands; what is
    attached there, and may be here."""
    new._engine.assembly.let_things_be_as_in(old._engine.assembly)
    new.frames_are_old()
    first, *others = old.robots.values()
    _put_as(new.named(), first, new, old._engine.assembly)
    moved = _make_room(new)
    for robot in others:
        pose, named = robot.ground_truth.pose, robot.naming
        again = new.spawn_model(
            robot.robot, robot.name, pose.x, pose.y, pose.yaw, named.namespace, named.frame_prefix
        )
        _put_as(again, robot, new, old._engine.assembly)
    away = {new.named().prefix + link for link in new.named().robot.links} if moved else set()
    return tuple(w for w in old._engine.assembly.welds if not away & {w.first, w.second})


def _put_as(new: SimulatedRobot, old: SimulatedRobot, simulation: Models, before: Assembly) -> None:
    """Let a changed robot stand as it stood `before`, its wheels on the same ground, and go on with what it
    was told."""
    held = old.joint_positions
    for joint in new.robot.movable_joints:
        lower, upper = joint.range
        if joint.name in held and joint.name not in new.held and lower <= held[joint.name] <= upper:
            new._set_position(joint.name, held[joint.name])
    if new.root_qpos >= 0 and old.root_qpos >= 0:
        higher = simulation._engine.assembly.height(new.root_qpos) - before.height(old.root_qpos)
        stood = old.link_pose(old.robot.root)
        place = stood.translation + np.array([0.0, 0.0, higher])
        simulation.set_model_state(new.name, Transform.from_rotation_translation(stood.rotation, place))
    new._take_over(old)


def _make_room(simulation: Models) -> bool:
    """Put the robot at its start where it is inside something now, and is not there; whether it was put."""
    robot, assembly = simulation.named(), simulation._engine.assembly
    plan = assembly.plans[robot.name]
    if robot.root_qpos < 0 or not assembly.what_it_is_inside(plan):
        return False
    stood = simulation.get_model_state(robot.name).pose
    simulation.set_pose(simulation.start.x, simulation.start.y, simulation.start.yaw)
    if not assembly.what_it_is_inside(plan):
        return True
    simulation.set_model_state(robot.name, stood)
    return False
