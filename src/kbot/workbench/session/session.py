"""The session: the description, the last valid robot, its findings, and what moves it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from kbot.model import RobotModel
from kbot.workbench.displays.display_file import DisplayFile
from kbot.workbench.driving.mover import Moment, Mover, flat
from kbot.workbench.meshes.markers import MarkerMeshes
from kbot.workbench.meshes.store import MeshStore
from kbot.workbench.playback.recorded_way import RecordedWay
from kbot.workbench.protocol import (
    About,
    Action,
    Advance,
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
    SaveDisplays,
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
from kbot.workbench.scene.foreign_frames import frame_for_peers
from kbot.workbench.session.deadman import NOBODY, Deadman
from kbot.workbench.session.offers import Mode, Offers, about
from kbot.workbench.session.shown_scene import ShownScene
from kbot.workbench.source.description import DescriptionReading
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
    """The state of the robot in the scene of a revision, its numbers as short as they can be seen."""
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


def carry_out(order: FromPage, motion: Mover) -> bool:
    """Whether it was something for a motion, which is then done.

    Raises:
        KbotError: it cannot be done; the text says why.
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
                seconds -= done  # a slow machine does it in several goes
        case Seek(at=at):
            motion.seek(at)
        case SetLoop(loop=loop):
            motion.loop = loop
        case _ if isinstance(order, Action):
            motion.act(order)
        case _:
            return False
    return True


NOTHING = Offers()
RECORDED = "the robot is that of a recording, which is not changed"


