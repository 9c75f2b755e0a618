"""Runs a launch without a robot: publishes frames, maps, recordings and key commands to peers."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field, replace
from importlib.util import find_spec

from kbot.messages import Bus, Clock, Twist, Vector3
from kbot.record.encodings.plain import to_plain
from kbot.record.record_options import RecordOptions
from kbot.ros.graph.presence import find, running
from kbot.ros.launch.plan import Plan
from kbot.ros.launch.running.processes import Processes
from kbot.ros.launch.running.programs import live_for_programs, start_programs
from kbot.ros.launch.running.shared_parameters import clear_on_master, dump_parameters, with_parameters
from kbot.ros.launch.running.stand_ins import StandIns
from kbot.ros.launch.running.terminal import Terminal
from kbot.ros.launch.staging import Stage, StandInSettings
from kbot.ros.nodes.rosbag_play import BusPlayback
from kbot.ros.peer_options import PeerOptions

PERIOD = 0.01
"""Seconds between two steps of the clock."""
BEHIND = 0.2
"""The most seconds of wall-clock time that the clock catches up after a delay."""
_TWIST = "geometry_msgs/msg/Twist"


@dataclass
class _Published:
    """The bus that peers are connected to."""

    bus: Bus = field(default_factory=Bus)
    clock: Clock = field(default_factory=Clock)
    errands: list[Callable[[], bool]] = field(default_factory=list)
    paused: bool = False


def run_without_robot(plan: Plan, stage: Stage, peers: PeerOptions, terminal: Terminal) -> int:
    """Publish what the launch's nodes publish and run its programs, until all have ended, a required one has
    ended, or Ctrl-C. Return the exit status.

    Time is wall-clock time. With recordings it is their time, which is published on /clock. If the user did
    not ask for a bridge, ROS is not installed and another KBot is running, that KBot receives the key
    commands.

    Raises:
        KbotError: a recording or a map cannot be read, or a bridge or the other KBot cannot be reached.
    """
    published, ended = _Published(), threading.Event()
    bus, clock = published.bus, published.clock
    settings, speed = _separate_rate(stage.stand_ins)
    stand_ins = StandIns(settings, terminal, ended.set)
    dump_parameters(plan)
    stand_ins.record_options(RecordOptions(), is_simulated=False)
    peers = _with_installed_ros(with_parameters(plan, peers))
    is_beside = not (settings.playings or peers.is_live) and bool(running())
    if not is_beside:
        peers = live_for_programs(stage.programs, peers)
    if "ros1" in peers.bridges:
        clear_on_master(plan)
    with ExitStack() as stack:
        stand_ins.play(bus, clock)
        players = stand_ins.players
        if len(players) == 1:
            clock.set(players[0].nanoseconds)
        elif not players:
            clock.set(time.time_ns())
        if settings.keys is not None:
            topic = settings.keys.topic
            stand_ins.drive(clock, _publisher_of_commands(bus, topic))
            if is_beside:
                _forward(stack, bus, topic)
                terminal.note(f"The running KBot receives {topic}.")
        stack.enter_context(stand_ins.keys())
        if is_beside:
            _report_unpublished(settings, terminal)
        else:
            stand_ins.publish_maps(bus)
            description, name = (players[0].description, players[0].name) if players else ("", plan.path)
            outputs = stack.enter_context(terminal.outputs(RecordOptions(), peers, settings.transforms))
            outputs.show(published, description, name, publishes_clock=bool(players))
        processes = start_programs(stack, plan, stage.programs, peers, terminal.note)
        if not players:
            terminal.note("The launch file has no robot. Press Ctrl-C to stop.")
        with suppress(KeyboardInterrupt):
            _run(published, stand_ins.players, speed, processes, ended)
    return processes.status if processes is not None else 0


def _separate_rate(settings: StandInSettings) -> tuple[StandInSettings, float]:
    """The settings with rate 1 for a single recording, and its own rate, at which the clock must run. /clock
    then has the time of the recording's messages."""
    if len(settings.playings) != 1:
        return settings, 1.0
    (playing,) = settings.playings
    return replace(settings, playings=(replace(playing, rate=1.0),)), playing.rate


def _run(
    published: _Published,
    players: Sequence[BusPlayback],
    speed: float,
    processes: Processes | None,
    ended: threading.Event,
) -> None:
    """Advance the clock until the end of the launch. With recordings, it runs at `speed` times wall-clock
    time."""
    due = time.monotonic()
    while not ended.is_set():
        for errand in tuple(published.errands):
            errand()
        _advance(published.clock, speed if players else None)
        if players and all(p.is_over for p in players) and (processes is None or processes.have_ended):
            return
        due = max(due + PERIOD, time.monotonic() - BEHIND)
        time.sleep(max(0.0, due - time.monotonic()))


def _advance(clock: Clock, speed: float | None) -> None:
    """Advance by one period at `speed` or, if it is None, to wall-clock time. The clock jumps after the
    machine was asleep."""
    if speed is not None:
        clock.advance_to(clock.nanoseconds + round(PERIOD * speed * 1e9))
        return
    now = time.time_ns()
    if 0 <= now - clock.nanoseconds <= BEHIND * 1e9:
        clock.advance_to(now)
    else:
        clock.set(now)


def _report_unpublished(settings: StandInSettings, terminal: Terminal) -> None:
    for what, is_there in (("Frames", settings.transforms), ("Maps", settings.maps)):
        if is_there:
            terminal.note(f"{what} of the launch file are not published: the running KBot publishes its own")


def _with_installed_ros(peers: PeerOptions) -> PeerOptions:
    """The peers, with a bridge to the installed ROS if the user did not ask for a bridge and it can be
    opened."""
    from kbot.ros.client import wanted_transport  # imported lazily: few launches need it

    if peers.is_live:
        return peers
    kind = wanted_transport(os.environ)
    if kind == "ros1" or (kind == "ros2" and find_spec("cyclonedds") is not None):
        return replace(peers, bridges=(kind,))
    return peers


def _publisher_of_commands(bus: Bus, topic: str) -> Callable[[float, float], None]:
    publisher = bus.advertise(topic, Twist)

    def publish(linear: float, angular: float) -> None:
        publisher.publish(Twist(Vector3(linear), Vector3(0.0, 0.0, angular)))

    return publish


def _forward(stack: ExitStack, bus: Bus, topic: str) -> None:
    """Forward a topic to the running KBot until the stack is closed. KBOT_AT selects one of several KBots.

    Raises:
        KbotError: KBOT_AT does not select one, or that KBot does not subscribe to the topic.
    """
    from kbot.ros.graph.client import GraphClient  # imported lazily: it loads websockets

    graph = stack.enter_context(GraphClient(find(os.environ.get("KBOT_AT", ""), "KBOT_AT=NUMBER")))
    graph.advertise(topic, _TWIST)
    bus.subscribe(topic, Twist, lambda message: graph.publish(topic, to_plain(message, exact=True)))
