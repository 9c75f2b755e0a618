"""What acts on a simulation from outside, and until when: pushes, and faults at their times."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import NamedTuple

from kbot.sim.engine.engine import Engine
from kbot.sim.faults import End, Fault, Subject
from kbot.sim.numbers import Vector

FOREVER = 1 << 62
"""A step that never comes."""


class Push(NamedTuple):
    """A force (N) and torque (N m) along the world's axes on a body's centre of mass, until a step."""

    body: str
    force: Vector
    torque: Vector
    until: int


class Placed(NamedTuple):
    """A fault by its number, and from when to when it acts: seconds of simulated time, inf for good."""

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

    def __init__(self, simulation: Subject, engine: Engine) -> None:
        self._simulation, self._engine = simulation, engine
        self.pushes: tuple[Push, ...] = ()
        self._faults: list[_Entry] = []
        """By number, in the order they were placed."""
        self._placed = 0
        self._acting: list[_Entry] = []
        """Those that have something to end, in the order they began."""
        self.due = FOREVER

    @property
    def numbers(self) -> tuple[int, ...]:
        """Of all faults, those that are over too."""
        return tuple(entry.number for entry in self._faults)

    def faults(self, timestep: float) -> tuple[Placed, ...]:
        """Those that act now or are to come."""
        return tuple(
            Placed(
                entry.number,
                entry.fault,
                entry.start * timestep,
                inf if entry.stop == FOREVER else entry.stop * timestep,
            )
            for entry in self._faults
            if entry.stop > self._simulation.steps
        )

    def push(self, push: Push) -> None:
        self._use_pushes((*self.pushes, push))
        self._find_due()

    def push_no_longer(self, body: str) -> None:
        """`body` is the engine's name of it."""
        self._use_pushes(tuple(push for push in self.pushes if push.body != body))
        self._find_due()

    def place(self, fault: Fault, start: int, stop: int) -> int:
        """Let a fault act from a step until another; its number."""
        self._placed += 1
        self._faults.append(_Entry(self._placed, fault, start, stop))
        self.bring_up()
        return self._placed

    def take_out(self, number: int) -> bool:
        """End a fault, and let it not come again; whether there is one of that number."""
        gone = [entry for entry in self._faults if entry.number == number]
        self._take_out(gone)
        self._find_due()
        return bool(gone)

    def forget(self, name: str) -> None:
        """Drop what is done to a robot, or to a body by its name in the engine, that goes."""
        self._take_out([entry for entry in self._faults if getattr(entry.fault, "robot", None) == name])
        of_robot = f"{name}/"
        self.pushes = tuple(p for p in self.pushes if p.body != name and not p.body.startswith(of_robot))

    def bring_up(self) -> None:
        """End what is over at the step of now, begin what is due."""
        step = self._simulation.steps
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
        """After a jump in time: what acts at that step acts."""
        self._end(list(self._acting))
        for entry in self._faults:
            entry.done = False
        self.bring_up()

    def begin_again(self) -> None:
        """After the engine's model was built anew: what lasts acts in the new one too."""
        self._use_pushes(self.pushes)
        lasting, self._acting = self._acting, []
        for entry in lasting:
            self._begin(entry)

    def _find_due(self) -> None:
        times = [time for entry in self._faults for time in (entry.start, entry.stop)]
        times += [push.until for push in self.pushes]
        step = self._simulation.steps
        self.due = min((time for time in times if time > step), default=FOREVER)

    def _use_pushes(self, pushes: tuple[Push, ...]) -> None:
        """Make these, and no others, act in the engine."""
        self.pushes = pushes
        model, data = self._engine.model, self._engine.data
        data.xfrc_applied[:] = 0.0
        for push in pushes:
            data.xfrc_applied[model.body(push.body).id] += (*push.force, *push.torque)

    def _begin(self, entry: _Entry) -> None:
        entry.end = entry.fault.begin(self._simulation)
        if entry.end is not None:
            self._acting.append(entry)

    def _take_out(self, gone: list[_Entry]) -> None:
        self._end(gone)
        self._faults = [entry for entry in self._faults if entry not in gone]

    def _end(self, over: list[_Entry]) -> None:
        """End some. Each puts back what it found: those that began later end first, and begin again."""
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
