"""The programs of a trial, as peers of its simulation: starts them, and waits for them at every tick."""

from __future__ import annotations

import secrets
import select
import socket
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field

from kbot.extensions import ProgramFailed, TrialProgram
from kbot.messages.clock import NANOSECONDS
from kbot.messages.live import Live
from kbot.record.feed import Feed, Packet
from kbot.ros.gazebo.gazebo_services import gazebo_services
from kbot.ros.gazebo.states import GazeboTopics
from kbot.ros.lockstep.channel import VARIABLE, Channel, ChannelClosed, Message
from kbot.ros.lockstep.endpoints import LOOPBACK, Endpoint, LocalEndpoint, Ros1Endpoint, Ros2Endpoint
from kbot.ros.lockstep.link import POLL_SECONDS, LockstepLink
from kbot.ros.lockstep.process import ProgramProcess
from kbot.ros.lockstep.real_time import RealTime
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean

TICK_RATE = 50.0
"""Hz of simulated time at which time waits for the programs: the control rate of a robot."""
START_LIMITS = 3
"""A program has this many times its time limit to connect and to answer first, because it loads modules."""
TRANSPORTS = ("local", "ros1", "ros2")
_SLICE_SECONDS = 0.2
"""Seconds between two checks whether a program that does not answer has exited."""


def open_programs(programs: Sequence[TrialProgram], report: Callable[[str], None]) -> TrialPrograms:
    """The programs as peers of a run. `report` receives sentences for the user.

    Raises:
        KbotError: a transport is unknown, or a time limit is not above 0.
    """
    return TrialPrograms(programs, report)


class _Output:
    """What the simulation publishes on a topic that programs subscribe to."""

    def __init__(self) -> None:
        self.times: list[int] = []
        """When each message was published, in ns."""

    def receive(self, packet: Packet) -> None:
        self.times.append(packet.nanoseconds)


@dataclass(eq=False)
class _Member:
    """A program in lockstep.

    identity    the source of its messages
    types       of its topics
    subscribed  the topics that the simulation publishes, with the number of messages that it has received
    inputs      the topics on which it publishes to the simulation
    latched     its latched topics, and whether it has published on them
    waiting     messages of other programs, and latched ones, for its next tick: time in ns, topic, source
    """

    process: ProgramProcess
    endpoint: Endpoint
    token: str
    channel: Channel | None = None
    identity: str = ""
    is_ready: bool = False
    has_left: bool = False
    types: dict[tuple[str, bool], str] = field(default_factory=dict)
    subscribed: dict[str, int] = field(default_factory=dict)
    inputs: set[str] = field(default_factory=set)
    latched: dict[str, bool] = field(default_factory=dict)
    waiting: list[tuple[int, str, str]] = field(default_factory=list)

    @property
    def file(self) -> str:
        return self.process.program.file

    @property
    def is_present(self) -> bool:
        return self.is_ready and not self.has_left


class _Turn:
    """One wait for a program: the errors if it takes too long or exits."""

    def __init__(self, process: ProgramProcess, limit: float, what: str, when: str) -> None:
        """`what` follows 'did not', and `when` follows 'exited with status 1'."""
        self.what, self.when = what, when
        self._process, self._limit = process, limit
        self._end = time.monotonic() + limit

    @property
    def left(self) -> float:
        return max(0.0, self._end - time.monotonic())

    def check(self) -> None:
        """Raises ProgramFailed: the program has exited, or the time is over."""
        if self._process.has_exited:
            raise self._process.failure(self.when)
        self.check_time()

    def check_time(self) -> None:
        if self.left <= 0.0:
            raise self._process.timeout(f"did not {self.what} within {self._limit:g} s")

    def disconnected(self) -> ProgramFailed:
        """The error after the program closed its connection, which happens when it exits."""
        if self._process.exit_status(max(1.0, self.left)) is None:
            return self._process.timeout(f"closed its connection {self.when}")
        return self._process.failure(self.when)


