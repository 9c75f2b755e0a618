"""Runs the replacements of a launch's nodes on a bus: maps, playback of recordings, relays, and keys."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from contextlib import AbstractContextManager, nullcontext
from typing import TYPE_CHECKING, Any

from kbot.messages import Bus, Clock
from kbot.record.record_options import RecordOptions
from kbot.ros.launch.running.terminal import Terminal
from kbot.ros.launch.staging import StandInSettings
from kbot.ros.nodes.gz_bridge import GzBridge
from kbot.ros.nodes.relays import relay_topics
from kbot.ros.nodes.rosbag_play import BusPlayback
from kbot.ros.nodes.teleop_twist_keyboard import HELP, RATE, TeleopKeys
from kbot.ros.nodes.twist_mux import run_muxes
from kbot.text import Diagnostic

if TYPE_CHECKING:  # the engine, which a robot that is only shown does not need
    from kbot.sim import Simulation


class StandIns:
    """Replaces map_server, rosbag, relays and teleop_twist_keyboard on one bus, and on the next one when
    another simulation starts. Static transforms are not included: RunOutputs publishes them."""

    def __init__(self, settings: StandInSettings, terminal: Terminal, end: Callable[[], None]) -> None:
        """`end` ends the launch. It is called at the end of a required recording."""
        self.settings, self._terminal, self._end = settings, terminal, end
        keys = settings.keys
        self.teleop = TeleopKeys(keys.speed, keys.turn) if keys is not None else None
        self.players: list[BusPlayback] = []

    def record_options(self, requested: RecordOptions, *, is_simulated: bool) -> RecordOptions:
        """What to record: what the user asked for, otherwise what rosbag of the launch records. Only
        simulated robots are recorded."""
        for recording in self.settings.recordings[:1]:
            if not is_simulated:
                self._terminal.note(f"{recording.path} is not recorded: KBot records only a simulated robot")
            elif not requested.path:
                self._terminal.note(f"Recording to {recording.path}")
                return RecordOptions(recording.path, recording.topics)
        return requested

    def publish_maps(self, bus: Bus) -> None:
        """Publish the maps of map servers.

        Raises:
            KbotError: a map cannot be read.
        """
        if not self.settings.maps:
            return
        # imported lazily, for a fast start-up
        from kbot.messages.navigation import MapMetaData, OccupancyGrid
        from kbot.world.occupancy_files import read_map

        for path in self.settings.maps:
            message = read_map(path).to_message()
            bus.advertise("/map", OccupancyGrid, latched=True).publish(message)
            bus.advertise("/map_metadata", MapMetaData, latched=True).publish(message.info)

    def play(
        self,
        bus: Bus,
        clock: Clock,
        published: Collection[str] = (),
        instead: Mapping[str, Callable[[Any], None]] | None = None,  # Any: each topic has its own type
    ) -> None:
        """Play back the launch's recordings. Playback on an earlier bus ends and continues on this one.
        Topics in `published`, which others publish, are not played back. Messages on topics in `instead` go
        to its functions.

        Raises:
            DescriptionError: a recording cannot be read, or does not have a requested topic or time.
        """
        earlier = self.players
        for playback in earlier:
            playback.close()
        self.players = [
            BusPlayback(
                bus,
                clock,
                playing,
                self._terminal.note,
                excluded=published,
                handlers=instead,
                on_end=self._end if playing.required else lambda: None,
            )
            for playing in self.settings.playings
        ]
        for old, new in zip(earlier, self.players, strict=False):
            new.resume_from(old)

    def pass_topics_on(self, simulation: Simulation) -> list[Diagnostic]:
        """Run the bridges to gz, the twist_muxes and the relays. Returns what they cannot pass on."""
        bridge = GzBridge(simulation, self.settings.bridged)
        muxes = run_muxes(simulation.bus, simulation.clock, self.settings.muxes)
        return bridge.notes + muxes + relay_topics(simulation, self.settings.relayed)

    def drive(self, clock: Clock, command: Callable[[float, float], None]) -> None:
        """Command the speeds of the pressed keys, in m/s and rad/s, while the clock advances."""
        if (teleop := self.teleop) is not None:
            clock.every(RATE, lambda: teleop.drive(command))

    def keys(self) -> AbstractContextManager[None]:
        """Read keys from the terminal within the block."""
        if self.teleop is None:
            return nullcontext()
        self._terminal.note(HELP)
        return self._terminal.keys(self.teleop.press)
