"""Pushes and faults that act on a simulation, each with its start and end."""

from __future__ import annotations

import reprlib
from collections.abc import Iterator
from dataclasses import dataclass
from math import inf
from typing import NamedTuple

from kbot.brief import Brief, counted
from kbot.messages.bus import Bus
from kbot.sim.command_delivery import CommandDelivery
from kbot.sim.engine.engine import Engine
from kbot.sim.engine.welds import STATIC
from kbot.sim.injected_faults import (
    FAULTS,
    End,
    Fault,
    Kick,
    LostCommands,
    SilentTopic,
    Target,
    to_journal,
)
from kbot.sim.journal import Journal
from kbot.sim.numbers import LONGEST, STRONGEST, Vector, is_within, positive, vector
from kbot.sim.robots import Robots
from kbot.text import KbotError

FOREVER = 1 << 62
"""A step that is never reached."""


class BodyWrench(NamedTuple):
    """A force (N) and torque (N m) in world axes at a body's centre of mass, until the step `until`."""

    body: str
    force: Vector
    torque: Vector
    until: int


class ScheduledFault(NamedTuple):
    """A scheduled fault, active from `start` to `stop` (simulated seconds; inf: it never ends)."""

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


class Disturbances(Brief):
    """The pushes and faults of one simulation. `due` is the next step at which one starts or ends."""

    def __init__(
        self, engine: Engine, bus: Bus, robots: Robots, commands: CommandDelivery, journal: Journal
    ) -> None:
        self._engine, self._robots, self._journal = engine, robots, journal
        self._target = Target(engine, bus, commands, robots)
        self.pushes: tuple[BodyWrench, ...] = ()
        self._faults: list[_Entry] = []
        """In scheduling order."""
        self._scheduled = 0
        self._acting: list[_Entry] = []
        """The active faults that must be undone when they end, in the order in which they started."""
        self.due = FOREVER
        self.last = ""
        """The last push or fault since the last jump in time that changed how the robots move, or empty."""

    def apply_body_wrench(
        self,
        link: str,
        force: Vector,
        duration: float,
        torque: Vector = (0.0, 0.0, 0.0),
        robot: str | None = None,
    ) -> None:
        """Push a robot's link for `duration` seconds. Without `robot`, `link` may be a body of the world.

        The force (N) and the torque (N m) are in world axes and act at the centre of mass.

        Raises:
            KbotError: a number is not finite, the robot, link or body does not exist, or the duration is
                not positive.
        """
        force = vector("the force in N", force, STRONGEST)
        torque = vector("the torque in N m", torque, STRONGEST)
        duration = positive("the duration of a push in seconds", duration, LONGEST)
        body = self._robots.engine_name(link, robot)
        if body == STATIC:
            raise KbotError(f"'{link}' is static and cannot be pushed")
        until = self._engine.steps + max(1, round(duration / self._engine.timestep))
        self._use_pushes((*self.pushes, BodyWrench(body, force, torque, until)))
        self.last = "a push"
        self._find_due()
        self._journal.note(
            "apply_body_wrench", link=link, robot=robot, force=force, torque=torque, until=until
        )

    def clear_body_wrenches(self, link: str, robot: str | None = None) -> None:
        """End all pushes of a link or body.

        Raises:
            KbotError: the robot, link or body does not exist.
        """
        body = self._robots.engine_name(link, robot)
        self._use_pushes(tuple(push for push in self.pushes if push.body != body))
        self._find_due()
        self._journal.note("clear_body_wrenches", link=link, robot=robot)

    def schedule(self, fault: Fault, at: float, duration: float | None = None) -> int:
        """Start a fault `at` seconds of simulated time, for `duration` seconds (None: it never ends).

        A reset keeps the schedule, so the fault starts again. `end_fault`, with the number that this
        function returns, removes it. So does deleting its robot.

        Raises:
            KbotError: the time is not valid or is in the past, the fault names something that does not
                exist, or it is a kick and the run has diverged.
        """
        if not isinstance(fault, Fault):
            known = ", ".join(FAULTS)
            raise KbotError(
                f"a fault must be one of kbot.sim.injected_faults ({known}), not {reprlib.repr(fault)}"
            )
        engine = self._engine
        start = round(at / engine.timestep) if is_within(at, LONGEST) else -1
        if start < engine.steps:
            allowed = f"from now ({engine.time:g} s) to {LONGEST:g} s, not {reprlib.repr(at)} s"
            raise KbotError(f"the start time of a fault must be {allowed}")
        if duration is not None:
            duration = positive("the duration of a fault in seconds", duration, LONGEST)
        stop = FOREVER if duration is None else start + max(1, round(duration / engine.timestep))
        if isinstance(fault, Kick):
            self._robots.named(fault.robot).body.require_free()
            engine.require_sound()
            stop = start + 1
        elif (end := fault.begin(self._target)) is not None:
            end()  # started only to check that everything it names exists
        self._scheduled += 1
        number = self._scheduled
        self._faults.append(_Entry(number, fault, start, stop))
        self.update()
        if self._journal.write is not None:
            self._journal.note("schedule", **to_journal(fault), at=float(at), duration=duration)
        return number

    def end_fault(self, number: int) -> None:
        """End a fault and remove it from the schedule.

        Raises:
            KbotError: no fault has this number.
        """
        matches = [entry for entry in self._faults if entry.number == number]
        if not matches:
            known = ", ".join(str(entry.number) for entry in self._faults) or "none"
            raise KbotError(f"no fault has the number {reprlib.repr(number)}; scheduled faults: {known}")
        self._remove(matches)
        self._find_due()
        self._journal.note("end_fault", number=int(number))

    @property
    def faults(self) -> tuple[ScheduledFault, ...]:
        """The faults that are active or will start."""
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
        """Remove the faults and pushes of a deleted robot, or of a deleted body (by its engine name)."""
        self._remove([entry for entry in self._faults if getattr(entry.fault, "robot", None) == name])
        of_robot = f"{name}/"
        self.pushes = tuple(p for p in self.pushes if p.body != name and not p.body.startswith(of_robot))

    def update(self) -> None:
        """End the pushes and faults that are over at the current step, and start those that are due."""
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
        """After a jump in time, activate exactly the faults that belong to the current step."""
        self._end(list(self._acting))
        self.last = "a push" if self.pushes else ""
        for entry in self._faults:
            entry.done = False
        self.update()

    def reapply(self) -> None:
        """Apply all active pushes and faults to the engine's new model."""
        self._use_pushes(self.pushes)
        acting, self._acting = self._acting, []
        for entry in reversed(acting):
            if entry.end is not None:
                entry.end()
                entry.end = None
        for entry in acting:
            self._begin(entry)

    def shift_time(self, steps: int) -> None:
        """Shift the ends of pushes after the time was set back by `steps`. Faults keep their times."""
        self.pushes = tuple(push._replace(until=push.until - steps) for push in self.pushes)

    def _find_due(self) -> None:
        times = [time for entry in self._faults for time in (entry.start, entry.stop)]
        times += [push.until for push in self.pushes]
        step = self._engine.steps
        self.due = min((time for time in times if time > step), default=FOREVER)

    def _use_pushes(self, pushes: tuple[BodyWrench, ...]) -> None:
        """Apply exactly these pushes in the engine."""
        self.pushes = pushes
        model, data = self._engine.model, self._engine.data
        data.xfrc_applied[:] = 0.0
        for push in pushes:
            data.xfrc_applied[model.body(push.body).id] += (*push.force, *push.torque)

    def _begin(self, entry: _Entry) -> None:
        try:
            entry.end = entry.fault.begin(self._target)
        except KbotError:  # what it names existed when it was scheduled, and was deleted since
            return
        if entry.end is not None:
            self._acting.append(entry)
        if not isinstance(entry.fault, LostCommands | SilentTopic):
            self.last = f"the fault {type(entry.fault).__name__}"

    def _remove(self, entries: list[_Entry]) -> None:
        self._end(entries)
        self._faults = [entry for entry in self._faults if entry not in entries]

    def _end(self, over: list[_Entry]) -> None:
        """End some faults.

        Each fault restores the values that it found when it started. So the faults that started later are
        undone first and started again afterwards.
        """
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

    def _shown(self) -> Iterator[str]:
        yield counted(len(self.faults), "fault")