class TrialPrograms:
    """Runs programs from `join` to `leave`. While the simulation steps, it waits for each at every tick."""

    def __init__(self, programs: Sequence[TrialProgram], report: Callable[[str], None]) -> None:
        for program in programs:
            if program.transport not in TRANSPORTS:
                hint = did_you_mean(program.transport, TRANSPORTS) or f"choose from {', '.join(TRANSPORTS)}"
                raise KbotError(f"{program.file}: unknown transport '{program.transport}': {hint}")
            if not program.time_limit > 0.0:
                raise KbotError(f"{program.file}: the time limit must be above 0 s, not {program.time_limit}")
        self._programs = tuple(programs)
        self._link = LockstepLink(report)
        self._members: list[_Member] = []
        self._in_real_time: list[tuple[ProgramProcess, Endpoint]] = []
        self._shared: dict[str, Endpoint] = {}
        self._outputs: dict[str, _Output] = {}
        self._topics: object = None
        self._until_left = ExitStack()

    def join(self, simulation: Simulation, feed: Feed, description: str, world: str) -> None:
        """Start the programs, and wait until all have connected and are ready for the first tick.

        Raises:
            ProgramFailed: a program cannot be started, exits, or does not connect within its limit.
            KbotError: a transport cannot be opened.
        """
        opened = self._until_left
        opened.callback(GazeboTopics(simulation).close)
        self._link.offer(gazebo_services())
        self._link.parameters = {"/robot_description": description, "/use_sim_time": True}
        self._link.attach(simulation, feed)
        opened.callback(self._link.end)
        self._topics = self._link.topics
        door = opened.enter_context(socket.create_server((LOOPBACK, 0)))
        opened.callback(self._close_channels)
        for program in self._programs:
            self._start(program, door)
        opened.callback(self._end_run)
        for member in self._members:
            self._admit(member, door)
        for process, endpoint in self._in_real_time:
            self._wait_for_other(process, endpoint)
        timer = simulation.clock.every(TICK_RATE, lambda: simulation.clock.after_timers(self._tick))
        opened.callback(timer.cancel)
        if self._in_real_time:
            simulation.stepping.pace = RealTime(simulation)
            opened.callback(setattr, simulation.stepping, "pace", None)

    def show(self, shown: Live, feed: Feed, description: str, name: str, *, publishes_clock: bool) -> None:
        """Raises KbotError: programs need a simulation."""
        raise KbotError("programs need a simulation, and this robot is only shown")

    def leave(self) -> None:
        """End the programs and disconnect from the simulation."""
        self._until_left.close()
        self._members.clear()
        self._in_real_time.clear()

    def close(self) -> None:
        self.leave()

    def _end_run(self) -> None:
        """Report to all programs that the run is over."""
        for member in self._members:
            if member.channel is not None:
                with suppress(ChannelClosed):
                    member.channel.send("end")

    def _close_channels(self) -> None:
        for member in self._members:
            if member.channel is not None:
                member.channel.close()

    # the start

    def _start(self, program: TrialProgram, door: socket.socket) -> None:
        endpoint, token = self._endpoint_for(program), secrets.token_urlsafe(18)
        environment = dict(endpoint.environment)
        if program.lockstep:
            environment[VARIABLE] = f"{LOOPBACK}:{door.getsockname()[1]}/{token}"
        process = ProgramProcess(program, environment)
        self._until_left.callback(process.close)
        if program.lockstep:
            self._members.append(_Member(process, endpoint, token))
        else:
            self._in_real_time.append((process, endpoint))

    def _endpoint_for(self, program: TrialProgram) -> Endpoint:
        """A program that connects locally has its own, so that its messages are known as its own."""
        endpoint = self._shared.get(program.transport)
        if endpoint is None:
            if program.transport == "local":
                endpoint = LocalEndpoint(
                    self._link, f"program {len(self._members) + len(self._in_real_time)}"
                )
            else:
                kind = Ros1Endpoint if program.transport == "ros1" else Ros2Endpoint
                endpoint = self._shared[program.transport] = kind(self._link)
            self._until_left.callback(endpoint.close)
        return endpoint

    def _admit(self, member: _Member, door: socket.socket) -> None:
        """Wait until the node of a program is ready."""
        limit = START_LIMITS * member.process.program.time_limit
        turn = _Turn(member.process, limit, "connect with a kbot.Node", "before it connected")
        while member.channel is None:
            turn.check()
            if select.select([door], (), (), _SLICE_SECONDS)[0]:
                self._open_channel(Channel(door.accept()[0]))
        hello = self._receive(member, turn)
        member.identity = member.endpoint.identity_of(str(hello["identity"]))
        others = [other for other in self._members if other.is_ready and other.identity == member.identity]
        transport = member.process.program.transport
        if hello["transport"] != transport:
            error = f"the node uses the transport {hello['transport']}, but the program has {transport}"
        elif others:
            error = f"{others[0].file} has a node {hello['name']} too. Name one of them with __name:=NAME"
        else:
            error = ""
        if error:
            self._send(member, turn, "welcome", error=error)
        else:
            self._link.sources.add(member.identity)
            self._send(member, turn, "welcome", now=self._now, simulation=member.endpoint.simulation)
        turn.what, turn.when = "start, that is call spin or step,", "before it was ready"
        self._serve(member, turn)
        if member.has_left:
            raise ProgramFailed(
                f"{member.file} closed its node before the run began: let it call spin or step"
            )
        member.is_ready = True

    def _open_channel(self, channel: Channel) -> None:
        message = None
        with suppress(ChannelClosed):  # something else has connected
            message = channel.receive(1.0)
        token = str(message.get("token")).encode(errors="replace") if message else b""
        for member in self._members:
            if member.channel is None and secrets.compare_digest(token, member.token.encode()):
                member.channel = channel
                return
        channel.close()

    def _wait_for_other(self, process: ProgramProcess, endpoint: Endpoint) -> None:
        """Wait until a program that is not in lockstep has connected."""
        turn = _Turn(process, START_LIMITS * process.program.time_limit, "connect", "before it connected")
        while not endpoint.has_peers():
            turn.check()
            time.sleep(POLL_SECONDS)
            self._link.serve()

    # a tick

    @property
    def _now(self) -> int:
        return self._link.nanoseconds

    def _tick(self) -> None:
        """Called by the simulation's clock, after everything else at this time."""
        self._link.serve()
        if self._link.topics is not self._topics:
            self._topics = self._link.topics
            self._follow_topics()
        for member in self._members:
            if member.is_present:
                turn = self._turn_of(member)
                self._link.flush()
                self._send(member, turn, "tick", now=self._now, messages=self._take_messages(member))
                self._serve(member, turn)
        for process, _ in self._in_real_time:
            if process.exit_status(0.0):
                raise process.failure(f"at {self._now / NANOSECONDS:.3f} s")

    def _turn_of(self, member: _Member) -> _Turn:
        when = f"the tick at {self._now / NANOSECONDS:.3f} s"
        return _Turn(member.process, member.process.program.time_limit, f"answer {when}", f"in {when}")

    def _take_messages(self, member: _Member) -> list[tuple[int, str, str]]:
        """The messages for the next tick of a program, in the order in which their callbacks run."""
        source = member.endpoint.simulation
        messages, member.waiting = member.waiting, []
        for topic, count in member.subscribed.items():
            times = self._outputs[topic].times
            messages += [(time, topic, source) for time in times[count:]]
            member.subscribed[topic] = len(times)
        ranks = {other.identity: rank for rank, other in enumerate(self._members)}
        return sorted(messages, key=lambda message: (*message[:2], ranks.get(message[2], -1)))

    def _serve(self, member: _Member, turn: _Turn) -> None:
        """Answer a program until it has done everything for the current tick, and deliver its messages."""
        while True:
            message = self._receive(member, turn)
            if message["op"] == "connect":
                self._connect(member, turn, message)
            else:
                self._deliver(member, turn, message["messages"])
                if message["op"] == "bye":
                    self._let_go(member, turn)
                return

    def _deliver(self, member: _Member, turn: _Turn, topics: Sequence[str]) -> None:
        for topic in topics:
            if topic in member.latched:
                member.latched[topic] = True
            for other in self._members:
                if other.is_present and other.endpoint is member.endpoint and (topic, False) in other.types:
                    other.waiting.append((self._now, topic, member.identity))
            if topic not in member.inputs:
                continue
            reason = self._link.deliver_next(topic, member.identity, turn.left)
            if reason is None:
                raise member.process.timeout(f"published a message on {topic} that did not arrive")
            if reason:
                raise ProgramFailed(f"{member.file} {turn.when}: {reason}")

    def _let_go(self, member: _Member, turn: _Turn) -> None:
        """The program has closed its node. Its exit status counts if it exits now."""
        member.has_left = True
        self._send(member, turn, "end")
        if member.process.exit_status(turn.left):
            raise member.process.failure(turn.when)

    # topics

    def _connect(self, member: _Member, turn: _Turn, request: Message) -> None:
        """Connect a new topic of a program to the simulation and to the other programs."""
        topic, publishes = str(request["topic"]), bool(request["publishes"])
        type_name = str(request["type"])
        peers = [
            other
            for other in self._members
            if other.is_present
            and other.endpoint is member.endpoint
            and (topic, not publishes) in other.types
        ]
        refusal = member.endpoint.refusal(topic, type_name, publishes)
        for other in peers:
            if (known := other.types[topic, not publishes]) != type_name:
                refusal = refusal or f"{topic} carries {known} in {other.file}, not {type_name}"
        if refusal:
            self._send(member, turn, "connected", error=refusal)
            return
        self._send(member, turn, "connecting")
        member.types[topic, publishes] = type_name
        if request["latched"]:
            member.latched[topic] = False
        identities = [self._connect_other(member, turn, topic, other, publishes) for other in peers]
        if self._has_simulation_topic(member, topic, publishes):
            self._connect_simulation(member, turn, topic, publishes)
            identities.append(member.endpoint.simulation)
        self._send(member, turn, "connected", peers=identities)

    def _connect_other(
        self, member: _Member, turn: _Turn, topic: str, other: _Member, publishes: bool
    ) -> str:
        self._check(other, turn, topic, member.identity)
        publisher, subscriber = (member, other) if publishes else (other, member)
        if publisher.latched.get(topic) and member.endpoint.repeats_latched:
            subscriber.waiting.append((self._now, topic, publisher.identity))
        return other.identity

    def _check(self, member: _Member, turn: _Turn, topic: str, peer: str) -> None:
        """Wait until a program's side of a topic is connected. The program waits for its next tick."""
        own = _Turn(member.process, turn.left, f"connect {topic}", turn.when)
        self._send(member, own, "check", topics={topic: [peer]})
        self._receive(member, own)

    def _has_simulation_topic(self, member: _Member, topic: str, publishes: bool) -> bool:
        found = self._link.topics.get(topic)
        if found is None:
            return False
        return found.is_input if publishes else member.endpoint.publishes(found)

    def _connect_simulation(self, member: _Member, turn: _Turn, topic: str, publishes: bool) -> None:
        """Wait until the simulation's side of a topic is connected to a program."""
        self._link.wait_for_peers(member.endpoint, [(topic, member.identity, not publishes)], turn.check)
        if publishes:
            member.inputs.add(topic)
            return
        if topic not in self._outputs:
            output = self._outputs[topic] = _Output()
            self._link.open(topic, output.receive)
            self._link.serve()
        times = self._outputs[topic].times
        member.subscribed[topic] = len(times)
        if times and self._link.is_latched(topic) and member.endpoint.repeats_latched:
            member.waiting.append((self._now, topic, member.endpoint.simulation))

    def _follow_topics(self) -> None:
        """Connect programs to new topics of the simulation, such as those of a spawned robot."""
        for member in self._members:
            if not member.is_present:
                continue
            for (topic, publishes), type_name in member.types.items():
                is_known = topic in (member.inputs if publishes else member.subscribed)
                is_there = self._has_simulation_topic(member, topic, publishes)
                if is_there and not is_known:
                    if refusal := member.endpoint.refusal(topic, type_name, publishes):
                        raise ProgramFailed(f"{member.file}: {refusal}")
                    turn = self._turn_of(member)
                    self._connect_simulation(member, turn, topic, publishes)
                    self._check(member, turn, topic, member.endpoint.simulation)
                elif is_known and not is_there:
                    member.inputs.discard(topic)
                    member.subscribed.pop(topic, None)

    # the channel

    def _send(self, member: _Member, turn: _Turn, op: str, **fields: object) -> None:
        try:
            self._channel(member).send(op, **fields)
        except ChannelClosed:
            raise turn.disconnected() from None

    def _receive(self, member: _Member, turn: _Turn) -> Message:
        while True:
            has_exited = member.process.has_exited  # before the last look: it may have answered and exited
            try:
                message = self._channel(member).receive(min(_SLICE_SECONDS, turn.left))
            except ChannelClosed:
                raise turn.disconnected() from None
            if message is not None:
                return message
            if has_exited:
                raise turn.disconnected()
            turn.check_time()

    def _channel(self, member: _Member) -> Channel:
        if member.channel is None:
            raise ProgramFailed(f"{member.file} is not connected")
        return member.channel
