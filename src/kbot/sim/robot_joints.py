"""The joints of a robot that do not drive: what they are told, and by whom."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Protocol

from kbot.sim.engine.engine import Engine
from kbot.sim.joint_control.control import JointControl, JointController, ManagedController
from kbot.sim.joint_control.kinds import Interface
from kbot.sim.joint_control.servos import JointServos
from kbot.sim.joint_control.trajectory import Point
from kbot.sim.preparation import Prepared
from kbot.sim.robot_body import RobotBody
from kbot.text import KbotError

NOTICEABLE = 1e-3
"""rad or m: how far beyond its limit a joint may be told to be, as by 3.1416, before that is said."""


class JointHost(Protocol):
    """The simulation that takes commands for joints, and writes them in its journal."""

    def command_joints(self, values: Mapping[str, float], interface: str, robot: str | None) -> None: ...

    def follow_trajectory(
        self, joints: Sequence[str], points: Sequence[Sequence[Any]], robot: str | None
    ) -> None: ...

    def tell(self, text: str) -> None: ...


class RobotJoints(RobotBody):
    """A robot whose joints are commanded, but for those that drive it."""

    def __init__(
        self, prepared: Prepared, host: JointHost, engine: Engine, period: float, timestep: float
    ) -> None:
        """`period`: seconds between two commands to the servos."""
        super().__init__(prepared, engine)
        self._joint_host = host
        self.control = prepared.control
        """What commands its joints."""
        self.stopped, self.unloaded = _at_the_start(self.control), frozenset[str]()
        """Names of controllers that do not run, and of those among them that are loaded no more."""
        self.loaded: dict[str, Mapping[str, object]] = {}
        """The parameters of those that were loaded since, by name."""
        self._driving = prepared.driving
        self._beyond: set[str] = set()
        """Joints of which it was told that they stop at their limits."""
        self._period, self._timestep = period, timestep
        self._joint_servos = self._servos_of_joints()

    def _bind(self) -> None:
        """Joints go on as they were told."""
        super()._bind()
        told = self._joint_servos.save()
        self._joint_servos = self._servos_of_joints()
        self._joint_servos.restore(told)

    def _servos_of_joints(self) -> JointServos:
        model, data = self._engine.model, self._engine.data
        others = [name for name in self._joints if name not in self._driving]
        return JointServos(self.robot, model, data, others, self.prefix, self._period, self._timestep)

    def command_joints(self, values: Mapping[str, float], interface: str = Interface.POSITION) -> None:
        """See `Simulation.command_joints`."""
        self._joint_host.command_joints(values, interface, self.name)

    def follow_trajectory(self, joints: Sequence[str], points: Sequence[Sequence[Any]]) -> None:
        """See `Simulation.follow_trajectory`."""
        self._joint_host.follow_trajectory(joints, points, self.name)

    def tell(self, text: str) -> None:
        """See `Running.tell`."""
        self._joint_host.tell(text)

    def _command_joints(self, values: Mapping[str, float], interface: Interface) -> None:
        """Command joints from now on.

        Raises:
            KbotError: no such joint, one that drives or follows another, or a number that is none.
        """
        for joint in values:
            self._require_free_joint(joint)
        self._joint_servos.command(values, interface)
        if interface is Interface.POSITION:
            self._say_beyond(values.items())

    def _follow(self, joints: tuple[str, ...], points: tuple[Point, ...], step: int) -> None:
        """Let joints follow points from a step on. Raises KbotError as `_command_joints` does."""
        for joint in joints:
            self._require_free_joint(joint)
        self._joint_servos.follow(joints, points, step)
        self._say_beyond(pair for point in points for pair in zip(joints, point.positions, strict=True))

    def _say_beyond(self, wanted: Iterable[tuple[str, float]]) -> None:
        """Tell, once a joint, that it stops at its limit before the position that it was told."""
        for joint, position in wanted:
            limit = self._joint_servos.within(joint, position)
            if abs(limit - position) > NOTICEABLE and joint not in self._beyond:
                self._beyond.add(joint)
                self.tell(f"'{joint}' was told {position:g}, beyond its limit: it goes to {limit:.6g}")

    def require_running(self, controller: str) -> None:
        """Raises KbotError: a controller of this name commands nothing now."""
        if controller in self.unloaded:
            raise KbotError(f"{controller} is not loaded: it commands nothing")
        if controller in self.stopped:
            raise KbotError(f"{controller} is loaded and not started: it commands nothing")

    def _start_and_stop(self, start: frozenset[str], stop: frozenset[str]) -> None:
        """Let controllers run, and others not. The joints of those that run hold where they are until they
        are told; those that none commands any more are held where the hardware holds them, else let go."""
        self.stopped = (self.stopped | stop) - start
        servos, interfaces = self._joint_servos, {c.name: c.interface for c in self.control.controllers}
        joints = {c.name: c.joints for c in self.control.controllers}
        held = {
            joint
            for name in start & joints.keys()
            if interfaces[name] is not Interface.EFFORT
            for joint in joints[name]
        }
        left = {joint for name in stop & joints.keys() for joint in joints[name]}
        held |= left & self.control.hardware
        servos.command({j: servos.told(j) for j in servos.joints if j in held}, Interface.POSITION)
        for joint in left - held:
            servos.release(joint)

    def _take(self, managed: ManagedController, controller: JointController | None) -> None:
        """Have one more controller, which does not run yet, in place of any of its name."""
        name, control = managed.name, self.control
        others = tuple(c for c in control.controllers if c.name != name)
        self.control = replace(
            control,
            controllers=others if controller is None else (*others, controller),
            managed=(*(c for c in control.managed if c.name != name), managed),
        )
        self.stopped, self.unloaded = self.stopped | {name}, self.unloaded - {name}

    def _save_controllers(self) -> tuple[Any, ...]:
        """Which there are, for `_restore_controllers`."""
        return self.control, self.stopped, self.unloaded

    def _restore_controllers(self, saved: tuple[Any, ...]) -> None:
        """Have those controllers, and no other."""
        self.control, self.stopped, self.unloaded = saved

    def _unload(self, controller: str) -> None:
        """Forget one that does not run."""
        self.unloaded |= {controller}

    def _save_joints(self) -> tuple[Any, ...]:
        """What `_restore_joints` takes back."""
        return self._joint_servos.save(), self.stopped, self.unloaded, _names(self.control)

    def _restore_joints(self, saved: tuple[Any, ...]) -> None:
        """Do as joints were told; controllers that were not there are as they start."""
        servos, stopped, self.unloaded, known = saved
        self.stopped = stopped | (_at_the_start(self.control) - known)
        self._joint_servos.restore(servos)

    def _release(self, joint: str) -> None:
        """Let a commanded joint move freely again. Raises KbotError for an unknown joint."""
        self._require_joint(joint)
        self._joint_servos.release(joint)

    def _require_free_joint(self, joint: str) -> None:
        self._require_joint(joint)
        if joint not in self._joint_servos.joints:
            why = "drives the robot" if joint in self._driving else "follows another joint"
            raise KbotError(f"joint '{joint}' {why} and cannot be held")

    def _start_joints(self) -> None:
        """Put joints where the description has them start, and hold those that its controllers hold."""
        self._joint_servos.release_all()
        self.stopped, self.unloaded = _at_the_start(self.control), frozenset()
        for joint, position in self.control.starts.items():
            if joint in self._joint_servos.joints:
                self._set_position(joint, position)
        held = [joint for joint in self._joint_servos.joints if joint in self.control.holds]
        here = self.joint_positions
        self._joint_servos.command({joint: here[joint] for joint in held}, Interface.POSITION)


def _at_the_start(control: JointControl) -> frozenset[str]:
    """The controllers that are only loaded."""
    return frozenset(one.name for one in _every(control) if not one.is_active)


def _names(control: JointControl) -> frozenset[str]:
    return frozenset(one.name for one in _every(control))


def _every(control: JointControl) -> tuple[ManagedController | JointController, ...]:
    return *control.managed, *control.controllers
