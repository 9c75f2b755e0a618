"""Runs a launch with a robot: serves the robot in the workbench and runs the other nodes beside it."""

from __future__ import annotations

import _thread
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from kbot.kinematics.planar_pose import PlanarPose
from kbot.messages import JointState
from kbot.model.writer import to_urdf
from kbot.record.record_options import RecordOptions
from kbot.record.run_outputs import RunOutputs
from kbot.ros.launch.node_settings.rviz import ViewerSettings
from kbot.ros.launch.plan import Plan
from kbot.ros.launch.running.programs import live_for_programs, start_programs
from kbot.ros.launch.running.robots import as_spawned, spawn_all
from kbot.ros.launch.running.shared_parameters import clear_on_master, dump_parameters, with_parameters
from kbot.ros.launch.running.stand_ins import StandIns
from kbot.ros.launch.running.terminal import Terminal
from kbot.ros.launch.staging import Stage
from kbot.ros.nodes.joint_state_publisher import with_dependent_joints
from kbot.ros.peer_options import PeerOptions
from kbot.text import Diagnostic, KbotError
from kbot.workbench.address import Address
from kbot.workbench.displays.display_file import DisplayFile
from kbot.workbench.driving.sliders import Sliders, SliderSetting
from kbot.workbench.serve import serve_session
from kbot.workbench.session.session import Session
from kbot.workbench.source.description_file import DescriptionFile

if TYPE_CHECKING:
    from kbot.ros.launch.running.world import ChosenWorld
    from kbot.sim import Simulation


class RobotRun:
    """A run of a launch whose stage has a robot."""

    def __init__(
        self,
        plan: Plan,
        stage: Stage,
        terminal: Terminal,
        package_path: Sequence[str] = (),
        findings: Sequence[Diagnostic] = (),
    ) -> None:
        """`findings` are those of the launch file, for the page."""
        if stage.robot is None:
            raise ValueError("the launch has no robot")
        self._plan, self._stage, self._robot, self._terminal = plan, stage, stage.robot, terminal
        self._package_path, self._findings = package_path, findings
        self.stand_ins = StandIns(stage.stand_ins, terminal, _thread.interrupt_main)

    def run(
        self, record: RecordOptions, peers: PeerOptions, world: ChosenWorld | None, address: Address
    ) -> int:
        """Serve the workbench and run the launch's programs until Ctrl-C or until a required program exits.
        Return the exit status. Without a `world` the robot is shown and not simulated.

        Raises:
            DescriptionError, KbotError: the robot or a bridge cannot be used.
        """
        plan, stage, terminal = self._plan, self._stage, self._terminal
        dump_parameters(plan)
        peers = live_for_programs(stage.programs, with_parameters(plan, peers))
        record = self.stand_ins.record_options(record, is_simulated=world is not None)
        if "ros1" in peers.bridges:
            clear_on_master(plan)
        with ExitStack() as stack:
            outputs = stack.enter_context(terminal.outputs(record, peers, stage.stand_ins.transforms))
            with terminal.loading(self._robot.path if world is None else world.name):
                session = self.session(outputs, world)
            processes = start_programs(
                stack, plan, stage.programs, peers, terminal.note, session.extra_findings.append
            )
            if world is not None:
                stack.enter_context(self.stand_ins.keys())
            serve_session(session, address)
        return processes.status if processes is not None else 0

    def session(self, outputs: RunOutputs, world: ChosenWorld | None) -> Session:
        """The robot in the workbench: simulated in a world, or only shown if `world` is None."""
        session = self._shown(outputs) if world is None else self._simulated(outputs, world)
        session.extra_findings += self._findings
        if self._stage.viewer is not None:
            session.display_file = self._displays(self._stage.viewer)
        return session

    def _displays(self, viewer: ViewerSettings) -> DisplayFile:
        """The displays of the launch's rviz. An invalid file is only reported, because rviz also starts
        without it. The notes of the stage report a missing file."""
        displays = DisplayFile()
        if Path(viewer.displays).is_file():
            try:
                displays = DisplayFile(viewer.displays)
            except KbotError as error:
                self._terminal.note(f"{error}. The page shows its default displays.")
        for note in displays.notes:
            self._terminal.note(f"{viewer.displays}: {note}")
        if viewer.fixed_frame:
            displays.set_fixed_frame(viewer.fixed_frame)
        return displays

    def _simulated(self, outputs: RunOutputs, world: ChosenWorld) -> Session:
        # imported lazily: they load the engine, which a robot that is only shown does not need
        from kbot.sensors.declared import mount_on_others
        from kbot.sim.naming import Naming
        from kbot.workbench.session.driven_session import driven_session

        stage, stand_ins, robot = self._stage, self.stand_ins, self._robot
        spawn = robot.spawn
        start = PlanarPose(spawn.x, spawn.y, spawn.yaw)

        def connect(simulation: Simulation) -> None:
            bus = simulation.bus
            stand_ins.publish_maps(bus)
            outputs.join(simulation, "", world.name)
            if simulation.steps == 0 and simulation.start == start:
                self._terminal.report(spawn_all(simulation, stage, self._package_path))
            mount_on_others(simulation)
            notes = stand_ins.pass_topics_on(simulation)
            self._terminal.report(notes if simulation.steps == 0 else ())
            stand_ins.play(bus, simulation.clock, published=bus.topics.keys() - bus.inputs)
            if stand_ins.settings.keys is not None:
                stand_ins.drive(simulation.clock, _command_of(simulation, stand_ins.settings.keys.topic))

        description = DescriptionFile(
            robot.path,
            robot.arguments,
            self._package_path,
            lambda read: as_spawned(read, robot),
        )
        naming = Naming(spawn.model, spawn.namespace, robot.frame_prefix)
        session = driven_session(description, world.world, world.name, 0, "recipe", connect, start, naming)
        session.require_robot()
        session.paused = stage.gazebo.paused
        if session.paused:
            self._terminal.note(
                "The launch file starts the simulation paused. Press P in the page to continue."
            )
        return session

    def _shown(self, outputs: RunOutputs) -> Session:
        joints = self._stage.joints

        def connect(sliders: Sliders) -> None:
            self.stand_ins.publish_maps(sliders.bus)
            outputs.show(sliders, to_urdf(sliders.robot), sliders.robot.name)

            def set_joints(message: JointState) -> None:
                for name, position in zip(message.name, message.position, strict=False):
                    try:
                        sliders.set_joint(name, position)
                    except KbotError:
                        continue  # the joint belongs to another robot

            for topic in joints.sources:
                sliders.bus.subscribe(topic, JointState, set_joints)
            self.stand_ins.play(sliders.bus, sliders.clock, instead={"/joint_states": set_joints})

        description = DescriptionFile(
            self._robot.path,
            self._robot.arguments,
            self._package_path,
            lambda read: with_dependent_joints(read, joints.dependent, joints.use_mimic_tags),
        )
        setting = SliderSetting(joints.zeros, joints.rate, connect)
        session = Session(description, "view", lambda robot: Sliders(robot, setting=setting))
        session.require_robot()
        return session


def _command_of(simulation: Simulation, topic: str) -> Callable[[float, float], None]:
    """The function that commands the robot which subscribes to the topic, else the first robot."""
    for robot in simulation.robots.values():
        if robot.settings is not None and topic in map(robot.naming.topic, robot.settings.command_topics):
            return robot.command
    return simulation.robots.first.command
