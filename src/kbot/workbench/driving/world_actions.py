"""What a page may do to a running world: spawn, delete, move and push objects, and inject faults."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import Literal

from kbot.kinematics.transform import Transform
from kbot.model import RobotModel
from kbot.sim import Simulation
from kbot.sim.injected_faults import BlockedJoint, Fault, LostCommands, Payload, SilentTopic, Slip
from kbot.sim.joint_control.kinds import Interface
from kbot.text import KbotError
from kbot.workbench.protocol import (
    Action,
    Delete,
    Disturb,
    EndFault,
    FaultView,
    JointSpeed,
    Kick,
    MoveModel,
    ResetPart,
    Spawn,
)
from kbot.world.things import BOX, THINGS

ROBOT = "robot"
"""What stands for one more of the robot on show."""
SPAWNED = (*THINGS, ROBOT)
MOST_MODELS = 60
MOST_FAULTS = 200
DROP = 0.005
"""Metres above the place that a thing is dropped from."""


def model_of(simulation: Simulation, name: str) -> str:
    """The robot or thing that something belongs to which a page names: `robot_2/base_link`, or a body."""
    owner = name.partition("/")[0]
    return owner if owner in simulation.robots else name


class WorldActions:
    """Does what pages ask of a simulation, within bounds of how much."""

    def __init__(self, simulation: Simulation) -> None:
        self._sim = simulation
        self._at_first = len(simulation.world.bodies) + len(simulation.robots)
        self._faults = 0

    def do(self, action: Action) -> None:
        """Raises KbotError: it cannot be done; the text says why."""
        sim = self._sim
        match action:
            case Spawn():
                self._spawn(action)
            case Delete(name=name):
                sim.models.delete_model(model_of(sim, name))
            case MoveModel(name=name, x=x, y=y, z=z, yaw=yaw):
                self._move(model_of(sim, name), x, y, z, yaw)
            case Kick(x=x, y=y, z=z):
                sim.models.set_twist((x, y, z))
            case Disturb():
                self._disturb(action)
            case EndFault(number=number):
                sim.disturbances.end_fault(round(number))
            case ResetPart(what=what):
                {"world": sim.snapshots.reset_world, "time": sim.snapshots.reset_time}[what]()
            case JointSpeed(name=name, velocity=velocity):
                sim.robots.first.command_joints({name: velocity}, Interface.VELOCITY)

    def _spawn(self, asked: Spawn) -> None:
        sim = self._sim
        if len(sim.world.bodies) + len(sim.robots) - self._at_first >= MOST_MODELS:
            raise KbotError(f"{MOST_MODELS} things were added already: delete some first")
        if asked.what == ROBOT:
            number = next(n for n in range(2, MOST_MODELS + 3) if f"robot_{n}" not in sim.robots)
            sim.models.spawn_model(sim.robot, f"robot_{number}", asked.x, asked.y, asked.yaw)
            return
        size = (asked.length, asked.width, asked.height) if asked.what == BOX else None
        sim.models.spawn_thing(asked.what, None, asked.x, asked.y, asked.z + DROP, asked.yaw, size)

    def _move(self, model: str, x: float, y: float, z: float, yaw: float) -> None:
        """A robot stands where it is put; a thing falls from there."""
        robot = self._sim.robots.get(model)
        if robot is None:
            self._sim.models.set_model_state(model, Transform.from_xyz_rpy((x, y, z), (0.0, 0.0, yaw)))
            return
        if robot.can_drive:
            robot.cmd_vel(0.0, 0.0)
        self._sim.models.set_pose(x, y, yaw, model)

    def _disturb(self, asked: Disturb) -> None:
        sim = self._sim
        if self._faults >= MOST_FAULTS:
            raise KbotError(f"{MOST_FAULTS} faults were asked for already: start again in a world for more")
        sim.disturbances.schedule(_fault(asked), sim.time, asked.seconds)
        self._faults += 1


def _fault(asked: Disturb) -> Fault:
    match asked.fault:
        case "slip":
            return Slip(asked.target, asked.value)
        case "payload":
            return Payload(asked.target, asked.value)
        case "blocked":
            return BlockedJoint(asked.target)
        case _:
            return SilentTopic(asked.target)


def push(simulation: Simulation, name: str, force: tuple[float, float, float], seconds: float) -> None:
    """Push a link of the robot on show, a link of another (`robot_2/base_link`), or a body of the world.

    Raises:
        KbotError: there is nothing of that name, or it stands still for good.
    """
    owner, _, link = name.partition("/")
    if link and owner in simulation.robots:
        simulation.disturbances.apply_body_wrench(link, force, seconds, robot=owner)
    else:
        simulation.disturbances.apply_body_wrench(name, force, seconds)


def faults(simulation: Simulation) -> tuple[FaultView, ...]:
    """What goes wrong now, or will."""
    return tuple(
        FaultView(one.number, _words(one.fault), one.start, one.stop if isfinite(one.stop) else None)
        for one in simulation.disturbances.faults
    )


def _words(fault: Fault) -> str:
    match fault:
        case Slip(link=link, friction=friction):
            return f"{link} slips: friction {friction:g}"
        case Payload(link=link, mass=mass):
            return f"{link} carries {mass:g} kg"
        case BlockedJoint(joint=joint):
            return f"{joint} is blocked"
        case SilentTopic(topic=topic):
            return f"{topic} is silent"
        case LostCommands(share=share):
            return f"{share:.0%} of commands are lost"
    return type(fault).__name__


def joint_controls(simulation: Simulation) -> Mapping[str, Literal["position", "velocity"]]:
    """How each joint that has a controller is told where to go."""
    robot = simulation.robots.first
    controls: dict[str, Literal["position", "velocity"]] = {}
    for controller in robot.joints.control.controllers:
        for joint in controller.joints:
            if controller.interface is Interface.VELOCITY:
                controls.setdefault(joint, "velocity")
            elif controller.interface is Interface.POSITION:
                controls[joint] = "position"
    for joint in robot.joints.control.holds:
        controls.setdefault(joint, "position")
    return controls


def other_robots(simulation: Simulation) -> Mapping[str, RobotModel]:
    """Those besides the one on show."""
    return {name: robot.robot for name, robot in list(simulation.robots.items())[1:]}
