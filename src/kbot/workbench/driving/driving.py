"""The simulation in the page: paced by wall-clock time, driven by the page's commands."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from kbot.kinematics.planar_pose import PlanarPose, PlanarTwist
from kbot.kinematics.transform import Transform
from kbot.messages import Bus, Clock
from kbot.messages.types import WORLD
from kbot.messages.visualization import PointStamped
from kbot.model import RobotModel
from kbot.navigation import Goals, NavigationTopics, WithMap
from kbot.sensors.declared import mount_declared
from kbot.sim import Simulation
from kbot.sim.naming import Naming
from kbot.sim.snapshots import Snapshot
from kbot.sim.topics import odometry_frames
from kbot.text import Diagnostic, KbotError
from kbot.tf.foreign_frames import ForeignFrames, Frames
from kbot.workbench.driving.contact_forces import ContactForces
from kbot.workbench.driving.mover import Moment, flat
from kbot.workbench.driving.out_of_world import OutOfWorld
from kbot.workbench.driving.world_actions import (
    WorldActions,
    faults,
    joint_controls,
    model_of,
    other_robots,
    push,
)
from kbot.workbench.protocol import (
    Action,
    Delete,
    JointSpeed,
    MoveModel,
    ResetPart,
    Spawn,
)
from kbot.workbench.scene.scene import Control
from kbot.workbench.timeline.recording import RunRecording
from kbot.workbench.timeline.series import Field
from kbot.world import World, load_world, parameters

BUSY_SECONDS = 0.03
"""Longest wall-clock time that one call may step, so that the server keeps responding."""
STEPS_AT_ONCE = 20
"""Steps between two checks of the wall-clock time."""
SAME_PLACE = 0.005
"""Metres within which a robot counts as being at its earlier position."""

OnStart: TypeAlias = Callable[[Simulation], None]
"""Called with each simulation before it first moves, including those that replace the first one."""


def goals_on_map(simulation: Simulation) -> Goals:
    """Goals to which the robot drives on a map that is made while the page goes on."""
    return Goals(simulation, WithMap(simulation, in_background=True))


@dataclass(frozen=True, slots=True)
class RunSetup:
    """What stays the same when the robot changes."""

    world: World
    world_name: str
    """The name or file that the world was started with."""
    first_world_name: str
    """The same of the first world. Pages may choose it in addition to the built-in worlds."""
    seed: int
    contacts: str
    on_start: OnStart
    start: PlanarPose | None
    naming: Naming
    make_goals: Callable[[Simulation], Goals] = goals_on_map
    goal: PlanarPose | None = None
    """The first goal of each run, in the world's frame."""
    goal_has_heading: bool = False
    """Whether the yaw of the first goal counts."""


