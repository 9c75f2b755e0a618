"""What a page can do to a running world: spawn, delete, move and push objects, and inject faults."""

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
"""The name with which pages request another robot like the one on display."""
SPAWNABLE = (*THINGS, ROBOT)
MOST_MODELS = 60
"""Objects and robots that pages may add."""
MOST_FAULTS = 200
"""Faults that pages may inject."""
DROP = 0.005
"""Metres above the chosen place from which an object is dropped."""


def model_of(simulation: Simulation, name: str) -> str:
    """Return the robot or object that a page's name (`robot_2/base_link`, or a body) belongs to."""
    owner = name.partition("/")[0]
    return owner if owner in simulation.robots else name


class WorldActions:
    """Carries out what pages request of a simulation, within limits."""

    def __init__(self, simulation: Simulation) -> None:
        self._sim = simulation
        self._initial_count = len(simulation.world.bodies) + len(simulation.robots)
        self._faults = 0

    def do(self, action: Action) -> None:
        """Carry out an action. Raises KbotError with the reason if it is not possible."""
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

    def _spawn(self, request: Spawn) -> None:
        sim = self._sim
        if len(sim.world.bodies) + len(sim.robots) - self._initial_count >= MOST_MODELS:
            raise KbotError(f"the limit of {MOST_MODELS} added objects is reached. Delete some first")
        if request.what == ROBOT:
            number = next(n for n in range(2, MOST_MODELS + 3) if f"robot_{n}" not in sim.robots)
            sim.models.spawn_model(sim.robot, f"robot_{number}", request.x, request.y, request.yaw)
            return
        size = (request.length, request.width, request.height) if request.what == BOX else None
        sim.models.spawn_thing(request.what, None, request.x, request.y, request.z + DROP, request.yaw, size)

    def _move(self, model: str, x: float, y: float, z: float, yaw: float) -> None:
        """Move a model. A robot is placed on the ground, an object falls from its new pose."""
        robot = self._sim.robots.get(model)
        if robot is None:
            self._sim.models.set_model_state(model, Transform.from_xyz_rpy((x, y, z), (0.0, 0.0, yaw)))
            return
        if robot.can_drive:
            robot.cmd_vel(0.0, 0.0)
        self._sim.models.set_pose(x, y, yaw, model)

    def _disturb(self, request: Disturb) -> None:
        sim = self._sim
        if self._faults >= MOST_FAULTS:
            raise KbotError(
                f"the limit of {MOST_FAULTS} faults is reached. Start the world again to inject more"
            )
        sim.disturbances.schedule(_fault(request), sim.time, request.seconds)
        self._faults += 1


def _fault(request: Disturb) -> Fault:
    match request.fault:
        case "slip":
            return Slip(request.target, request.value)
        case "payload":
            return Payload(request.target, request.value)
        case "blocked":
            return BlockedJoint(request.target)
        case _:
            return SilentTopic(request.target)


def push(simulation: Simulation, name: str, force: tuple[float, float, float], seconds: float) -> None:
    """Push a link of the robot on display, a link of another robot (`robot_2/base_link`), or a body of the
    world.

    Raises:
        KbotError: nothing has this name, or it is static.
    """
    owner, _, link = name.partition("/")
    if link and owner in simulation.robots:
        simulation.disturbances.apply_body_wrench(link, force, seconds, robot=owner)
    else:
        simulation.disturbances.apply_body_wrench(name, force, seconds)


def faults(simulation: Simulation) -> tuple[FaultView, ...]:
    """Return the active and the scheduled faults."""
    return tuple(
        FaultView(
            entry.number, _describe(entry.fault), entry.start, entry.stop if isfinite(entry.stop) else None
        )
        for entry in simulation.disturbances.faults
    )


def _describe(fault: Fault) -> str:
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
    """Return the command that each joint with a controller accepts."""
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
    """Return the robots besides the one on display."""
    return {name: robot.robot for name, robot in list(simulation.robots.items())[1:]}
