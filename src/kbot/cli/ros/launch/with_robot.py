"""Carries out a launch: the robot in the workbench, and what the launch file wants beside it."""

from __future__ import annotations

import _thread
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kbot.cli.arguments import read_displays
from kbot.cli.keys import keys
from kbot.cli.output import print_note, report
from kbot.cli.outputs import run_outputs
from kbot.cli.progress import loading
from kbot.cli.ros.launch.beside import dump_parameters, publish_maps, recording_of, with_parameters
from kbot.cli.ros.launch.programs import clear_on_master, live_for_programs, start_programs
from kbot.cli.ros.launch.robots import put_all
from kbot.kinematics.odometry import PlanarPose
from kbot.messages import JointState
from kbot.model.spawned import with_controllers
from kbot.model.writer import to_urdf
from kbot.ros.nodes.joint_state_publisher import with_dependent_joints
from kbot.ros.nodes.teleop_twist_keyboard import HELP, RATE, TeleopKeys
from kbot.text import KbotError
from kbot.workbench.displays.display_file import DisplayFile
from kbot.workbench.serve import serve_session
from kbot.workbench.session.session import Session
from kbot.workbench.source.description import DescriptionFile

if TYPE_CHECKING:
    from kbot.cli.ros.launch.place import Place
    from kbot.messages import Bus, Clock
    from kbot.record.record_options import RecordOptions
    from kbot.record.run_outputs import RunOutputs
    from kbot.ros.launch import Plan
    from kbot.ros.launch.staging import Stage
    from kbot.ros.nodes.rosbag_play import BusPlayback
    from kbot.ros.peer_options import PeerOptions
    from kbot.sim import Simulation
    from kbot.workbench.address import Address


def carry_out(
    plan: Plan,
    staged: Stage,
    record: RecordOptions,
    peers: PeerOptions,
    place: Place | None,
    address: Address,
    package_path: Sequence[str],
) -> int:
    """Serve the workbench, with the launch's programs beside it, until Ctrl-C or until a required one ends;
    the exit status. `place` is where the robot is simulated, None where it is only shown.

    Raises:
        DescriptionError, KbotError: the robot or a bridge cannot be used.
    """
    dump_parameters(plan)
    peers = live_for_programs(staged.programs, with_parameters(plan, peers))
    record = recording_of(staged, record)
    if "ros1" in peers.bridges:
        clear_on_master(plan)
    with ExitStack() as stack:
        outputs = stack.enter_context(run_outputs(record, peers, staged.transforms, served=True))
        teleop = TeleopKeys(staged.keys.speed, staged.keys.turn) if staged.keys is not None else None
        if place is not None:
            with loading(place.named):
                session = _simulated(staged, outputs, place, package_path, teleop)
        else:
            with loading(str(staged.path)):
                session = _shown(staged, outputs, package_path)
        processes = start_programs(stack, plan, staged.programs, peers)
        if teleop is not None and place is not None:
            print_note(HELP)
            stack.enter_context(keys(teleop.press))
        session.display_file = _displays(staged)
        if staged.fixed_frame:
            session.display_file.hold(staged.fixed_frame)
        serve_session(session, address)
    return processes.status if processes is not None else 0


def _displays(staged: Stage) -> DisplayFile:
    """The displays of the launch's rviz; a file of no use is told of, as rviz would start without it. One
    that is not there is among the stage's notes."""
    if not Path(staged.displays).is_file():
        return DisplayFile()
    try:
        return read_displays(staged.displays)
    except KbotError as error:
        print_note(f"{error}; the page shows its own displays")
        return DisplayFile()


