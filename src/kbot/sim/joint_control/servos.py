"""Servos of the joints that do not drive: hold a position, turn at a speed, or apply an effort.

A position servo is a critically damped spring about the joint's inertia in the current pose. It receives the
wanted position and speed, and the load on the joint (computed torque: Spong, Robot Modeling and Control,
8.3), so that a joint follows its trajectory without lag and does not sag.
"""

from __future__ import annotations

import reprlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import inf

import mujoco

from kbot.model import Joint, JointType, RobotModel, SafetyController
from kbot.sim.engine.arrays import numbers
from kbot.sim.joint_control.kinds import Interface
from kbot.sim.joint_control.trajectory import Trajectory, TrajectoryPoint
from kbot.sim.numbers import FURTHEST, is_within
from kbot.text import KbotError


@dataclass(frozen=True, slots=True)
class JointBounds:
    """`lower` and `upper` in rad or m; `speed` in rad/s or m/s, `effort` in N m or N: else endless."""

    lower: float
    upper: float
    speed: float
    effort: float
    safety: SafetyController | None

    @classmethod
    def of(cls, joint: Joint) -> JointBounds:
        lower, upper = joint.range
        limit, safety = joint.limit, joint.safety
        if joint.type is JointType.CONTINUOUS:
            # without an end, a safety controller bounds no position
            safety = None
        elif safety is not None and safety.soft_lower_limit < safety.soft_upper_limit:
            lower, upper = max(lower, safety.soft_lower_limit), min(upper, safety.soft_upper_limit)
        speed = limit.velocity if limit is not None and limit.velocity else inf
        effort = limit.effort if limit is not None and limit.effort else inf
        return cls(lower, upper, speed, effort, safety)

    def position(self, wanted: float) -> float:
        return min(max(wanted, self.lower), self.upper)

    def velocity(self, wanted: float, position: float) -> float:
        """A speed that may be commanded where the joint stands."""
        lowest, highest = self._speeds(position)
        return min(max(wanted, lowest), highest)

    def force(self, wanted: float, position: float, velocity: float) -> float:
        """An effort that may be commanded where the joint stands and as it moves."""
        lowest, highest = -self.effort, self.effort
        if self.safety is not None and self.safety.k_velocity:
            slowest, fastest = self._speeds(position)
            k = self.safety.k_velocity
            lowest = min(max(-k * (velocity - slowest), lowest), self.effort)
            highest = max(min(-k * (velocity - fastest), highest), -self.effort)
        return min(max(wanted, lowest), highest)

    def _speeds(self, position: float) -> tuple[float, float]:
        lowest, highest = -self.speed, self.speed
        if self.safety is not None and self.safety.k_position:
            k = self.safety.k_position
            lowest = min(max(-k * (position - self.lower), lowest), self.speed)
            highest = max(min(-k * (position - self.upper), highest), -self.speed)
        return lowest, highest


FREQUENCY = 50.0
"""rad/s: how fast a servo mends an error."""
LEAST_INERTIA = 1e-6


@dataclass(frozen=True, slots=True)
class _Place:
    """Of a joint in the engine; `inertia` is where the mass matrix has its own, `first` what that is with all
    joints at zero, kg m^2 or kg."""

    actuator: int
    position: int
    dof: int
    inertia: int
    first: float


@dataclass(frozen=True, slots=True)
class _Order:
    """What a joint was told; for a position also where it is told to be by now."""

    interface: Interface
    wanted: float
    now: float


@dataclass(frozen=True, slots=True)
class _Way:
    """A trajectory that is followed, from a step on."""

    joints: tuple[str, ...]
    trajectory: Trajectory
    start: int


SavedServos = tuple[dict[str, _Order], tuple[_Way, ...], dict[str, float]]


