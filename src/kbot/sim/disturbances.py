"""Pushes and faults that act on a simulation, each with its start and end."""

from __future__ import annotations

import reprlib
from dataclasses import dataclass
from math import inf
from typing import NamedTuple

from kbot.messages.bus import Bus
from kbot.sim.command_delivery import CommandDelivery
from kbot.sim.engine.engine import Engine
from kbot.sim.engine.welds import STANDING
from kbot.sim.injected_faults import FAULTS, End, Fault, Kick, Target, to_journal
from kbot.sim.journal import Journal
from kbot.sim.numbers import LONGEST, STRONGEST, Vector, is_within, positive, vector
from kbot.sim.robots import Robots
from kbot.text import KbotError

FOREVER = 1 << 62
"""A step that is never reached."""


class BodyWrench(NamedTuple):
    """A force (N) and torque (N m) along the world's axes on a body's centre of mass, until a step."""

    body: str
    force: Vector
    torque: Vector
    until: int


class ScheduledFault(NamedTuple):
    """A scheduled fault that acts from `start` to `stop`: s of simulated time, inf for good."""

    number: int
    fault: Fault
    start: float
    stop: float


@dataclass(eq=False)
class _Entry:
    number: int
    fault: Fault
    start: int
    stop: int
    done: bool = False
    end: End | None = None


