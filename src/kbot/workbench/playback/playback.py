"""A recording in the page: played back, paused, at any speed, from any time, in a loop."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NoReturn

from kbot.kinematics.transform import Transform
from kbot.messages import Bus, Clock, Publisher
from kbot.messages.types import WORLD
from kbot.model import RobotModel
from kbot.model.writer import to_urdf
from kbot.record.encodings.serialization import decode_cdr
from kbot.record.formats import Index
from kbot.record.world_recorder import POSES_TOPIC
from kbot.text import Diagnostic, KbotError
from kbot.tf.foreign_frames import ForeignFrames
from kbot.tf.static_transforms import add_static_transforms
from kbot.workbench.driving.mover import Moment, flat
from kbot.workbench.playback.recorded_moves import RecordedMoves
from kbot.workbench.playback.recorded_path import world_from_root
from kbot.workbench.playback.recorded_run import TF_STATIC, RecordedRun, RecordedState
from kbot.workbench.playback.recorded_series import series_of_run
from kbot.workbench.playback.recorded_world import RecordedWorld
from kbot.workbench.protocol import Action, Timeline
from kbot.workbench.scene.scene import Control
from kbot.workbench.timeline.recording import RunRecording
from kbot.workbench.timeline.series import Field, Making
from kbot.world import World


@dataclass(frozen=True, slots=True)
class Damage:
    """A damaged part of a recording, in nanoseconds of its clock.

    `before` and `after` are the nearest readable times, or None.
    """

    start: int
    end: int
    before: int | None
    after: int | None

    def nearest(self, nanoseconds: int) -> int:
        """Return the readable time that is nearest to a damaged one."""
        whole = [moment for moment in (self.before, self.after) if moment is not None]
        return min(whole, key=lambda moment: abs(moment - nanoseconds), default=nanoseconds)

    def describe(self, first: int) -> str:
        """Describe the damage, in seconds since `first`."""
        start, end = (self.start - first) * 1e-9, (self.end - first) * 1e-9
        return f"the recording is damaged from {start:.2f} s to {end:.2f} s"


def damage_at(index: Index, nanoseconds: int) -> Damage | None:
    """Return the damage at a time, or None. Raises KbotError if the file is missing."""
    span = index.damage(nanoseconds)
    if span is None:
        return None
    start, end = span
    return Damage(start, end, start - 1 if start > index.start else None, end if end <= index.end else None)


class PlayedRun:
    """Publishes a recording on its bus as time passes. The robot's pose is from /tf and /joint_states."""

    def __init__(
        self,
        robot: RobotModel,
        run: RecordedRun,
        world: RecordedWorld,
        on_start: Callable[[PlayedRun], None] = lambda playback: None,
    ) -> None:
        """`on_start` is called with the run before it plays, and with each run that replaces it."""
        self._robot, self._run, self._world, self._on_start = robot, run, world, on_start
        self._recorded = RecordedState(robot)
        self.bus, self.clock = Bus(), Clock()
        self.errands: list[Callable[[], bool]] = []
        """Tasks to run between two steps, also while playback is paused."""
        self.loop = False
        self.note = ""
        self._silent: set[str] = set()
        self._is_paused = True
        self._publishers: dict[str, tuple[Publisher[Any], type]] = {  # Any: each topic has its own type
            name: (self._advertise(name, kind), kind) for name, kind in run.topics.items()
        }
        self._moves = RecordedMoves(run)
        self._frames = ForeignFrames(self.bus)
        self._frames.poses({}, {})  # subscribes to the transforms
        self._subscribe()
        self._go_to(0.0)
        on_start(self)

    @property
    def description(self) -> str:
        """The robot's URDF. Empty if no robot is known."""
        return self._run.urdf or (to_urdf(self._robot) if self._run.has_robot else "")

    @property
    def world(self) -> str:
        return WORLD

    @property
    def seed(self) -> int:
        return self._run.seed

    @property
    def paused(self) -> bool:
        return self._is_paused

    @paused.setter
    def paused(self, paused: bool) -> None:
        if not paused and self.clock.nanoseconds >= self._run.index.end:
            self._go_to(0.0)
        self._is_paused = paused

    @property
    def timeline(self) -> Timeline:
        index = self._run.index
        at = (self.clock.nanoseconds - index.start) * 1e-9
        silent = tuple(sorted(self._silent))
        return Timeline(
            start=0.0,
            end=round(self._run.seconds, 3),
            at=round(at, 3),
            live=True,
            played=True,
            loop=self.loop,
            paused=self.paused,
            speed=1.0,
            silent=silent,
            recording=None,
        )

    def seek(self, at: float) -> None:
        """Go to a time in s from the start, and publish the latest messages at that time.

        Raises:
            KbotError: the recording is damaged there. It displays the nearest readable time.
        """
        damage = self._go_to(at)
        if damage:
            raise KbotError(damage)

    def _go_to(self, at: float) -> str:
        """Do the same as `seek`, but return the description of a damage, or an empty string."""
        index = self._run.index
        wanted = min(index.start + round(max(0.0, at) * 1e9), index.end)
        damage = damage_at(index, wanted)
        now = wanted if damage is None else damage.nearest(wanted)
        self.clock.set(now)
        self._silent.clear()
        self._recorded.forget()
        self._world.go_to(now)
        self._frames.forget()
        for message in self._run.statics:
            add_static_transforms(self.bus, message)
        self._publish_moves()
        for topic, (publisher, _) in self._publishers.items():
            if publisher.has_subscribers:
                self._publish_latest(topic)
        if damage is None:
            return ""
        return (
            f"{damage.describe(index.start)}. The nearest readable time is {(now - index.start) * 1e-9:.2f} s"
        )

    def advance(self, seconds: float) -> float:
        """Publish the messages of the next seconds, in order.

        Raises:
            KbotError: a message cannot be read, or playback skipped a damaged part.
        """
        before, end = self.clock.nanoseconds, self._run.index.end
        until = min(before + round(seconds * 1e9), end)
        damage = damage_at(self._run.index, until)
        if damage is not None:
            self._pass_over(damage)
        subscribed = [
            topic for topic, (publisher, _) in self._publishers.items() if publisher.has_subscribers
        ]
        for entry in self._run.index.between(subscribed, before, until):
            self.clock.advance_to(max(entry.nanoseconds, self.clock.nanoseconds))
            publisher, kind = self._publishers[entry.topic]
            self._silent.discard(entry.topic)
            message = decode_cdr(entry.cdr, kind)
            if entry.topic == TF_STATIC:
                add_static_transforms(self.bus, message)
            else:
                publisher.publish(message)
        self.clock.advance_to(until)
        self._world.apply_changes(before, until)
        if until >= end:
            if self.loop:
                self.seek(0.0)
            else:
                self._is_paused = True
        return (until - before) * 1e-9

    def _pass_over(self, damage: Damage) -> None:
        start = self._run.index.start
        text = damage.describe(start)
        if damage.after is None:
            self._is_paused = True
            raise KbotError(f"{text}. That is its end")
        self._go_to((damage.after - start) * 1e-9)
        raise KbotError(f"{text}. Playback continues after it")

    def moment(self) -> Moment:
        recorded = self._recorded
        positions = recorded.positions()
        root = self._world_from_root()
        links = {name: root @ pose for name, pose in recorded.tree.poses(positions).items()}
        return Moment(
            time=self._run.seconds_at(self.clock.nanoseconds),
            positions={name: positions.get(name, 0.0) for name in recorded.movable},
            poses=links,
            bodies=flat(self._world.poses()),
            frames=self._frames.poses(links, {}),
            twist=recorded.twist,
            odometry=recorded.odometry,
        )

    def _world_from_root(self) -> Transform:
        return world_from_root(self._run, self._robot, self._recorded, self._world.pose(self._robot.root))

    def series(self, fields: Sequence[Field], start: float, end: float) -> Making:
        """Return values from `start` to `end` seconds of the recording."""
        return series_of_run(self._run, self._robot, fields, start, end)

    def run_errands(self) -> bool:
        return sum(errand() for errand in self.errands) > 0

    def reset(self) -> None:
        self.seek(0.0)

    def drive(self, linear: float, angular: float) -> None:
        if linear or angular:
            _refuse()

    def push(self, link: str, force: tuple[float, float, float], seconds: float) -> None:
        _refuse()

    def set_joint(self, name: str, position: float) -> None:
        _refuse()

    def set_joints(self, preset: Literal["zero", "centre", "random"]) -> None:
        _refuse()

    def act(self, action: Action) -> None:
        _refuse()

    def save(self) -> None:
        return None

    def resume(self, saved: object) -> None:
        _refuse()

    def record(self, recording: RunRecording) -> None:
        raise KbotError("this is already a recording. Use kbot bag cut to save a part of it")

    @property
    def findings(self) -> tuple[Diagnostic, ...]:
        return ()

    @property
    def controls(self) -> Mapping[str, Control]:
        return {}

    @property
    def present(self) -> tuple[World | None, Mapping[str, RobotModel]]:
        return self._world.present

    def replace(self, robot: RobotModel) -> PlayedRun:
        """Return the same time with a changed robot."""
        other = PlayedRun(robot, self._run, self._world, self._on_start)
        other._go_to((self.clock.nanoseconds - self._run.index.start) * 1e-9)
        other.loop, other.paused = self.loop, self.paused
        return other

    def renewed(self, robot: RobotModel) -> NoReturn:
        _refuse()

    def enter(self, world: str, seed: int) -> NoReturn:
        _refuse()

    def _advertise(self, name: str, kind: type) -> Publisher[Any]:
        return self.bus.advertise(
            name,
            kind,
            latched=name in self._run.index.latched,
            on_subscribe=self._publish_latest_of(name),
            rate=self._run.rate(name),
        )

    def _subscribe(self) -> None:
        for name in {*self._run.of_robot, *self._run.odometry} & self._run.topics.keys():
            receive = self._world.receive if name == POSES_TOPIC else self._recorded.receive
            self.bus.subscribe(name, self._run.topics[name], receive)

    def _publish_moves(self) -> None:
        for topic, message in self._moves.until(self.clock.nanoseconds):
            self._publishers[topic][0].publish(message)

    def _publish_latest_of(self, topic: str) -> Callable[[], None]:
        if topic in self._run.moves:
            return self._publish_moves
        return lambda: self._publish_latest(topic)

    def _publish_latest(self, topic: str) -> None:
        """Publish the latest message of a topic."""
        if topic in self._run.moves:
            return  # `_publish_moves` publishes the latest pose of all its frames and joints
        entry = self._run.index.newest(topic, self.clock.nanoseconds)
        if entry is None:
            self._silent.add(topic)
        else:
            publisher, kind = self._publishers[topic]
            publisher.publish(decode_cdr(entry.cdr, kind))


def _refuse() -> NoReturn:
    raise KbotError("a recording is being played back and cannot be changed")