class Driving:
    """A running simulation."""

    def __init__(self, robot: RobotModel, setup: RunSetup, simulation: Simulation | None = None) -> None:
        """Start a simulation, or continue an existing one.

        Raises:
            DescriptionError: the robot cannot be simulated.
        """
        self._setup = setup
        self._sim = simulation or Simulation(
            robot,
            setup.world,
            setup.seed,
            contacts=setup.contacts,
            start=setup.start,
            naming=setup.naming,
        )
        self._owed = 0.0
        self.loop = False
        self.note = ""
        self._frames = ForeignFrames(self._sim.bus)
        mount_declared(self._sim, strict=False)  # the findings report errors in the declarations
        ContactForces(self._sim)
        self._goals = setup.make_goals(self._sim)
        navigation = NavigationTopics(self._sim, self._goals)
        self._actions = WorldActions(self._sim)
        self._out_of_world = OutOfWorld(self._sim)
        self._sim.bus.advertise("clicked_point", PointStamped)  # pages publish on it
        setup.on_start(self._sim)
        if setup.goal is not None and simulation is None:
            try:
                navigation.go(setup.goal, any_heading=not setup.goal_has_heading)
            except KbotError as error:
                self._sim.journal.report(f"the goal is refused: {error}")
        self._shown = self._moment()

    @property
    def world(self) -> str:
        return WORLD

    @property
    def bus(self) -> Bus:
        return self._sim.bus

    @property
    def clock(self) -> Clock:
        return self._sim.clock

    @property
    def seed(self) -> int:
        return self._sim.seed

    @property
    def paused(self) -> bool:
        return self._sim.paused

    @paused.setter
    def paused(self, paused: bool) -> None:
        self._sim.paused = paused

    @property
    def findings(self) -> tuple[Diagnostic, ...]:
        return self._sim.findings

    def run_errands(self) -> bool:
        return self._sim.run_errands()

    def moment(self) -> Moment:
        """Return the current state. A failed run keeps its last state until it is reset."""
        if not self._sim.engine.has_failed and self._has_finite_pose():
            self._shown = self._moment()
        return self._shown

    def _is_finite(self) -> bool:
        return not self._sim.engine.has_diverged and self._has_finite_pose()

    def _has_finite_pose(self) -> bool:
        pose, twist = self._sim.odometry.pose, self._sim.odometry.twist
        return bool(np.isfinite((pose.x, pose.y, pose.yaw, twist.x, twist.yaw)).all())

    def _moment(self) -> Moment:
        sim = self._sim
        pose, twist = sim.odometry.pose, sim.odometry.twist
        poses = sim.link_poses()
        self._out_of_world.update()
        return Moment(
            time=sim.time,
            positions=sim.joint_positions,
            poses=poses,
            frames=self._frames.poses(poses, self._odometry_frame(poses)),
            bodies=flat((*sim.models.body_poses().values(), *self._other_links())),
            command=self._commanded,
            twist=(twist.x, twist.yaw),
            odometry=(pose.x, pose.y, pose.yaw),
            faults=faults(sim),
            fallen=self._out_of_world.fallen,
            jumps=sim.robots.first.jumps,
        )

    @property
    def _commanded(self) -> tuple[float, float]:
        """The commanded speed: m/s forward and rad/s turning."""
        twist = self._sim.robots.first.commanded_twist
        return twist.x, twist.yaw

    def _other_links(self) -> Iterator[Transform]:
        for name in other_robots(self._sim):
            yield from self._sim.robots[name].body.link_poses().values()

    def _odometry_frame(self, poses: Mapping[str, Transform]) -> Frames:
        """Return the current pose of the odometry frame, also of each robot whose frames have a prefix.

        The tf publisher updates this frame only once per control period.
        """
        found: dict[str, tuple[str, Transform]] = {}
        for number, robot in enumerate(self._sim.robots.values()):
            if robot.settings is not None:
                root = robot.robot.root
                world_from_root = robot.body.link_pose(root) if number else poses[root]
                frame, *_ = odometry_frames(robot)
                found[frame] = (WORLD, world_from_root @ robot.odom_from_root.inverse())
        return found

    def advance(self, seconds: float) -> float:
        step = self._sim.timestep
        self._owed += seconds
        start, before = time.monotonic(), self._sim.time
        while self._owed >= step:
            count = min(STEPS_AT_ONCE, int(self._owed / step))
            self._sim.step(count)
            self._owed -= count * step
            if time.monotonic() - start > BUSY_SECONDS:
                self._owed = 0.0  # the machine is too slow: simulated time falls behind
        self._out_of_world.update()
        return self._sim.time - before

    def reset(self) -> None:
        self._goals.cancel("the simulation was reset")
        self._sim.reset()
        self._frames.forget()
        self._owed = 0.0

    def drive(self, linear: float, angular: float) -> None:
        self._goals.give_way("driven by hand" if linear or angular else "stopped by hand")
        self._sim.cmd_vel(linear, angular)

    def push(self, link: str, force: tuple[float, float, float], seconds: float) -> None:
        push(self._sim, link, force, seconds)

    def set_joint(self, name: str, position: float) -> None:
        if name not in self.controls:
            raise KbotError(f"the joint '{name}' cannot be set: the description has no controller for it")
        self._sim.robots.first.set_joint(name, position)

    def set_joints(self, preset: Literal["zero", "centre", "random"]) -> None:
        raise KbotError("the simulation moves the joints. Use kbot view to set them by hand")

    def act(self, action: Action) -> None:
        if isinstance(action, MoveModel) and model_of(self._sim, action.name) == self._sim.robots.first.name:
            self._goals.cancel("the robot was placed elsewhere")
        if isinstance(action, ResetPart):
            self._goals.cancel("the simulation was reset")
        if isinstance(action, JointSpeed) and action.name not in self.controls:
            raise KbotError(f"the joint '{action.name}' has no controller")
        self._actions.do(action)
        if isinstance(action, Spawn | Delete):
            self._goals.world_changed()

    @property
    def controls(self) -> Mapping[str, Control]:
        return joint_controls(self._sim)

    @property
    def present(self) -> tuple[World | None, Mapping[str, RobotModel]]:
        return self._sim.world, other_robots(self._sim)

    @property
    def timeline(self) -> None:
        return None

    def series(self, fields: Sequence[Field], start: float, end: float) -> None:
        return None

    def seek(self, at: float) -> None:
        raise KbotError("a simulation cannot seek: that needs a recording")

    def save(self) -> tuple[Snapshot, int] | None:
        if not self._is_finite():
            return None
        state = self._sim.state()
        return state, state.size

    def resume(self, saved: object) -> None:
        if not isinstance(saved, Snapshot):
            raise KbotError("this is not a saved state of a simulation")
        self._sim.restore(saved)
        if self._sim.robots.first.commanded_twist != PlanarTwist():
            # whoever drove at that time does not drive now
            self._sim.cmd_vel(0.0, 0.0)
        self._goals.cancel("the simulation was set back to an earlier time")
        self._goals.world_changed()
        self._owed = 0.0

    def record(self, recording: RunRecording) -> None:
        recording.begin(self._sim, self._setup.world_name)

    def replace(self, robot: RobotModel) -> Driving:
        """Continue with the changed robot at its current pose, or at the start pose if the current one is
        invalid."""
        other = Driving(robot, self._setup, self._sim.with_robot(robot) if self._is_finite() else None)
        if self._goals.is_driving and self._goals.status is not None:
            with suppress(KbotError):  # a robot that can no longer drive has no goal
                other._goals.go(self._goals.status.goal)
        other.paused = self.paused
        if not other._is_at_place_of(self):
            other.note = "The robot no longer fits at its position. It is back at its start pose."
        if other._sim.models.attachments < self._sim.models.attachments:
            other.note += " " * bool(other.note) + "Attachments to links that no longer exist were released."
        return other

    def _is_at_place_of(self, before: Driving) -> bool:
        here, there = (run.moment().poses[run._sim.robot.root].translation[:2] for run in (self, before))
        return bool(np.abs(here - there).max() < SAME_PLACE)

    def renewed(self, robot: RobotModel) -> Driving:
        other = Driving(robot, self._setup)
        other.paused = self.paused
        return other

    @property
    def simulation(self) -> Simulation:
        """The simulation, for a program that drives it."""
        return self._sim

    def enter(self, world: str, seed: int) -> tuple[Driving, World]:
        """Return the robot at the start of another world."""
        if world != self._setup.first_world_name:
            parameters(world)  # raises for a file: a page may not open any other world file
        place = load_world(world)
        setup = dataclasses.replace(
            self._setup, world=place, world_name=world, seed=seed, start=None, goal=None
        )
        other = Driving(self._sim.robot, setup)
        other.paused = self.paused
        return other, setup.world
