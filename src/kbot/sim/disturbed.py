"""A running world that is disturbed: pushes, kicks, and faults at their times."""

from __future__ import annotations

import math

from kbot.kinematics.odometry import PlanarPose
from kbot.model import Robot
from kbot.sim.drive import DriveLimits
from kbot.sim.faults import Fault, Kick
from kbot.sim.population import Population, require_finite
from kbot.sim.pushes import Push, Vector, apply
from kbot.sim.recipe import Contacts
from kbot.sim.schedule import FOREVER, Schedule
from kbot.text import KbotError
from kbot.world import World


class Disturbed(Population):
    """What acts on robots from outside, and until when."""

    def __init__(
        self,
        robot: Robot,
        world: World,
        seed: int,
        timestep: float,
        contacts: Contacts,
        drive_limits: DriveLimits | None,
        start: PlanarPose,
    ) -> None:
        self._pushes: list[Push] = []
        self._schedule = Schedule()
        super().__init__(robot, world, seed, timestep, contacts, drive_limits, start)

    def set_twist(self, linear: Vector, angular: Vector = (0.0, 0.0, 0.0), robot: str | None = None) -> None:
        """Give the robot's body a speed at once, as a kick does: m/s and rad/s along the world's axes.

        Raises:
            KbotError: a number is not finite, no such robot, or it is fixed to the world.
        """
        require_finite("a twist", (*linear, *angular))
        self.named(robot).set_twist(linear, angular)
        self._fresh = -1
        self._note("set_twist", robot=self.named(robot).name, linear=linear, angular=angular)

    def apply_force(
        self,
        link: str,
        force: Vector,
        duration: float,
        torque: Vector = (0.0, 0.0, 0.0),
        robot: str | None = None,
    ) -> None:
        """Push a link with a force (N) and a torque (N m) along the world's axes, at its centre of mass,
        for `duration` seconds.

        Raises:
            KbotError: a number is not finite, no such robot or link, or a duration that is none.
        """
        require_finite("a force", (*force, *torque))
        if not (math.isfinite(duration) and duration > 0.0):
            raise KbotError(f"a push lasts a finite number of seconds above zero, not {duration}")
        pushed = self.named(robot)
        pushed.body(link)
        until = self._steps + max(1, round(duration / self.timestep))
        self._pushes.append(Push(f"{pushed.name}/{link}", force, torque, until))
        apply(self._model, self._data, self._pushes)
        self._find_due()
        self._plan_stop()
        self._note("force", robot=pushed.name, link=link, force=force, torque=torque, until=until)

    def schedule(self, fault: Fault, at: float, duration: float | None = None) -> None:
        """Let something go wrong `at` seconds of simulated time, for `duration` seconds (None is for good).
        It stays in the schedule over a reset, and comes again.

        Raises:
            KbotError: a time that is none or is past, or a fault of something that is not there.
        """
        start = round(at / self.timestep) if math.isfinite(at) else -1
        if start < self._steps:
            raise KbotError(f"a fault is placed at a time from now ({self.time:g} s) on, not at {at} s")
        if duration is not None and not (math.isfinite(duration) and duration > 0.0):
            raise KbotError(f"a fault lasts a finite number of seconds above zero, not {duration}")
        stop = FOREVER if duration is None else start + max(1, round(duration / self.timestep))
        if isinstance(fault, Kick):
            stop = start + 1
        elif (end := fault.begin(self)) is not None:
            end()  # begun on trial: what it speaks of is there
        self._schedule.add(fault, start, stop)
        self._schedule.bring_to(self, self._steps)
        self._find_due()
        self._plan_stop()
        self._note("schedule", fault=repr(fault), at=at, duration=duration)

    def _find_due(self) -> None:
        ends = [push.until for push in self._pushes]
        self._due = min([*ends, self._schedule.next_step(self._steps)])

    def _disturb(self) -> None:
        self._end_pushes()
        self._schedule.bring_to(self, self._steps)
        self._find_due()

    def _jump(self) -> None:
        self._schedule.jump_to(self, self._steps)
        self._find_due()

    def _forget(self, robot: str) -> None:
        self._pushes = [push for push in self._pushes if not push.body.startswith(f"{robot}/")]

    def _model_is_new(self) -> None:
        apply(self._model, self._data, self._pushes)
        self._schedule.begin_again(self)

    def _end_pushes(self) -> None:
        lasting = [push for push in self._pushes if push.until > self._steps]
        if len(lasting) < len(self._pushes):
            self._pushes[:] = lasting
            apply(self._model, self._data, lasting)
