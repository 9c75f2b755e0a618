"""The session: the description, the last valid robot, its findings, and what moves it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from kbot.model import RobotModel
from kbot.text import DescriptionError, Diagnostic, KbotError
from kbot.tf.foreign_frames import frame_for_peers
from kbot.workbench.displays.display_file import DisplayFile
from kbot.workbench.driving.mover import Moment, Mover, flat
from kbot.workbench.driving.no_robot import NO_ROBOT, NoRobot
from kbot.workbench.driving.program import Program
from kbot.workbench.driving.turns import Turns
from kbot.workbench.meshes.markers import MarkerMeshes
from kbot.workbench.meshes.store import MeshStore
from kbot.workbench.playback.recorded_path import RecordedPath
from kbot.workbench.protocol import (
    About,
    Action,
    Advance,
    AskRule,
    Drive,
    Findings,
    FromPage,
    FromServer,
    Notice,
    OpenDisplays,
    OpenSource,
    Pause,
    Publish,
    Push,
    RecordRun,
    Refused,
    Reset,
    ResetPart,
    RunProgram,
    SaveDisplays,
    SaveSource,
    Scene,
    Seek,
    SetJoint,
    SetJoints,
    SetLoop,
    SetSpeed,
    SetWorld,
    State,
    Stop,
    Timeline,
)
from kbot.workbench.session.deadman import NOBODY, Deadman
from kbot.workbench.session.offers import Mode, Offers, about
from kbot.workbench.session.shown_scene import ShownScene
from kbot.workbench.source.description import DescriptionReading
from kbot.workbench.source.rule_pages import rule_page
from kbot.workbench.source.shown import Reader, ShownDescription
from kbot.workbench.timeline.marks import Marks
from kbot.workbench.timeline.recording import RunRecording
from kbot.workbench.timeline.series import Field, Making
from kbot.workbench.topics.relay import TopicRelay
from kbot.world.world import World


def state_message(
    moment: Moment,
    robot: RobotModel,
    *,
    revision: int,
    paused: bool,
    speed: float,
    rate: float,
    driver: int,
    resets: int,
    at: float,
) -> State:
    """Return the state of the robot in the scene of a revision. Numbers are rounded to what is visible."""
    return State(
        revision=revision,
        time=round(moment.time, 6),
        paused=paused,
        speed=speed,
        rate=round(rate, 3),
        positions=tuple(round(moment.positions[joint.name], 6) for joint in robot.movable_joints),
        poses=flat(moment.poses[link] for link in robot.links),
        bodies=moment.bodies,
        frames=tuple((name, parent) for name, (parent, _) in moment.frames.items()),
        frame_poses=flat(pose for _, pose in moment.frames.values()),
        command=moment.command,
        twist=tuple(round(v, 5) for v in moment.twist),
        odometry=tuple(round(v, 6) for v in moment.odometry),
        driver=driver,
        resets=resets,
        at=round(at, 4),
        faults=moment.faults,
        fallen=moment.fallen,
        jumps=moment.jumps,
    )


def apply_to_mover(order: FromPage, motion: Mover) -> bool:
    """Apply a message if it is for the mover. Returns whether it is.

    Raises:
        KbotError: the message cannot be carried out. The text is the reason.
    """
    match order:
        case SetJoint(name=name, position=position):
            motion.set_joint(name, position)
        case SetJoints(preset=preset):
            motion.set_joints(preset)
        case Push(link=link, x=x, y=y, z=z, seconds=seconds):
            motion.push(link, (x, y, z), seconds)
        case Advance(seconds=seconds):
            motion.paused = True
            while seconds > 1e-6 and (done := motion.advance(seconds)) > 0.0:
                seconds -= done  # a slow machine needs several calls
        case Seek(at=at):
            motion.seek(at)
        case SetLoop(loop=loop):
            motion.loop = loop
        case _ if isinstance(order, Action):
            motion.act(order)
        case _:
            return False
    return True


REPORT_PERIOD = 0.5
"""Seconds between two looks for new findings about the run, which read the whole scene."""
NOTHING = Offers()
RECORDED = "the robot is part of a recording and cannot be changed"


class Session:
    """One displayed robot. Everything runs on the server's loop except `read`, which only reads, and `adopt`.

    Only the holder of `turns` may use the session: a `program` drives the simulation on another thread, and
    the server adopts a new reading on one.
    """

    def __init__(
        self,
        reader: Reader,
        mode: Mode,
        make_motion: Callable[[RobotModel], Mover],
        world: World | None = None,
        offers: Offers = NOTHING,
    ) -> None:
        """Read the description. `make_motion` returns the mover, once the description is usable.

        Raises:
            KbotError: `make_motion` failed for another reason than the description.
        """
        self.mode = mode
        self._offers = offers
        self.meshes = MeshStore()
        reason = RECORDED if mode == "play" else reader.read_only_reason
        self.shown = ShownDescription(reader, self.meshes, reason)
        self.display_file = DisplayFile()
        self.recording = RunRecording()
        self.played = ""
        """The recording on display, or empty."""
        self.waits_for_page = False
        """Whether it starts paused and continues when the first page connects."""
        self.marks = Marks()
        self.turns = Turns()
        self.program: Program | None = None
        """The user's program that drives the simulation, if there is one."""
        self._was_programmed = False
        self.requests: list[Callable[[], None]] = []
        """Functions that other threads queue for the server's loop. Each is called once."""
        self.wants_reading: Callable[[], None] = lambda: None
        """Called to read the description again without waiting for its files to change."""
        self.announce: Callable[[FromServer], None] = lambda message: None
        """Sends a message to every page."""
        self.along: Callable[[float], float] = lambda time: time
        """Converts the current simulated time to a time on the timeline."""
        self.recorded_path: RecordedPath | None = None
        """The path in the recording that is played back."""
        self._motion: Mover = NoRobot(make_motion, world)
        refused = self.shown.take(self.shown.latest, self._replace)
        if refused is not None and not isinstance(refused, DescriptionError):
            raise refused
        for_page = MarkerMeshes(
            self.meshes,
            self.shown.file,
            self.shown.package_path,
            when_loaded=lambda: self.requests.append(self.topics.send_markers_again),
        )
        self.note = ""
        """A notice for new pages, for example about what is not displayed."""
        self._last_state: State | None = None
        self._observed: tuple[Diagnostic, ...] = ()
        """The findings about the run, as they were last looked up."""
        self.extra_findings: list[Diagnostic] = []
        """Findings that are not about the description, such as those of a launch file. Any thread may append
        to them."""
        self._reported: tuple[str, ...] | None = None
        """What pages know of `extra_findings` (messages) and of the findings about the run (codes)."""
        self._report_in = 0.0
        self.topics = TopicRelay(self._motion.bus, lambda: self._motion.clock.nanoseconds, for_page)
        self.speed = 1.0
        self.rate = 0.0
        self._resets = 0
        self._deadman = Deadman(lambda linear, angular: self._motion.drive(linear, angular))
        self._scene = ShownScene(self.shown, self.meshes, self._motion, world, on_ground=mode != "view")
        self.shown.collect_findings()

    @property
    def scene(self) -> Scene:
        """Everything that is drawn."""
        return self._scene.scene

    def read(self) -> DescriptionReading:
        """Read the description again. May run on another thread."""
        return self.shown.read()

    def adopt(self, reading: DescriptionReading) -> list[FromServer]:
        """Use a new reading, and return messages about the changes. An unusable reading keeps the last valid
        robot."""
        refused = self.shown.take(reading, self._replace)
        messages: list[FromServer] = [Refused(str(refused))] if refused is not None else []
        if not self.shown.is_stale:
            if self._motion.note:
                messages.append(Notice(self._motion.note))
            self.recording.end()
            self.topics.attach(self._motion.bus)
            messages.append(self._scene.build(self._motion))
        self.shown.collect_findings()
        return [self.about(), *messages, self.findings(), self.shown.authoring.parameters(), self.state()]

    def _replace(self, robot: RobotModel) -> None:
        if self.program is not None and self.program.is_running:
            self._motion = self._motion.renewed(robot)  # the program starts again, with the changed robot
            self._resets += 1
            self.program.restart()
            return
        waited_for_robot = isinstance(self._motion, NoRobot)
        self._motion = self._motion.replace(robot)
        if self.program is not None and waited_for_robot:
            self.program.restart()

    def require_robot(self) -> None:
        """Raise DescriptionError, with all findings, if the description has never been usable."""
        if not self.shown.has_robot:
            raise DescriptionError(self.shown.latest.findings)

    def greeting(self, client: int, *, is_lent: bool = True) -> list[FromServer]:
        """Return the first messages for a page. Without `is_lent` a program uses the simulation, and the page
        gets the last state."""
        if self.waits_for_page and client != NOBODY:
            self.waits_for_page = self.paused = False
        if is_lent:
            self._observed = self._motion.findings
        state = self.state() if is_lent else self._last_state
        found = self.shown.findings((*self.extra_findings, *self._observed))
        parts: list[FromServer] = [self.scene, found, self.shown.authoring.parameters()]
        parts += [state] if state is not None else []
        settings = self.display_file.greeting
        note = [Refused(self.note)] if self.note and client != NOBODY else []
        marks = [self.marks.view] if self.mode != "view" else []
        program = [self.program.view()] if self.program is not None else []
        displays = [settings] if settings is not None else []
        return [self.about(client), *displays, *parts, *marks, *program, *note]

    def missing_meshes(self) -> list[str]:
        """Return the findings about meshes that are missing, or that the page may not load."""
        return [*self.shown.missing_meshes(), *self._scene.outside]

    def standing(self) -> tuple[RobotModel, dict[str, float]]:
        """Return the robot on display, and the positions (rad, m) of its joints without mimic joints.

        Raises:
            KbotError: there is no robot yet.
        """
        if not self.shown.has_robot:
            raise KbotError(NO_ROBOT)
        positions = self._motion.moment().positions
        free = (joint.name for joint in self.shown.robot.movable_joints if joint.mimic is None)
        return self.shown.robot, {name: positions[name] for name in free if name in positions}

    def about(self, client: int = NOBODY) -> About:
        return about(
            self.shown,
            self.mode,
            self._scene.world,
            self._offers,
            played=self.played,
            seed=self._motion.seed,
            folder=self.recording.folder,
            client=client,
        )

    def findings(self) -> Findings:
        """The findings about the description and the run. For the thread that has the simulation."""
        return self.shown.findings(self._besides_description)

    @property
    def _besides_description(self) -> tuple[Diagnostic, ...]:
        self._observed = self._motion.findings
        return (*self.extra_findings, *self._observed)

    def _report_findings(self, wall_seconds: float = REPORT_PERIOD) -> None:
        """Send the findings to every page if those about the run, or `extra_findings`, have changed."""
        self._report_in -= wall_seconds
        if self._report_in > 0.0:
            return
        self._report_in = REPORT_PERIOD
        found = self._besides_description
        known, self._reported = self._reported, tuple(map(self._key, found))
        if known is None or self._reported == known:  # the greeting has those of the start
            return
        self.announce(self.findings())
        for finding in found:
            if self._key(finding) not in known:
                what = finding.message.partition(": ")[0]  # the list of findings has the cause
                self.announce(Notice(f"{what[0].upper()}{what[1:]}. See Findings: {finding.code}."))

    def _key(self, finding: Diagnostic) -> str:
        """What identifies a finding. The message of one about the run changes during the run."""
        return finding.message if finding in self.extra_findings else finding.code

    def state(self) -> State:
        moment = self._motion.moment()
        self._last_state = state_message(
            moment,
            self.shown.robot,
            revision=self._scene.revision,
            paused=self.paused,
            speed=self.speed,
            rate=self.rate,
            driver=self._deadman.driver,
            resets=self._resets,
            at=self._along(moment.time),
        )
        return self._last_state

    def _along(self, time: float) -> float:
        played = self.timeline()
        return played.at if played is not None else self.along(time)

    @property
    def paused(self) -> bool:
        """Whether the simulation is paused. A page or a client of Gazebo's services can set it."""
        return self._motion.paused

    @paused.setter
    def paused(self, paused: bool) -> None:
        self._motion.paused = paused

    def timeline(self) -> Timeline | None:
        """Return the timeline of the recording that is played back, or None."""
        return self._motion.timeline

    def series(self, fields: Sequence[Field], start: float, end: float) -> Making | None:
        """Return values of the recording that is played back, or None."""
        return self._motion.series(fields, start, end)

    def advance(self, wall_seconds: float) -> bool:
        """Advance by wall-clock time. Returns whether anything may have changed."""
        while self.requests:
            self.requests.pop(0)()
        self._deadman.pass_time(wall_seconds)
        if self.mode == "view":
            self._motion.advance(wall_seconds)
        changed = self._motion.run_errands() | self._send_changes()
        self._report_findings(wall_seconds)
        was_programmed, self._was_programmed = self._was_programmed, self._is_programmed
        if self._was_programmed or was_programmed:
            return True
        if self.mode == "view" or self.paused or wall_seconds <= 0.0:
            return changed
        done = self._motion.advance(wall_seconds * self.speed)
        self.rate += (done / wall_seconds - self.rate) * min(1.0, wall_seconds / 0.5)
        return True

    @property
    def _is_programmed(self) -> bool:
        """Whether a program makes the steps now."""
        return self.program is not None and self.program.owns_time

    def renew(self) -> None:
        """Start the robot and world on display again, as a new simulation at time 0."""
        self._use(self._motion.renewed(self.shown.robot))

    @property
    def run(self) -> object:
        """The current mover. Another robot or world has another one."""
        return self._motion

    def save(self) -> tuple[object, int] | None:
        """Return what `resume` needs, and its size in bytes."""
        return self._motion.save()

    def resume(self, saved: object) -> None:
        """Continue the simulation from a saved state. A robot that was being driven stops.

        Raises:
            KbotError: robots were added or deleted since, or a program drives.
        """
        if self.program is not None and self.program.is_running:
            raise KbotError(f"{self.program.name} drives the robot. Press Space to stop it first")
        self._motion.resume(saved)
        self.paused = False
        self._resets += 1
        self._deadman.release()
        self._send_changes()

    def handle(self, message: FromPage, client: int) -> list[FromServer]:
        """Carry out a page's message, and return the answers for this page.

        Raises:
            KbotError: the message cannot be carried out. The text is the reason.
        """
        if self.program is not None and self.program.is_running and self._reserved(message, self.program):
            return []
        match message:
            case RunProgram():
                if self.program is None:
                    raise KbotError("there is no program to run. Start one with kbot sim FILE --script PY")
                self.program.start()
            case Drive(linear=linear, angular=angular):
                self._deadman.drive(linear, angular, client)
            case Stop():
                self._deadman.stop()
            case Pause(paused=paused):
                self.paused = paused
                self.rate = 0.0
            case Reset():
                self._motion.reset()
                self._resets += 1
                self._deadman.release()
                self._report_findings()
            case SetSpeed(factor=factor):
                self.speed = factor
            case SetWorld(world=world, seed=seed):
                self._enter(world, round(seed))
            case Publish(topic=topic, kind=kind, message=fields):
                self.topics.publish(topic, kind, fields)
            case SaveDisplays(kind=to, setup=setup):
                frame = frame_for_peers(self._motion.moment().frames, self.scene.root)
                return [self.display_file.save(to, setup, frame)]
            case OpenDisplays(name=name, text=text):
                return [self.display_file.open(name, text)]
            case RecordRun(on=True):
                self._motion.record(self.recording)
            case RecordRun():
                self.recording.end()
            case OpenSource(file=file):
                completions = self.shown.completions()
                source = self.shown.open(file, self._besides_description)
                return [source, *([completions] if completions is not None else [])]
            case SaveSource():
                answer = self.shown.save(message)
                self.wants_reading()
                return [answer]
            case AskRule(code=code):
                return [rule_page(code)]
            case _ if apply_to_mover(message, self._motion):
                self._resets += isinstance(message, ResetPart | Seek)
                self._send_changes()
            case _:
                if self.shown.authoring.handle(message):
                    self.wants_reading()
        return []

    def _reserved(self, message: FromPage, program: Program) -> bool:
        """Handle what means something else while a program drives. Returns whether it was such a message.

        Raises:
            KbotError: only the program may do it now.
        """
        match message:
            case Drive(linear=linear, angular=angular):
                if linear or angular:
                    raise KbotError(f"{program.name} drives the robot. Press Space to stop it first")
            case Reset() if program.can_start:
                program.restart()
            case SetWorld(world=world, seed=seed):
                self._enter(world, round(seed))
                program.restart()
            case Advance(seconds=seconds):
                self.paused = True
                program.grant(seconds)
            case Stop():
                pass  # the program ends, and then stops the robot
            case _:
                return False
        return True

    def leave(self, client: int) -> None:
        """Forget a page that has disconnected. If it was driving, the robot stops."""
        self.topics.leave(client)
        self._deadman.leave(client)

    def _enter(self, name: str, seed: int) -> None:
        motion, self._scene.world = self._motion.enter(name, seed)
        self._offers = replace(self._offers, world_name=name)
        self._use(motion)

    def _use(self, motion: Mover) -> None:
        """Continue with another mover, and display it."""
        self._motion = motion
        self.recording.end()
        self.topics.attach(self._motion.bus)
        self._resets += 1
        self._deadman.release()
        scene = self._scene.build(self._motion)
        for message in (self.about(), scene, self.state()):
            self.announce(message)

    def _send_changes(self) -> bool:
        """Send new objects and other robots to every page. Returns whether there are changes."""
        known = self.missing_meshes()
        things = self._scene.update(self._motion)
        if things is None:
            return False
        self.announce(things)
        self.announce(self.state())
        for text in self.missing_meshes():
            if text not in known:
                self.announce(Refused(text))
        return True
