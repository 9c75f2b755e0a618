"""Samples the quantities of a run while it is simulated."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import mujoco
import numpy as np
from numpy.typing import NDArray

from kbot.brief import Brief, counted
from kbot.kinematics.drive.drive import DifferentialDrive
from kbot.sim import Simulation
from kbot.sim.collisions import Collisions
from kbot.sim.engine.geometry import own_geometries
from kbot.sim.engine.placing import PLANE_GROUP
from kbot.sim.engine.world_builder import PREFIX, owner
from kbot.trials.quantities import QUANTITIES

RATE = 50.0
"""Samples per second of simulated time: one per control period."""
FAR = 10.0
"""Distance in m from which clearance is not measured more exactly."""
_CLEARANCE_EVERY = 5
"""Samples between two measurements of the clearance. A robot at 1 m/s moves 0.1 m in between."""

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened in a run: a `step` of the scenario, a `touch`, or the end of a `goal`."""

    time: float
    text: str
    kind: str = "step"


@dataclass(frozen=True, repr=False)
class Trace(Brief):
    """The quantities of a run over time.

    columns         values by name of the quantity, (n,) each, in the units of `QUANTITIES`
    joints          positions in rad or m by joint, (n,) each
    support         vertical contact force in N by link, (n,) each
    events          in order of time
    touched         the names of the touched objects and robots, in order
    touched_with    the link of the robot that first touched each
    joint_limits    lowest and highest position by joint; joints without limits are not included
    last_step       time in s at which the last step of the scenario began
    """

    columns: Mapping[str, Array]
    joints: Mapping[str, Array]
    support: Mapping[str, Array]
    events: tuple[Event, ...] = ()
    touched: tuple[str, ...] = ()
    touched_with: Mapping[str, str] = field(default_factory=dict)
    joint_limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    last_step: float = 0.0

    def __getitem__(self, quantity: str) -> Array:
        return self.columns[quantity]

    def __len__(self) -> int:
        return len(self.columns["time"])

    def until_divergence(self, *quantities: str) -> Array:
        """The values of some quantities, (n, k), before the first that is not finite."""
        table = np.column_stack([self[name] for name in quantities])
        diverged = np.flatnonzero(~np.isfinite(table).all(axis=1))
        return table[: diverged[0]] if len(diverged) else table

    def _shown(self) -> Iterator[str]:
        yield counted(len(self), "sample")
        yield f"{float(self['time'][-1]) if len(self) else 0.0:g} s"
        yield counted(len(self.columns), "quantity", "quantities")


