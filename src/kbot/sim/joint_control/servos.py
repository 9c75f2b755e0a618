"""Servos of the joints that are not part of the drive: hold a position, move at a speed, or apply an effort.

A position servo is a critically damped spring, tuned to the joint's inertia in the current pose. It receives
the wanted position and velocity, and the load on the joint (computed torque: Spong, Robot Modeling and
Control, 8.3), with the joint's damping and dry friction. So a joint follows its trajectory without lag, does
not sag, and does not stop short of its target.
"""

from __future__ import annotations

import reprlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from math import copysign, inf

import mujoco

from kbot.model import Joint, JointType, RobotModel, SafetyController
from kbot.sim.engine.arrays import numbers
from kbot.sim.joint_control.kinds import Interface
from kbot.sim.joint_control.trajectory import Trajectory, TrajectoryPoint
from kbot.sim.numbers import FURTHEST, is_within
from kbot.text import KbotError


@dataclass(frozen=True, slots=True)
class JointBounds:
    """The limits of a joint: `lower` and `upper` in rad or m, `speed` in rad/s or m/s, `effort` in N m or N.

    A missing limit is infinite.
    """

    lower: float
    upper: float
    speed: float
    effort: float
    safety: SafetyController | None

    @classmethod
    def of(cls, joint: Joint) -> JointBounds:
        lower, upper = joint.range
        safety = joint.safety
        if joint.type is JointType.CONTINUOUS:
            # a continuous joint has no position limits, so its safety controller has no effect
            safety = None
        elif safety is not None and safety.soft_lower_limit < safety.soft_upper_limit:
            lower, upper = max(lower, safety.soft_lower_limit), min(upper, safety.soft_upper_limit)
        return cls(lower, upper, joint.speed_limit, joint.effort_limit, safety)

    def position(self, wanted: float) -> float:
        return min(max(wanted, self.lower), self.upper)

    def velocity(self, wanted: float, position: float) -> float:
        """The wanted velocity, limited for the joint's position."""
        lowest, highest = self._speeds(position)
        return min(max(wanted, lowest), highest)

    def force(self, wanted: float, position: float, velocity: float) -> float:
        """The wanted effort, limited for the joint's position and velocity."""
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
"""Natural frequency of the servos in rad/s."""
LEAST_INERTIA = 1e-6
"""Smallest inertia that a servo is tuned to, in kg m^2 or kg, so that its gains are never 0."""
NEAR = 1e-4
"""Distance in rad or m from a target up to which dry friction may stop a joint."""


@dataclass(frozen=True, slots=True)
class _Place:
    """A joint's indices in the engine.

    `inertia` is the index of its diagonal element in the mass matrix. `first` is the value of that element
    with all joints at zero, in kg m^2 or kg. `friction` is the dry friction in N m or N.
    """

    actuator: int
    position: int
    dof: int
    inertia: int
    first: float
    friction: float


@dataclass(frozen=True, slots=True)
class _Command:
    """A joint's command. For a position command, `now` is the intermediate position at the current time."""

    interface: Interface
    wanted: float
    now: float


@dataclass(frozen=True, slots=True)
class _ActiveTrajectory:
    """A trajectory that is being followed since the step `start`."""

    joints: tuple[str, ...]
    trajectory: Trajectory
    start: int


SavedServos = tuple[dict[str, _Command], tuple[_ActiveTrajectory, ...], dict[str, float]]