def _simulated(
    staged: Stage,
    outputs: RunOutputs,
    place: Place,
    package_path: Sequence[str],
    teleop: TeleopKeys | None,
) -> Session:
    from kbot.ros.nodes.gz_bridge import (
        GzBridge,  # the engine, which a robot that is only shown does not need
    )
    from kbot.sensors.declared import mount_on_others
    from kbot.sim.naming import Naming
    from kbot.workbench.session.driven_session import driven_session

    spawn = staged.spawn
    description = DescriptionFile(
        str(staged.path),
        staged.arguments,
        package_path,
        lambda robot: with_controllers(robot, staged.controllers),
    )

    players: list[BusPlayback] = []

    def attend(simulation: Simulation) -> None:
        publish_maps(simulation.bus, staged)
        outputs.join(simulation, "", place.named)
        if simulation.steps == 0 and simulation.start == start:
            put_all(simulation, staged, package_path)
        mount_on_others(simulation)
        if staged.bridged:
            notes = GzBridge(simulation, staged.bridged).notes
            report(notes if simulation.steps == 0 else ())
        bus = simulation.bus
        players[:] = _play(staged, bus, simulation.clock, players, bus.topics.keys() - bus.inputs)
        if teleop is not None:
            command = _command(simulation, staged.keys.topic if staged.keys is not None else "")
            simulation.clock.every(RATE, lambda: teleop.drive(command))

    start = PlanarPose(spawn.x, spawn.y, spawn.yaw)
    naming = Naming(spawn.model, spawn.namespace, staged.frame_prefix)
    session = driven_session(description, place.world, place.named, 0, "recipe", attend, start, naming)
    session.paused = staged.paused
    if staged.paused:
        print_note("The simulation is paused, as the launch file asks. Press P in the page to continue.")
    return session


def _command(simulation: Simulation, topic: str) -> Callable[[float, float], None]:
    """That of the robot which hears this topic, else of the first."""
    for robot in simulation.robots.values():
        if robot.settings is not None and topic in map(robot.naming.topic, robot.settings.command_topics):
            return robot.command
    return simulation.robots.first.command


def _shown(staged: Stage, outputs: RunOutputs, package_path: Sequence[str]) -> Session:
    from kbot.workbench.driving.sliders import Sliders, SliderSetting

    joints = staged.joints
    players: list[BusPlayback] = []

    def attend(sliders: Sliders) -> None:
        publish_maps(sliders.bus, staged)
        outputs.show(sliders, to_urdf(sliders.robot), sliders.robot.name)

        def take_over(message: JointState) -> None:
            for name, position in zip(message.name, message.position, strict=False):
                try:
                    sliders.set_joint(name, position)
                except KbotError:
                    continue  # joints that it does not have are another robot's

        for topic in joints.sources:
            sliders.bus.subscribe(topic, JointState, take_over)
        instead = {"/joint_states": take_over}
        players[:] = _play(staged, sliders.bus, sliders.clock, players, instead=instead)

    description = DescriptionFile(
        str(staged.path),
        staged.arguments,
        package_path,
        lambda robot: with_dependent_joints(robot, joints.dependent, joints.use_mimic_tags),
    )
    setting = SliderSetting(joints.zeros, joints.rate, attend)
    return Session(description, "view", lambda robot: Sliders(robot, setting=setting))


def _play(
    staged: Stage,
    bus: Bus,
    clock: Clock,
    before: list[BusPlayback],
    theirs: Collection[str] = (),
    instead: Mapping[str, Callable[[Any], None]] | None = None,
) -> list[BusPlayback]:
    """Let the launch's recordings be said; those that were said `before`, to a bus that is no more, go on.

    Raises:
        KbotError: one cannot be read, or has nothing of what is asked for.
    """
    from kbot.ros.nodes.rosbag_play import BusPlayback

    for playback in before:
        playback.close()
    players = [
        BusPlayback(
            bus,
            clock,
            playing,
            print_note,
            theirs=theirs,
            instead=instead,
            on_end=_thread.interrupt_main if playing.required else lambda: None,
        )
        for playing in staged.playings
    ]
    for old, new in zip(before, players, strict=False):
        new.go_on_from(old)
    return players
