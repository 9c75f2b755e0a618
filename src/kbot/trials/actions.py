"""What happens in a scenario: commands, goals, policies, scripts, pushes, faults and objects."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from kbot.kinematics.planar_pose import PlanarPose
from kbot.kinematics.transform import Transform
from kbot.learn.policies.policy import ARRIVE, Policy
from kbot.sim import Simulation
from kbot.sim.injected_faults import Fault
from kbot.sim.numbers import Vector


class Stage(Protocol):
    """Where actions take place."""

    simulation: Simulation

    def go(self, goal: PlanarPose, timeout: float | None) -> None:
        """Drive to a goal in the world's frame."""
        ...

    def go_with_policy(self, policy: Policy, goal: PlanarPose, arrive: float, timeout: float | None) -> None:
        """Drive to a goal in the world's frame with a policy, which needs no map."""
        ...

    def run_script(self, script: str | Callable[[Simulation], object]) -> None:
        """Run a script as soon as the current step of the simulation is complete."""
        ...


@runtime_checkable
class Action(Protocol):
    """Something that happens in a run."""

    def begin(self, stage: Stage) -> None:
        """Do it now. Raises KbotError: it is not possible."""
        ...


@dataclass(frozen=True, slots=True)
class Command:
    """A velocity command, which applies until the next one.

    linear   speed forwards in m/s
    angular  turning speed to the left in rad/s
    lateral  speed to the left in m/s, for holonomic bases
    """

    linear: float = 0.0
    angular: float = 0.0
    lateral: float = 0.0

    def begin(self, stage: Stage) -> None:
        stage.simulation.cmd_vel(self.linear, self.angular, self.lateral)

    def __str__(self) -> str:
        lateral = f", {self.lateral:.3g} m/s to the left" if self.lateral else ""
        return f"command {self.linear:.3g} m/s, {self.angular:.3g} rad/s{lateral}"


@dataclass(frozen=True, slots=True)
class Goal:
    """Drive to a pose in the world, on the map of the world.

    x        position in m
    y        position in m
    yaw      heading in rad
    timeout  time limit in s; by default estimated from the path
    """

    x: float
    y: float
    yaw: float = 0.0
    timeout: float | None = None

    def begin(self, stage: Stage) -> None:
        stage.go(PlanarPose(self.x, self.y, self.yaw), self.timeout)

    def __str__(self) -> str:
        return f"goal {self.x:.3g}, {self.y:.3g}"


@dataclass(frozen=True, slots=True)
class Point:
    """A point on the ground.

    x  position in m
    y  position in m
    """

    x: float
    y: float


@dataclass(frozen=True, slots=True)
class DriveWithPolicy:
    """Drive to a point in the world with a policy, by odometry and the robot's lidar.

    file     ONNX file of the policy
    goal     where the policy drives
    arrive   distance in m from the goal that counts as reached
    timeout  time limit in s; by default estimated from the distance
    """

    file: str
    goal: Point
    arrive: float = ARRIVE
    timeout: float | None = None

    def begin(self, stage: Stage) -> None:
        policy, goal = Policy.read(self.file), PlanarPose(self.goal.x, self.goal.y)
        stage.go_with_policy(policy, goal, self.arrive, self.timeout)

    def __str__(self) -> str:
        return f"policy to {self.goal.x:.3g}, {self.goal.y:.3g}"


TO_GOALS = (Goal, DriveWithPolicy)
"""The actions that drive to a goal."""


@dataclass(frozen=True, slots=True)
class RunScript:
    """Run `drive(sim)` of a Python file, or in Python any function of a simulation."""

    script: str | Callable[[Simulation], object]

    def begin(self, stage: Stage) -> None:
        stage.run_script(self.script)

    def __str__(self) -> str:
        return f"script {self.script if isinstance(self.script, str) else self.script.__name__}"


@dataclass(frozen=True, slots=True)
class JointCommand:
    """Command joints.

    joints     values by joint, in the units of the interface
    interface  `position` (rad, m), `velocity` (rad/s, m/s) or `effort` (N m, N)
    """

    joints: Mapping[str, float]
    interface: str = "position"

    def begin(self, stage: Stage) -> None:
        stage.simulation.robots.first.command_joints(self.joints, self.interface)

    def __str__(self) -> str:
        return f"joints {', '.join(self.joints)}"


@dataclass(frozen=True, slots=True)
class Push:
    """Push a link at its centre of mass.

    force     x, y, z in N, in world axes
    duration  length in s
    link      by default the base
    torque    x, y, z in N m, in world axes
    """

    force: Vector
    duration: float
    link: str | None = None
    torque: Vector = (0.0, 0.0, 0.0)

    def begin(self, stage: Stage) -> None:
        simulation = stage.simulation
        link = self.link or simulation.robot.root
        simulation.disturbances.apply_body_wrench(link, self.force, self.duration, self.torque)

    def __str__(self) -> str:
        return f"push {self.link or 'the base'}"


@dataclass(frozen=True, slots=True)
class InjectFault:
    """Inject a fault of `kbot.sim.injected_faults`.

    fault     what fails
    duration  length in s; by default until the end
    """

    fault: Fault
    duration: float | None = None

    def begin(self, stage: Stage) -> None:
        simulation = stage.simulation
        simulation.disturbances.schedule(self.fault, simulation.time, self.duration)

    def __str__(self) -> str:
        return f"fault {type(self.fault).__name__}"


@dataclass(frozen=True, slots=True)
class AddObject:
    """Add an object.

    name  name of the new object
    x     position of its foot in m
    y     position of its foot in m
    z     height of its foot in m
    yaw   heading in rad
    kind  `box`, or a model that ships with KBot
    size  of a box: x, y, z in m
    """

    name: str
    x: float
    y: float
    z: float = 0.0
    yaw: float = 0.0
    kind: str = "box"
    size: Vector | None = None

    def begin(self, stage: Stage) -> None:
        stage.simulation.models.spawn_thing(self.kind, self.name, self.x, self.y, self.z, self.yaw, self.size)

    def __str__(self) -> str:
        return f"add {self.name}"


@dataclass(frozen=True, slots=True)
class MoveObject:
    """Move an object. It is at rest there.

    name  name of the object
    x     position of its origin in m
    y     position of its origin in m
    z     height of its origin in m
    yaw   heading in rad
    """

    name: str
    x: float
    y: float
    z: float = 0.0
    yaw: float = 0.0

    def begin(self, stage: Stage) -> None:
        pose = Transform.from_xyz_rpy((self.x, self.y, self.z), (0.0, 0.0, self.yaw))
        stage.simulation.models.set_model_state(self.name, pose)

    def __str__(self) -> str:
        return f"move {self.name}"


@dataclass(frozen=True, slots=True)
class RemoveObject:
    """Remove an object from the world.

    name  name of the object
    """

    name: str

    def begin(self, stage: Stage) -> None:
        stage.simulation.models.delete_model(self.name)

    def __str__(self) -> str:
        return f"remove {self.name}"
