"""What a launch does beside its robot, or without one."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from kbot.cli.output import print_note
from kbot.record.record_options import RecordOptions

if TYPE_CHECKING:
    from kbot.messages import Bus
    from kbot.ros.launch import Plan
    from kbot.ros.launch.staging import Stage
    from kbot.ros.peer_options import PeerOptions


def with_parameters(plan: Plan, peers: PeerOptions) -> PeerOptions:
    """The launch's parameters are there for peers to read."""
    values = {name: param.value for name, param in plan.params.items() if _can_be_told(param.value)}
    return replace(peers, parameters=values)


def recording_of(staged: Stage, record: RecordOptions) -> RecordOptions:
    """The recording of the command line, else that of the launch file."""
    for recording in staged.recordings[:1]:
        if staged.path is None or not staged.simulate:
            print_note(f"{recording.path} is not recorded: nothing is simulated here")
        elif not record.path:
            record = RecordOptions(recording.path, recording.topics)
            print_note(f"Recording to {recording.path}")
    return record


def _can_be_told(value: object) -> bool:
    """Whether every peer takes it as a parameter: XML-RPC has no nothing and no long numbers."""
    if isinstance(value, list):
        return all(map(_can_be_told, value))
    if isinstance(value, int):
        return -(1 << 31) <= value < 1 << 31
    return isinstance(value, str | float)


def publish_maps(bus: Bus, staged: Stage) -> None:
    """Say what map servers say."""
    if not staged.maps:
        return
    from kbot.messages.navigation import MapMetaData, OccupancyGrid  # only for a map: start-up time
    from kbot.world.occupancy_files import read_map

    for path in staged.maps:
        message = read_map(path).to_message()
        bus.advertise("/map", OccupancyGrid, latched=True).publish(message)
        bus.advertise("/map_metadata", MapMetaData, latched=True).publish(message.info)


def dump_parameters(plan: Plan) -> None:
    """`rosparam dump`: what the launch sets beneath a name, into a file."""
    from kbot.ros.parameter_values import dump_yaml  # rarely needed: start-up time
    from kbot.text.files import write_text

    for command, name, file in plan.store:
        if command == "dump":
            values = {key: param.value for key, param in plan.params.items()}
            write_text(file, dump_yaml(values, name))
