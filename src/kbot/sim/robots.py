"""The robots of a simulation by name, with their topics."""

from __future__ import annotations

import reprlib
from collections.abc import Callable, Iterator, Mapping

from kbot.brief import Brief
from kbot.messages.bus import Bus
from kbot.messages.clock import Clock
from kbot.sim.command_delivery import CommandDelivery
from kbot.sim.engine.engine import Engine
from kbot.sim.engine.welds import STATIC
from kbot.sim.engine.world_builder import PREFIX
from kbot.sim.journal import Journal
from kbot.sim.preparation import Prepared
from kbot.sim.robot import SimulatedRobot
from kbot.sim.topics import RobotTopics
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean


class UnknownRobot(KbotError, KeyError):
    """No robot has the name. A KeyError too, as a mapping raises it."""

    __str__ = Exception.__str__  # a KeyError would print the quoted message


class Robots(Brief, Mapping[str, SimulatedRobot]):
    """The robots by name, in the order of spawning. The `first` cannot be deleted."""

    def __init__(
        self,
        first: Prepared,
        engine: Engine,
        bus: Bus,
        clock: Clock,
        commands: CommandDelivery,
        journal: Journal,
    ) -> None:
        self._engine, self._bus, self._clock = engine, bus, clock
        self._commands, self._journal = commands, journal
        self._robots: dict[str, SimulatedRobot] = {}
        self._topics: dict[str, RobotTopics] = {}
        self._subscribed: list[RobotTopics] = []
        """The topics of the robots that have a subscriber, as of the bus's change number `_seen`."""
        self._seen = -1
        self.when_changed: list[Callable[[], None]] = []
        """Called after a robot was spawned or deleted."""
        self.first = self.add(first)

    def __getitem__(self, name: str) -> SimulatedRobot:
        return self.named(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._robots)

    def __len__(self) -> int:
        return len(self._robots)

    def named(self, name: str | None = None) -> SimulatedRobot:
        """The robot of a name, or the first robot for None. Raises UnknownRobot."""
        if name is None:
            return self.first
        if not isinstance(name, str) or name not in self._robots:
            hint = did_you_mean(str(name), self._robots) or f"choose from {', '.join(self._robots)}"
            raise UnknownRobot(f"unknown robot {reprlib.repr(name)}: {hint}")
        return self._robots[name]

    def engine_name(self, link: str, robot: str | None) -> str:
        """The engine's name of a robot's link. Without `robot`, `link` may also be a body of the world.

        Raises:
            KbotError: the robot, link or body does not exist.
        """
        if not isinstance(link, str):
            raise KbotError(f"the name of a link or body must be a string, not {reprlib.repr(link)}")
        owner = self.named(robot)
        if robot is None and link not in owner.body.links:
            bodies = self._engine.world.bodies
            for body in bodies:
                if body.name == link:
                    return STATIC if body.is_static else PREFIX + body.name
            hint = did_you_mean(link, (*owner.body.links, *(body.name for body in bodies)))
            message = f"no link of '{owner.name}' and no body of the world is called {reprlib.repr(link)}"
            raise KbotError(message + (f": {hint}" if hint else ""))
        owner.body.index(link)
        return owner.body.prefix + link

    def add(self, prepared: Prepared) -> SimulatedRobot:
        """Add a robot that is in the engine. Raises KbotError: a topic exists with another type."""
        robot = SimulatedRobot(prepared, self._engine, self._commands, self._journal)
        topics = RobotTopics(
            self._bus,
            self._clock,
            robot,
            self._journal.report,
            publishes_clock=not self._robots,
            timestep=self._engine.timestep,
        )
        self._robots[robot.name], self._topics[robot.name] = robot, topics
        return robot

    def remove(self, name: str) -> None:
        """Remove a robot that is still in the engine. Raises KbotError for the first and unknown names."""
        removed = self.named(name)
        if removed is self.first:
            raise KbotError(f"'{name}' is the first robot of this simulation and cannot be deleted")
        del self._robots[name]
        self._topics.pop(name).close()
        self._commands.following = [robot for robot in self._commands.following if robot is not removed]

    def bind(self) -> None:
        """Let all robots continue in the engine's new model."""
        for robot in self._robots.values():
            robot.bind()

    def report_change(self) -> None:
        """Call `when_changed`."""
        for listener in tuple(self.when_changed):
            listener()

    def tick(self, step: int) -> None:
        """Update what is due every control period, without publishing."""
        for robot in self._robots.values():
            if robot.tick(step):
                self._commands.follow(robot)

    def find_subscribers(self, nanoseconds: int) -> None:
        """Find the topics with subscribers. `nanoseconds` is the time from which messages are published."""
        if self._bus.changes != self._seen:
            self._seen = self._bus.changes
            topics = self._topics.values()
            self._subscribed = [found for found in topics if found.find_subscribers(nanoseconds)]

    def publish(self, nanoseconds: int) -> None:
        """Publish on all topics with subscribers. `nanoseconds` is the simulated time."""
        self.find_subscribers(nanoseconds)
        if self._subscribed:
            self._clock.run_timers(nanoseconds)
            for topics in self._subscribed:
                topics.publish(self._clock)

    def _shown(self) -> Iterator[str]:
        yield from map(repr, self)