class Session:
    """One robot on show. Everything here runs on the server's loop but `read`, which only reads."""

    def __init__(
        self,
        reader: Reader,
        mode: Mode,
        make_motion: Callable[[RobotModel], Mover],
        world: World | None = None,
        offers: Offers = NOTHING,
    ) -> None:
        """Reads the description; `make_motion` makes what moves the robot.

        Raises:
            DescriptionError: it makes no robot, or one with errors.
        """
        self.mode = mode
        self._offers = offers
        self.meshes = MeshStore()
        self.shown = ShownDescription(reader, self.meshes, RECORDED if mode == "play" else "")
        self.display_file = DisplayFile()
        self.recording = RunRecording()
        self.played = ""
        """The recording on show, empty where none is."""
        self.waits_for_page = False
        """Whether it goes on when the first page is there."""
        self.marks = Marks()
        self.wants_reading: Callable[[], None] = lambda: None
        """Called when the description is to be read anew, without waiting for its files to change."""
        self.announce: Callable[[FromServer], None] = lambda message: None
        """Tells every page."""
        self.along: Callable[[float], float] = lambda time: time
        """Where a simulated time, which is now, is along the timeline."""
        self.way: RecordedWay | None = None
        """That of the recording that is played."""
        self._motion = make_motion(self.shown.robot)
        for_page = MarkerMeshes(self.meshes, self.shown.file, self.shown.package_path)
        self.note = ""
        """What pages are to know at once, such as what is not shown."""
        self.topics = TopicRelay(self._motion.bus, lambda: self._motion.clock.nanoseconds, for_page)
        self.speed = 1.0
        self.rate = 0.0
        self._resets = 0
        self._deadman = Deadman(lambda linear, angular: self._motion.drive(linear, angular))
        self._scene = ShownScene(self.shown, self.meshes, self._motion, world, on_ground=mode != "view")
        self.shown.look()

    @property
    def scene(self) -> Scene:
        """All that is drawn."""
        return self._scene.scene

    def read(self) -> DescriptionReading:
        """Read the description again; may run on another thread."""
        return self.shown.read()

    def adopt(self, reading: DescriptionReading) -> list[FromServer]:
        """Take over a new reading, and say what changed; a broken one keeps the last good robot."""
        refused = self.shown.take(reading, self._replace)
        messages: list[FromServer] = [Refused(refused)] if refused else []
        if not self.shown.is_stale:
            if self._motion.note:
                messages.append(Notice(self._motion.note))
            self.recording.end()
            self.topics.attach(self._motion.bus)
            messages.append(self._scene.build(self._motion))
        self.shown.look()
        return [self.about(), *messages, self.findings(), self.shown.authoring.parameters(), self.state()]

    def _replace(self, robot: RobotModel) -> None:
        self._motion = self._motion.replace(robot)

    def greeting(self, client: int) -> list[FromServer]:
        """What a page is told first."""
        if self.waits_for_page and client != NOBODY:
            self.waits_for_page = self.paused = False
        parts = (self.scene, self.findings(), self.shown.authoring.parameters(), self.state())
        settings = self.display_file.greeting
        note = [Refused(self.note)] if self.note and client != NOBODY else []
        marks = [self.marks.view] if self.mode != "view" else []
        return [self.about(client), *([settings] if settings is not None else []), *parts, *marks, *note]

    def missing_meshes(self) -> list[str]:
        """What is said of meshes that are not there, or not for the page."""
        return [*self.shown.missing_meshes(), *self._scene.outside]

    def standing(self) -> tuple[RobotModel, dict[str, float]]:
        """The robot on show, and where the joints stand that follow no other; rad, m."""
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
        return self.shown.findings()

    def state(self) -> State:
        moment = self._motion.moment()
        return state_message(
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

    def _along(self, time: float) -> float:
        played = self.timeline()
        return played.at if played is not None else self.along(time)

    @property
    def paused(self) -> bool:
        """Whether time waits; a page may say so, and who calls Gazebo's services."""
        return self._motion.paused

    @paused.setter
    def paused(self, paused: bool) -> None:
        self._motion.paused = paused

    def timeline(self) -> Timeline | None:
        """That of the recording that is played; None where none is."""
        return self._motion.timeline

    def series(self, fields: Sequence[Field], start: float, end: float) -> Making | None:
        """How numbers went in the recording that is played; None where none is."""
        return self._motion.series(fields, start, end)

    def advance(self, wall_seconds: float) -> bool:
        """Let wall time pass; whether anything may have changed."""
        self._deadman.pass_time(wall_seconds)
        if self.mode == "view":
            self._motion.advance(wall_seconds)
        changed = self._motion.run_errands() | self._look_around()
        if self.mode == "view" or self.paused or wall_seconds <= 0.0:
            return changed
        done = self._motion.advance(wall_seconds * self.speed)
        self.rate += (done / wall_seconds - self.rate) * min(1.0, wall_seconds / 0.5)
        return True

    @property
    def run(self) -> object:
        """Another one for another robot or world."""
        return self._motion

    def save(self) -> tuple[object, int] | None:
        """What `resume` goes on from, and its size in bytes."""
        return self._motion.save()

    def resume(self, saved: object) -> None:
        """Let the simulation go on from a saved state; where the robot was driven then it stops. Raises
        KbotError: robots came or went since."""
        self._motion.resume(saved)
        self.paused = False
        self._resets += 1
        self._deadman.release()
        self._look_around()

    def obey(self, message: FromPage, client: int) -> list[FromServer]:
        """Do what a page asks, and answer to it alone.

        Raises:
            KbotError: it cannot be done; the text says why.
        """
        match message:
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
            case SetSpeed(factor=factor):
                self.speed = factor
            case SetWorld(world=world, seed=seed):
                self._enter(world, round(seed))
            case Publish(topic=topic, kind=kind, message=fields):
                self.topics.publish(topic, kind, fields)
            case SaveDisplays(kind=to, setup=setup):
                frame = frame_for_peers(self._motion.moment().frames, self.shown.robot.root)
                return [self.display_file.save(to, setup, frame)]
            case OpenDisplays(name=name, text=text):
                return [self.display_file.open(name, text)]
            case RecordRun(on=True):
                self._motion.record(self.recording)
            case RecordRun():
                self.recording.end()
            case OpenSource(file=file):
                return [self.shown.source(file)]
            case _ if carry_out(message, self._motion):
                self._resets += isinstance(message, ResetPart | Seek)
                self._look_around()
            case _:
                if self.shown.authoring.obey(message):
                    self.wants_reading()
        return []

    def leave(self, client: int) -> None:
        """A page is gone; if it was driving, the robot stops."""
        self.topics.leave(client)
        self._deadman.leave(client)

    def _enter(self, name: str, seed: int) -> None:
        self._motion, self._scene.world = self._motion.enter(name, seed)
        self._offers = replace(self._offers, named=name)
        self.recording.end()
        self.topics.attach(self._motion.bus)
        self._resets += 1
        self._deadman.release()
        scene = self._scene.build(self._motion)
        for message in (self.about(), scene, self.state()):
            self.announce(message)

    def _look_around(self) -> bool:
        """Tell every page where things or other robots came or went; whether they did."""
        known = self.missing_meshes()
        things = self._scene.look_around(self._motion)
        if things is None:
            return False
        self.announce(things)
        self.announce(self.state())
        for text in self.missing_meshes():
            if text not in known:
                self.announce(Refused(text))
        return True