class JointServos:
    """The servos of the joints that are not part of a robot's drive."""

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
        """The inertia that each servo is tuned to, in kg m^2 or kg. It depends on the pose of an arm."""
        for name in joints:
            actuator = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, prefix + name)
            if actuator >= 0:
                index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, prefix + name)
                dof = int(model.jnt_dofadr[index])
                diagonal = int(model.M_rowadr[dof] + model.M_rownnz[dof]) - 1
                first = max(float(model.dof_M0[dof]), LEAST_INERTIA)
                position, friction = int(model.jnt_qposadr[index]), float(model.dof_frictionloss[dof])
                self._places[name] = _Place(actuator, position, dof, diagonal, first, friction)
                self._inertias[name] = first
                self._bounds[name] = JointBounds.of(robot.joints[name])
        self._commands: dict[str, _Command] = {}
        self._trajectories: tuple[_ActiveTrajectory, ...] = ()

    @property
    def joints(self) -> tuple[str, ...]:
        """The joints that can be commanded."""
        return tuple(self._places)

    @property
    def is_active(self) -> bool:
        """Whether a joint is commanded, so that `advance` has to be called."""
        return bool(self._commands)

    def command(self, values: Mapping[str, float], interface: Interface) -> None:
        """Command positions, velocities or efforts. Raises KbotError for a value that is not a number."""
        for joint, value in values.items():
            if not is_within(value, FURTHEST):
                allowed = f"a finite number up to {FURTHEST:g}, not {reprlib.repr(value)}"
                raise KbotError(f"the {interface} of joint '{joint}' must be {allowed}")
        for joint, value in values.items():
            self._end_trajectory(joint)
            self._set_command(joint, _Command(interface, float(value), self.commanded_position(joint)))

    def follow(self, joints: tuple[str, ...], points: Iterable[TrajectoryPoint], step: int) -> None:
        """Follow points from this step on, starting at the joints' commanded positions."""
        for joint in joints:
            self._end_trajectory(joint)
            position = self.commanded_position(joint)
            self._set_command(joint, _Command(Interface.POSITION, position, position))
        here = tuple(self._commands[joint].now for joint in joints)
        still = (0.0,) * len(joints)
        trajectory = Trajectory(TrajectoryPoint(0.0, here, still, still), tuple(points))
        self._trajectories = (*self._trajectories, _ActiveTrajectory(joints, trajectory, step))

    def desired(
        self, joints: tuple[str, ...], time: float
    ) -> tuple[tuple[float, ...], tuple[float, ...]] | None:
        """The positions and velocities of these joints' trajectory at a time (s).

        None if the joints do not follow a trajectory together.
        """
        for active in self._trajectories:
            if active.joints == joints:
                sample = active.trajectory.at(max(0.0, time - active.start * self._timestep))
                return tuple(sample.positions.tolist()), tuple(sample.velocities.tolist())
        return None

    def release(self, joint: str) -> None:
        if joint in self._commands:
            self._end_trajectory(joint)
            del self._commands[joint]
            self._inertias[joint] = self._places[joint].first
            self._set_gains(joint, 0.0, 0.0, 0.0)

    def release_all(self) -> None:
        for joint in tuple(self._commands):
            self.release(joint)

    def save(self) -> SavedServos:
        """The state for `restore`."""
        inertias = {joint: self._inertias[joint] for joint in self._commands}
        return dict(self._commands), self._trajectories, inertias

    def restore(self, saved: SavedServos) -> None:
        self.release_all()
        commands, self._trajectories, inertias = saved
        for joint, current in commands.items():
            if joint in self._places:
                self._inertias[joint] = inertias[joint]
                self._set_command(joint, current)
        self._trajectories = tuple(
            active for active in self._trajectories if all(joint in self._places for joint in active.joints)
        )

    def shift_time(self, steps: int) -> None:
        """Shift the starts of trajectories after the time was set back by `steps`."""
        self._trajectories = tuple(
            replace(active, start=active.start - steps) for active in self._trajectories
        )

    def advance(self, step: int) -> None:
        """Send the servos their next commands."""
        # a command holds for one period, so it is sampled in the middle of that period
        late = self._period / 2.0
        samples = [
            (active.joints, active.trajectory.at((step - active.start) * self._timestep + late))
            for active in self._trajectories
        ]
        followed = {
            joint: (float(s.positions[i]), float(s.velocities[i]), float(s.accelerations[i]))
            for joints, s in samples
            for i, joint in enumerate(joints)
        }
        for joint, current in self._commands.items():
            place, bounds = self._places[joint], self._bounds[joint]
            position, velocity = self._qpos[place.position], self._qvel[place.dof]
            load = self._bias[place.dof] - self._passive[place.dof]
            # before the first step the engine's mass matrix is empty
            inertia = max(self._mass_matrix[place.inertia] or place.first, LEAST_INERTIA)
            if inertia != self._inertias[joint]:
                self._inertias[joint] = inertia
                self._tune(joint, current.interface)
            damping = 2.0 * inertia * FREQUENCY
            if current.interface is Interface.EFFORT:
                command = bounds.force(current.wanted, position, velocity)
            elif current.interface is Interface.VELOCITY:
                wanted = bounds.velocity(current.wanted, position)
                if place.friction and wanted:
                    load += copysign(place.friction, wanted)
                command = wanted + load / damping
            else:
                target, speed, acceleration = followed.get(joint) or self._towards(current, bounds)
                target = bounds.position(target)
                wanted = target if joint in followed else current.wanted
                self._commands[joint] = _Command(current.interface, wanted, target)
                if place.friction:
                    # at the target the joint may rest, so that the servo does not push it to and fro
                    error = target - position
                    share = 1.0 if speed else min(abs(error) / NEAR, 1.0)
                    load += copysign(place.friction * share, speed or error)
                pushed = inertia * acceleration + damping * speed + load
                command = target + pushed / (inertia * FREQUENCY**2)
            self._ctrl[place.actuator] = command
        self._trajectories = tuple(
            active
            for active in self._trajectories
            if (step - active.start) * self._timestep < active.trajectory.end
        )

    def _towards(self, current: _Command, bounds: JointBounds) -> tuple[float, float, float]:
        """The next intermediate position (with its velocity and acceleration), within the speed limit."""
        aim = bounds.position(current.wanted)
        if bounds.speed == inf:
            return aim, 0.0, 0.0
        most = bounds.speed * self._period
        move = min(max(aim - current.now, -most), most)
        return current.now + move, move / self._period, 0.0

    def within(self, joint: str, position: float) -> float:
        """The position (rad or m) within the joint's limits."""
        return self._bounds[joint].position(position)

    def commanded_position(self, joint: str) -> float:
        """A joint's commanded position (rad or m). Without a position command, its actual position."""
        current = self._commands.get(joint)
        if current is not None and current.interface is Interface.POSITION:
            return current.now
        return self._qpos[self._places[joint].position]

    def _end_trajectory(self, joint: str) -> None:
        """End the trajectory of a joint that receives a new command.

        Its other joints hold their positions.
        """
        self._trajectories = tuple(active for active in self._trajectories if joint not in active.joints)

    def _set_command(self, joint: str, current: _Command) -> None:
        self._tune(joint, current.interface)
        self._commands[joint] = current

    def _tune(self, joint: str, interface: Interface) -> None:
        """Set a servo's gains for the joint's inertia."""
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