class Sampler:
    """Samples the first robot of a simulation. The owner calls `sample` at `rate` (Hz of simulated time)."""

    def __init__(self, simulation: Simulation, *, with_clearance: bool, rate: float = RATE) -> None:
        """`with_clearance`: measure the distance to objects, which takes more time than all the rest."""
        self._rate = rate
        self._simulation = simulation
        self._robot = simulation.robots.first
        drive = self._robot.drive
        self._driving = drive.joints if isinstance(drive, DifferentialDrive) else ()
        self._limits = {
            joint.name: joint.range
            for joint in self._robot.robot.movable_joints
            if joint.has_position and math.isfinite(sum(joint.range)) and joint.limit is not None
        }
        self._collisions = Collisions(simulation.robots)
        self._clearance = _Clearance(simulation) if with_clearance else None
        start, odometry = simulation.ground_truth, simulation.odometry
        self._start, self._start_yaw = start.pose, start.unwrapped_yaw
        self._world_from_odom = self._start @ odometry.pose.inverse()
        self._odometry_yaw = start.unwrapped_yaw - odometry.unwrapped_yaw
        """What is added to the yaw of odometry, which counts full turns."""
        self._rows: list[tuple[float, ...]] = []
        self._joints: list[tuple[float, ...]] = []
        self._support: list[dict[str, float]] = []
        self._carried = _Support(self._robot.body.prefix)
        self._height = float(simulation.link_pose(self._robot.base).translation[2])
        self._distance = self._energy = 0.0
        self._powers: dict[str, float] = {}
        """The power in W of each driving joint at the last sample."""
        self._last = self._start
        self._count = 0
        self.goals_reached = 0
        self.touched: dict[str, str] = {}
        self.events: list[Event] = []
        self.last_step = 0.0
        self.sample()

    @property
    def now(self) -> Mapping[str, float]:
        """The quantities at the last sample."""
        return dict(zip(_COLUMNS, self._rows[-1], strict=True))

    def sample(self) -> None:
        """Add the current quantities to the trace."""
        simulation, robot = self._simulation, self._robot
        model, data = simulation.engine.current()
        truth, by_wheels = robot.ground_truth, robot.odometry
        odometry = self._world_from_odom @ by_wheels.pose
        pose, twist, yaw = truth.pose, truth.twist, truth.unwrapped_yaw
        up = simulation.link_pose(robot.base)
        roll, pitch, _ = up.rpy
        tilt = math.acos(min(1.0, max(-1.0, float(up.rotation[2, 2]))))
        since = self._start.inverse() @ pose
        self._distance += math.hypot(pose.x - self._last.x, pose.y - self._last.y)
        self._last = pose
        effort = self._work()
        self._look_at_contacts(model, data)
        command = robot.commanded_twist
        self._rows.append(
            (
                simulation.time,
                pose.x,
                pose.y,
                float(up.translation[2]),
                yaw,
                roll,
                pitch,
                tilt,
                since.x,
                since.y,
                yaw - self._start_yaw,
                float(up.translation[2]) - self._height,
                self._distance,
                math.hypot(twist.x, twist.y),
                twist.yaw,
                odometry.x,
                odometry.y,
                by_wheels.unwrapped_yaw + self._odometry_yaw,
                math.hypot(pose.x - odometry.x, pose.y - odometry.y),
                command.x,
                command.y,
                command.yaw,
                effort,
                self._energy,
                float(len(self.touched)),
                self._clearance_now(),
                float(self.goals_reached),
            )
        )
        self._joints.append(tuple(robot.body.joint_positions.values()))
        self._support.append(self._carried.forces(model, data))
        self._count += 1

    def trace(self) -> Trace:
        table = np.array(self._rows, dtype=float)
        positions = np.array(self._joints, dtype=float).reshape(len(self._rows), -1)
        links = sorted({link for forces in self._support for link in forces})
        return Trace(
            {name: table[:, column] for column, name in enumerate(_COLUMNS)},
            {name: positions[:, column] for column, name in enumerate(self._robot.body.joint_positions)},
            {link: np.array([forces.get(link, 0.0) for forces in self._support]) for link in links},
            tuple(self.events),
            tuple(self.touched),
            dict(self.touched),
            self._limits,
            self.last_step,
        )

    def _work(self) -> float:
        """Add the work since the last sample. Returns the largest effort of a driving joint.

        Work that a joint absorbs while it brakes does not count: few motor drivers return it to the battery.
        """
        if not self._driving:
            return 0.0
        body, before = self._robot.body, self._powers
        self._powers = {joint: body.joint_power(joint) for joint in self._driving}
        for joint, power in before.items():
            self._energy += max(0.0, (power + self._powers[joint]) / 2.0 / self._rate)
        return max(abs(body.joint_effort(joint)) for joint in self._driving)

    def _look_at_contacts(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        name = self._collisions.touched(model, data)
        if name and name not in self.touched:
            link = self.touched[name] = self._collisions.link
            self.events.append(Event(self._simulation.time, f"link '{link}' touches '{name}'", "touch"))

    def _clearance_now(self) -> float:
        if self._clearance is None:
            return math.nan
        if self._count % _CLEARANCE_EVERY == 0:
            self._clearance.measure()
        return self._clearance.distance


_COLUMNS = tuple(QUANTITIES)


class _Support:
    """Measures the vertical force in N with which the ground and objects carry each link."""

    def __init__(self, prefix: str) -> None:
        """`prefix` starts the engine's names of the robot's links."""
        self._prefix = prefix
        self._model: mujoco.MjModel | None = None
        self._links: list[str] = []
        """The link of each geometry, empty for those of other bodies."""

    def forces(self, model: mujoco.MjModel, data: mujoco.MjData) -> dict[str, float]:
        if model is not self._model:
            self._model = model
            bodies = [model.body(body).name for body in model.geom_bodyid.tolist()]
            own = [name.startswith(self._prefix) for name in bodies]
            self._links = [
                name.removeprefix(self._prefix) if mine else ""
                for name, mine in zip(bodies, own, strict=True)
            ]
        forces: dict[str, float] = {}
        wrench = np.zeros(6)
        contacts = data.contact
        pairs, addresses, frames = contacts.geom.tolist(), contacts.efc_address.tolist(), contacts.frame
        for index, (one, other) in enumerate(pairs):
            first, second = self._links[one], self._links[other]
            if addresses[index] < 0 or bool(first) == bool(second):
                continue
            mujoco.mj_contactForce(model, data, index, wrench)
            # the normal points from the first geometry to the second
            frame = frames[index]
            upward = float(frame[2] * wrench[0] + frame[5] * wrench[1] + frame[8] * wrench[2])
            link, force = (second, upward) if second else (first, -upward)
            forces[link] = forces.get(link, 0.0) + force
        return forces


class _Clearance:
    """Measures the distance from the robot to the nearest object that is not ground."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._model: mujoco.MjModel | None = None
        self._own: list[int] = []
        self._others: list[int] = []
        self.distance = FAR

    def measure(self) -> None:
        model, data = self._simulation.engine.current()
        if model is not self._model:
            self._bind(model)
        self.distance = min(
            (
                mujoco.mj_geomDistance(model, data, own, other, FAR, None)
                for own in self._own
                for other in self._near(data, model)
            ),
            default=FAR,
        )

    def _bind(self, model: mujoco.MjModel) -> None:
        self._model = model
        first = self._simulation.robots.first
        own = set(own_geometries(model, first.name))
        ground = {
            PREFIX + body.name
            for body in self._simulation.world.bodies
            if any(part.ground for part in body.parts)
        }
        can_touch = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
        solid = np.flatnonzero(can_touch & (model.geom_group != PLANE_GROUP)).tolist()
        endless = (mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD)
        self._own = [geom for geom in solid if geom in own]
        self._others = [
            geom
            for geom in solid
            if geom not in own and model.geom_type[geom] not in endless and owner(model, geom) not in ground
        ]

    def _near(self, data: mujoco.MjData, model: mujoco.MjModel) -> list[int]:
        """The objects whose bounding sphere is the nearest few metres: the others cannot be the nearest."""
        if not self._others or not self._own:
            return []
        centre = data.geom_xpos[self._own].mean(axis=0)
        reach = float(
            (np.linalg.norm(data.geom_xpos[self._own] - centre, axis=1) + model.geom_rbound[self._own]).max()
        )
        apart = np.linalg.norm(data.geom_xpos[self._others] - centre, axis=1)
        lowest = apart - model.geom_rbound[self._others] - reach
        highest = float((apart + model.geom_rbound[self._others]).min())
        return [geom for geom, least in zip(self._others, lowest.tolist(), strict=True) if least <= highest]
