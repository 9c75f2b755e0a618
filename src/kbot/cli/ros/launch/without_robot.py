"""Runs a launch that has no robot: publishes frames, maps, recordings and key commands to peers."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field, replace
from importlib.util import find_spec
from typing import TYPE_CHECKING

from kbot.cli.keys import keys
from kbot.cli.output import fail, print_note
from kbot.cli.outputs import run_outputs
from kbot.cli.ros.launch.beside import dump_parameters, publish_maps, recording_of, with_parameters
from kbot.cli.ros.launch.programs import clear_on_master, live_for_programs, start_programs
from kbot.messages import Bus, Clock, Twist, Vector3
from kbot.record.encodings.plain import to_plain
from kbot.ros.graph.presence import find, running
from kbot.ros.nodes.rosbag_play import BusPlayback

if TYPE_CHECKING:
    from kbot.record.record_options import RecordOptions
    from kbot.ros.launch import Plan
    from kbot.ros.launch.running.processes import Processes
    from kbot.ros.launch.staging import Stage
    from kbot.ros.nodes.teleop_twist_keyboard import Keys
    from kbot.ros.peer_options import PeerOptions

PERIOD = 0.01
BEHIND = 0.2
"""Seconds of wall time that are caught up at most."""
_TWIST = "geometry_msgs/msg/Twist"


@dataclass
class _Said:
    """What peers hear."""

    bus: Bus = field(default_factory=Bus)
    clock: Clock = field(default_factory=Clock)
    errands: list[Callable[[], bool]] = field(default_factory=list)
    paused: bool = False


def has_something_to_say(staged: Stage) -> bool:
    """Whether a launch without a robot has anything but programs of the user's own."""
    return bool(staged.playings or staged.transforms or staged.maps or staged.keys)


def run_without_robot(plan: Plan, staged: Stage, record: RecordOptions, peers: PeerOptions) -> int:
    """Say to peers what the launch's nodes say, with its programs beside, until the end of all, of a required
    recording, or Ctrl-C; the exit status. Time is the wall's, but where recordings are played: that of a
    single one is its run's, and it is told on /clock. Where no bridge is asked for, no ROS is here and a KBot
    runs, that hears the commands.

    Raises:
        KbotError: a recording or a map cannot be read, or a bridge or the KBot cannot be reached.
    """
    if record.path:
        fail("--record goes with a launch that simulates; this one has no robot")
    said, playings, speed = _Said(), staged.playings, 1.0
    if len(playings) == 1:
        speed, playings = playings[0].rate, (replace(playings[0], rate=1.0),)
    is_over = [False]

    def end() -> None:
        is_over[0] = True

    dump_parameters(plan)
    recording_of(staged, record)  # reports that nothing is recorded
    peers = _as_the_environment_says(with_parameters(plan, peers))
    is_beside = not (playings or peers.is_live) and bool(running())
    if not is_beside:
        peers = live_for_programs(staged.programs, peers)
    if "ros1" in peers.bridges:
        clear_on_master(plan)
    with ExitStack() as stack:
        players = [
            BusPlayback(
                said.bus, said.clock, playing, print_note, on_end=end if playing.required else lambda: None
            )
            for playing in playings
        ]
        if len(players) == 1:
            said.clock.set(players[0].nanoseconds)
        elif not players:
            said.clock.set(time.time_ns())
        if staged.keys is not None:
            _drive_by_keys(stack, said, staged.keys, is_beside=is_beside)
        if is_beside:
            _tell_what_is_not_said(staged)
        else:
            publish_maps(said.bus, staged)
            description, name = (players[0].description, players[0].name) if players else ("", plan.path)
            outputs = stack.enter_context(run_outputs(None, peers, staged.transforms, served=True))
            outputs.show(said, description, name, tells_time=bool(players))
        processes = start_programs(stack, plan, staged.programs, peers)
        if not players:
            print_note("There is no robot here. Ctrl-C ends it.")
        with suppress(KeyboardInterrupt):
            _run(said, players, speed, processes, is_over)
    return processes.status if processes is not None else 0


def _run(
    said: _Said,
    players: Sequence[BusPlayback],
    speed: float,
    processes: Processes | None,
    is_over: list[bool],
) -> None:
    """Let time pass, at `speed` times the wall's where there are players, until it is over."""
    due = time.monotonic()
    while not is_over[0]:
        for errand in tuple(said.errands):
            errand()
        _pass_time(said.clock, speed if players else None)
        if players and all(p.is_over for p in players) and (processes is None or processes.are_over):
            return
        due = max(due + PERIOD, time.monotonic() - BEHIND)
        time.sleep(max(0.0, due - time.monotonic()))


def _tell_what_is_not_said(staged: Stage) -> None:
    for what, is_there in (("Frames", staged.transforms), ("Maps", staged.maps)):
        if is_there:
            print_note(f"{what} of the launch are not said: the KBot that runs has its own")


def _pass_time(clock: Clock, speed: float | None) -> None:
    """A period of a recording's, or, without one, until now; a machine that slept is not caught up."""
    if speed is not None:
        clock.advance_to(clock.nanoseconds + round(PERIOD * speed * 1e9))
        return
    now = time.time_ns()
    if 0 <= now - clock.nanoseconds <= BEHIND * 1e9:
        clock.advance_to(now)
    else:
        clock.set(now)


def _as_the_environment_says(peers: PeerOptions) -> PeerOptions:
    """With a bridge to the ROS that is there, if it can be had, where none is asked for."""
    from kbot.ros.client import wanted_transport  # lazy in this module: few launches need it

    if peers.is_live:
        return peers
    kind = wanted_transport(os.environ)
    if kind == "ros1" or (kind == "ros2" and find_spec("cyclonedds") is not None):
        return replace(peers, bridges=(kind,))
    return peers


def _drive_by_keys(stack: ExitStack, said: _Said, settings: Keys, *, is_beside: bool) -> None:
    """Publish the commands of the keys, and send them to the KBot that runs if it `is_beside`."""
    from kbot.ros.nodes.teleop_twist_keyboard import HELP, RATE, TeleopKeys

    publisher = said.bus.advertise(settings.topic, Twist)
    if is_beside:
        _carry(stack, said.bus, settings.topic)

    def drive(linear: float, angular: float) -> None:
        publisher.publish(Twist(Vector3(linear), Vector3(0.0, 0.0, angular)))

    teleop = TeleopKeys(settings.speed, settings.turn)
    said.clock.every(RATE, lambda: teleop.drive(drive))
    print_note(HELP)
    stack.enter_context(keys(teleop.press))


def _carry(stack: ExitStack, bus: Bus, topic: str) -> None:
    """Let the KBot that runs hear a topic; which, KBOT_AT says where several run. Raises KbotError: it says
    none of them, or the KBot hears no such topic."""
    from kbot.ros.graph.client import GraphClient

    graph = GraphClient(find(os.environ.get("KBOT_AT", ""), "KBOT_AT=NUMBER"))
    stack.callback(graph.close)
    graph.advertise(topic, _TWIST)
    bus.subscribe(topic, Twist, lambda message: graph.publish(topic, to_plain(message, exact=True)))
    print_note(f"The KBot that runs hears {topic}.")