class Disturbances:
    """The pushes and faults of one simulation. `due` is the next step at which one begins or ends."""

    def __init__(
        self, engine: Engine, bus: Bus, robots: Robots, commands: CommandDelivery, journal: Journal
    ) -> None:
        self._engine, self._robots, self._journal = engine, robots, journal
        self._target = Target(engine, bus, commands, robots)
        self.pushes: tuple[BodyWrench, ...] = ()
        self._faults: list[_Entry] = []
        """In the order in which they were scheduled."""
        self._scheduled = 0
        self._acting: list[_Entry] = []
        """Those that have something to end, in the order in which they began."""
        self.due = FOREVER

    def apply_body_wrench(
        self,
        link: str,
        force: Vector,
        duration: float,
        torque: Vector = (0.0, 0.0, 0.0),
        robot: str | None = None,
    ) -> None:
        """Push a robot's link, or without `robot` a body of the world, for `duration` seconds.

        The force (N) and the torque (N m) are along the world's axes and act at the centre of mass.

        Raises:
            KbotError: a number is not finite, no such robot, link or body, or the duration is not a time.
        """
        force, torque = vector("a force in N", force, STRONGEST), vector("a torque in N m", torque, STRONGEST)
        duration = positive("the time of a push in seconds", duration, LONGEST)
        body = self._robots.engine_name(link, robot)
        if body == STANDING:
            raise KbotError(f"'{link}' stands still for good: nothing pushes it")
        until = self._engine.steps + max(1, round(duration / self._engine.timestep))
        self._use_pushes((*self.pushes, BodyWrench(body, force, torque, until)))
        self._find_due()
        self._journal.note(
            "apply_body_wrench", link=link, robot=robot, force=force, torque=torque, until=until
        )

    def clear_body_wrenches(self, link: str, robot: str | None = None) -> None:
        """End all pushes of a link or body.

        Raises:
            KbotError: no such robot, link or body.
        """
        body = self._robots.engine_name(link, robot)
        self._use_pushes(tuple(push for push in self.pushes if push.body != body))
        self._find_due()
        self._journal.note("clear_body_wrenches", link=link, robot=robot)

    def schedule(self, fault: Fault, at: float, duration: float | None = None) -> int:
        """Let a fault begin `at` seconds of simulated time, for `duration` seconds (None is for good).

        A reset keeps the schedule, so that the fault begins again. It ends for good by `end_fault` with the
        number that is returned, or when its robot is deleted.

        Raises:
            KbotError: the time is not a time or is in the past, the fault names something that is not there,
                or a kick in a run that has diverged.
        """
        if not isinstance(fault, Fault):
            known = ", ".join(FAULTS)
            raise KbotError(
                f"a fault is one of kbot.sim.injected_faults ({known}), not {reprlib.repr(fault)}"
            )
        engine = self._engine
        start = round(at / engine.timestep) if is_within(at, LONGEST) else -1
        if start < engine.steps:
            allowed = f"from now ({engine.time:g} s) to {LONGEST:g} s, not at {reprlib.repr(at)} s"
            raise KbotError(f"a fault is placed at a time {allowed}")
        if duration is not None:
            duration = positive("the time of a fault in seconds", duration, LONGEST)
        stop = FOREVER if duration is None else start + max(1, round(duration / engine.timestep))
        if isinstance(fault, Kick):
            self._robots.named(fault.robot).body.require_free()
            engine.require_sound()
            stop = start + 1
        elif (end := fault.begin(self._target)) is not None:
            end()  # it began only to find out whether all that it names is there
        self._scheduled += 1
        number = self._scheduled
        self._faults.append(_Entry(number, fault, start, stop))
        self.bring_up()
        if self._journal.write is not None:
            self._journal.note("schedule", **to_journal(fault), at=float(at), duration=duration)
        return number

    def end_fault(self, number: int) -> None:
        """End a fault and remove it from the schedule.

        Raises:
            KbotError: no fault has this number.
        """
        gone = [entry for entry in self._faults if entry.number == number]
        if not gone:
            known = ", ".join(str(entry.number) for entry in self._faults) or "none at all"
            raise KbotError(f"there is no fault {reprlib.repr(number)} (there are {known})")
        self._remove(gone)
        self._find_due()
        self._journal.note("end_fault", number=int(number))

    @property
    def faults(self) -> tuple[ScheduledFault, ...]:
        """The faults that act now or will begin."""
        timestep = self._engine.timestep
        return tuple(
            ScheduledFault(
                entry.number,
                entry.fault,
                entry.start * timestep,
                inf if entry.stop == FOREVER else entry.stop * timestep,
            )
            for entry in self._faults
            if entry.stop > self._engine.steps
        )

    def forget(self, name: str) -> None:
        """Remove the faults and pushes of a robot, or of a body by its engine name, that is deleted."""
        self._remove([entry for entry in self._faults if getattr(entry.fault, "robot", None) == name])
        of_robot = f"{name}/"
        self.pushes = tuple(p for p in self.pushes if p.body != name and not p.body.startswith(of_robot))

    def bring_up(self) -> None:
        """End what is over at the current step, and begin what is due."""
        step = self._engine.steps
        lasting = tuple(push for push in self.pushes if push.until > step)
        if len(lasting) < len(self.pushes):
            self._use_pushes(lasting)
        self._end([entry for entry in self._acting if not entry.start <= step < entry.stop])
        for entry in self._faults:
            if not entry.done and entry.start <= step < entry.stop:
                entry.done = True
                self._begin(entry)
        self._find_due()

    def jump(self) -> None:
        """After a jump in time, let exactly those faults act that do at the current step."""
        self._end(list(self._acting))
        for entry in self._faults:
            entry.done = False
        self.bring_up()

    def begin_again(self) -> None:
        """Let everything that acts do so in the engine's new model too."""
        self._use_pushes(self.pushes)
        acting, self._acting = self._acting, []
        for entry in reversed(acting):
            if entry.end is not None:
                entry.end()
                entry.end = None
        for entry in acting:
            self._begin(entry)

    def set_back(self, steps: int) -> None:
        """Shift the ends of pushes after time was set back by so many steps. Faults keep their times."""
        self.pushes = tuple(push._replace(until=push.until - steps) for push in self.pushes)

    def _find_due(self) -> None:
        times = [time for entry in self._faults for time in (entry.start, entry.stop)]
        times += [push.until for push in self.pushes]
        step = self._engine.steps
        self.due = min((time for time in times if time > step), default=FOREVER)

    def _use_pushes(self, pushes: tuple[BodyWrench, ...]) -> None:
        """Let these, and no others, act in the engine."""
        self.pushes = pushes
        model, data = self._engine.model, self._engine.data
        data.xfrc_applied[:] = 0.0
        for push in pushes:
            data.xfrc_applied[model.body(push.body).id] += (*push.force, *push.torque)

    def _begin(self, entry: _Entry) -> None:
        try:
            entry.end = entry.fault.begin(self._target)
        except KbotError:  # what it names was there when it was scheduled, and was deleted since
            return
        if entry.end is not None:
            self._acting.append(entry)

    def _remove(self, gone: list[_Entry]) -> None:
        self._end(gone)
        self._faults = [entry for entry in self._faults if entry not in gone]

    def _end(self, over: list[_Entry]) -> None:
        """End some faults. Those that began later end first and begin again: each restores what it found."""
        first = min((self._acting.index(entry) for entry in over if entry in self._acting), default=None)
        if first is None:
            return
        later, self._acting = self._acting[first:], self._acting[:first]
        for entry in reversed(later):
            if entry.end is not None:
                entry.end()
                entry.end = None
        for entry in later:
            if entry not in over:
                self._begin(entry)