class JointServos:
    """The servos of a robot's joints that do not drive."""

    def __init__(
        self,
        robot: RobotModel,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        joints: Iterable[str],
        prefix: str,
        period: float,
        timestep: float,
    ) -> None:
        """`period`: seconds between two calls of `advance`."""
        self._ctrl = numbers(data.ctrl)
        self._gains = numbers(model.actuator_gainprm.reshape(-1))
        self._biases = numbers(model.actuator_biasprm.reshape(-1))
        self._qpos, self._qvel = numbers(data.qpos), numbers(data.qvel)
        self._bias, self._passive = numbers(data.qfrc_bias), numbers(data.qfrc_passive)
        self._mass_matrix = numbers(data.M)
        self._period, self._timestep = period, timestep
        self._places: dict[str, _Place] = {}
        self._bounds: dict[str, JointBounds] = {}
        self._inertias: dict[str, float] = {}
        """What each servo reckons with, kg m^2 or kg; far more where an arm is stretched out than folded."""
        for name in joints:
            actuator = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, prefix + name)
            if actuator >= 0:
                index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, prefix + name)
                dof = int(model.jnt_dofadr[index])
                diagonal = int(model.M_rowadr[dof] + model.M_rownnz[dof]) - 1
                first = max(float(model.dof_M0[dof]), LEAST_INERTIA)
                self._places[name] = _Place(actuator, int(model.jnt_qposadr[index]), dof, diagonal, first)
                self._inertias[name] = first
                self._bounds[name] = JointBounds.of(robot.joints[name])
        self._orders: dict[str, _Order] = {}
        self._ways: tuple[_Way, ...] = ()

    @property
    def joints(self) -> tuple[str, ...]:
        """Those that can be commanded."""
        return tuple(self._places)

    @property
    def is_active(self) -> bool:
        """Whether any is commanded, and `advance` has to be called."""
        return bool(self._orders)

    def command(self, values: Mapping[str, float], interface: Interface) -> None:
        """Tell joints where to be, how fast to go, or what to exert. Raises KbotError for no number."""
        for value in values.values():
            if not is_within(value, FURTHEST):
                raise KbotError(
                    f"a joint's {interface} is a finite number up to {FURTHEST:g}, not {reprlib.repr(value)}"
                )
        for joint, value in values.items():
            self._leave_ways(joint)
            self._take(joint, _Order(interface, float(value), self.told(joint)))

    def follow(self, joints: tuple[str, ...], points: Iterable[TrajectoryPoint], step: int) -> None:
        """Go through points from this step on, from where the joints are told to be now."""
        for joint in joints:
            self._leave_ways(joint)
            self._take(joint, _Order(Interface.POSITION, self.told(joint), self.told(joint)))
        here = tuple(self._orders[joint].now for joint in joints)
        still = (0.0,) * len(joints)
        way = _Way(joints, Trajectory(TrajectoryPoint(0.0, here, still, still), tuple(points)), step)
        self._ways = (*self._ways, way)

    def desired(
        self, joints: tuple[str, ...], time: float
    ) -> tuple[tuple[float, ...], tuple[float, ...]] | None:
        """Where the trajectory that these joints follow has them at a time (s), and how fast; None where they
        follow none together."""
        for way in self._ways:
            if way.joints == joints:
                sample = way.trajectory.at(max(0.0, time - way.start * self._timestep))
                return tuple(sample.positions.tolist()), tuple(sample.velocities.tolist())
        return None

    def release(self, joint: str) -> None:
        if joint in self._orders:
            self._leave_ways(joint)
            del self._orders[joint]
            self._inertias[joint] = self._places[joint].first
            self._set_gains(joint, 0.0, 0.0, 0.0)

    def release_all(self) -> None:
        for joint in tuple(self._orders):
            self.release(joint)

    def save(self) -> SavedServos:
        """What `restore` takes back."""
        inertias = {joint: self._inertias[joint] for joint in self._orders}
        return dict(self._orders), self._ways, inertias

    def restore(self, saved: SavedServos) -> None:
        self.release_all()
        orders, self._ways, inertias = saved
        for joint, order in orders.items():
            if joint in self._places:
                self._inertias[joint] = inertias[joint]
                self._take(joint, order)
        self._ways = tuple(way for way in self._ways if all(joint in self._places for joint in way.joints))

    def set_back(self, steps: int) -> None:
        """Time was set back by so many steps."""
        self._ways = tuple(_Way(way.joints, way.trajectory, way.start - steps) for way in self._ways)

    def advance(self, step: int) -> None:
        """Give the servos their next commands."""
        # what a command holds for is a period: it is right in the middle of it
        late = self._period / 2.0
        samples = [
            (way.joints, way.trajectory.at((step - way.start) * self._timestep + late)) for way in self._ways
        ]
        followed = {
            joint: (float(s.positions[i]), float(s.velocities[i]), float(s.accelerations[i]))
            for joints, s in samples
            for i, joint in enumerate(joints)
        }
        for joint, order in self._orders.items():
            place, bounds = self._places[joint], self._bounds[joint]
            position, velocity = self._qpos[place.position], self._qvel[place.dof]
            load = self._bias[place.dof] - self._passive[place.dof]
            # before a first step the engine has none
            inertia = max(self._mass_matrix[place.inertia] or place.first, LEAST_INERTIA)
            if inertia != self._inertias[joint]:
                self._inertias[joint] = inertia
                self._tune(joint, order.interface)
            damping = 2.0 * inertia * FREQUENCY
            if order.interface is Interface.EFFORT:
                command = bounds.force(order.wanted, position, velocity)
            elif order.interface is Interface.VELOCITY:
                command = bounds.velocity(order.wanted, position) + load / damping
            else:
                target, speed, acceleration = followed.get(joint) or self._towards(order, bounds)
                target = bounds.position(target)
                wanted = target if joint in followed else order.wanted
                self._orders[joint] = _Order(order.interface, wanted, target)
                pushed = inertia * acceleration + damping * speed + load
                command = target + pushed / (inertia * FREQUENCY**2)
            self._ctrl[place.actuator] = command
        self._ways = tuple(
            way for way in self._ways if (step - way.start) * self._timestep < way.trajectory.end
        )

    def _towards(self, order: _Order, bounds: JointBounds) -> tuple[float, float, float]:
        """The next place on the way to the one that is wanted, within the joint's speed."""
        aim = bounds.position(order.wanted)
        if bounds.speed == inf:
            return aim, 0.0, 0.0
        most = bounds.speed * self._period
        move = min(max(aim - order.now, -most), most)
        return order.now + move, move / self._period, 0.0

    def within(self, joint: str, position: float) -> float:
        """Where a joint goes that is told a position (rad or m)."""
        return self._bounds[joint].position(position)

    def told(self, joint: str) -> float:
        """Where a joint is told to be (rad or m), or else where it is."""
        order = self._orders.get(joint)
        if order is not None and order.interface is Interface.POSITION:
            return order.now
        return self._qpos[self._places[joint].position]

    def _leave_ways(self, joint: str) -> None:
        """A new command ends the trajectory that the joint is on, for all of its joints: they stay."""
        self._ways = tuple(way for way in self._ways if joint not in way.joints)

    def _take(self, joint: str, order: _Order) -> None:
        self._tune(joint, order.interface)
        self._orders[joint] = order

    def _tune(self, joint: str, interface: Interface) -> None:
        """Give a servo the gains of the joint's inertia."""
        inertia = self._inertias[joint]
        damping = 2.0 * inertia * FREQUENCY
        if interface is Interface.POSITION:
            stiffness = inertia * FREQUENCY**2
            self._set_gains(joint, stiffness, -stiffness, -damping)
        elif interface is Interface.VELOCITY:
            self._set_gains(joint, damping, 0.0, -damping)
        else:
            self._set_gains(joint, 1.0, 0.0, 0.0)

    def _set_gains(self, joint: str, gain: float, position: float, velocity: float) -> None:
        first = self._places[joint].actuator * mujoco.mjNGAIN
        self._gains[first] = gain
        self._biases[first + 1], self._biases[first + 2] = position, velocity
