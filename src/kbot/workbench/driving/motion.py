"""What moves the robot in the page: joint sliders here, or the simulation in `driving`."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, Protocol

from kbot.kinematics.frames import FrameTree
from kbot.kinematics.transform import Transform
from kbot.messages import Bus, Clock, Header, JointState
from kbot.model import Joint, JointType, Robot
from kbot.nodes import RobotStatePublisher
from kbot.text import KbotError
from kbot.workbench.protocol import Action, FallenView, FaultView, Timeline
from kbot.workbench.scene.foreign_frames import Frames
from kbot.workbench.scene.scene import Control, slider_range
from kbot.workbench.timeline.recording import RunRecording
from kbot.workbench.timeline.series import Field, Making
from kbot.world import World


@dataclass(frozen=True, slots=True)
class Moment:
    """How things stand: poses in the world, and speeds as forward m/s and turning rad/s."""

    time: float
    positions: Mapping[str, float]
    poses: Mapping[str, Transform]
    bodies: tuple[float, ...] = ()
    frames: Frames = field(default_factory=dict)
    command: tuple[float, float] = (0.0, 0.0)
    twist: tuple[float, float] = (0.0, 0.0)
    odometry: tuple[float, float, float] = (0.0, 0.0, 0.0)
    faults: tuple[FaultView, ...] = ()
    fallen: tuple[FallenView, ...] = ()
    jumps: int = 0
    """How often the robot was put elsewhere."""


class Motion(Protocol):
    """One way to move a robot."""

    @property
    def world(self) -> str:
        """The frame that poses are in."""
        ...

    @property
    def bus(self) -> Bus: ...

    @property
    def clock(self) -> Clock: ...

    paused: bool
    """Whether time waits."""

    note: str
    """What is to be told of how it took the place of another, empty for nothing."""

    @property
    def seed(self) -> int:
        """That of whatever is random."""
        ...

    def moment(self) -> Moment: ...

    def run_errands(self) -> bool:
        """Do what others asked for; whether anything may have changed."""
        ...

    def advance(self, seconds: float) -> float:
        """Let time pass; the simulated seconds that did, less where the machine cannot follow."""
        ...

    def reset(self) -> None: ...

    def drive(self, linear: float, angular: float) -> None:
        """Raises KbotError where the robot cannot drive."""
        ...

    def push(self, link: str, force: tuple[float, float, float], seconds: float) -> None:
        """A force in N along the world's axes. Raises KbotError where nothing moves by itself."""
        ...

    def set_joint(self, name: str, position: float) -> None:
        """Raises KbotError where there is no such joint, or joints are not set by hand."""
        ...

    def set_joints(self, preset: Literal["zero", "centre", "random"]) -> None: ...

    def act(self, action: Action) -> None:
        """Change the running world. Raises KbotError where that cannot be done."""
        ...

    @property
    def controls(self) -> Mapping[str, Control]:
        """What each joint may be told; nothing where it is not there."""
        ...

    @property
    def present(self) -> tuple[World | None, Mapping[str, Robot]]:
        """The world as it is now, and the robots beside the one on show."""
        ...

    loop: bool
    """Whether what has an end begins again there."""

    @property
    def timeline(self) -> Timeline | None:
        """Where it stands in a recording that is played; None where none is."""
        ...

    def series(self, fields: Sequence[Field], start: float, end: float) -> Making | None:
        """How numbers went from `start` to `end` seconds of it; None where none is played."""
        ...

    def seek(self, at: float) -> None:
        """Go to a time in s from the recording's start. Raises KbotError where none is played."""
        ...

    def record(self, recording: RunRecording) -> None:
        """Let what happens be recorded. Raises KbotError where nothing is simulated, or see `begin`."""
        ...

    def save(self) -> tuple[object, int] | None:
        """All that what follows depends on, and its size in bytes; None where nothing goes on by itself."""
        ...

    def resume(self, saved: object) -> None:
        """Go on from what `save` gave, not driven. Raises KbotError: it is of another simulation."""
        ...

    def replace(self, robot: Robot) -> Motion:
        """The same with a changed robot, standing as this one does. Raises KbotError."""
        ...

    def enter(self, world: str, seed: int) -> tuple[Motion, World]:
        """The same robot at the start of another world. Raises KbotError."""
        ...


SAID_RATE = 10.0
"""Hz at which joint states and transforms are said, as joint_state_publisher does."""


@dataclass(frozen=True, slots=True)
class SliderSetting:
    """What stays when the robot changes: where joints start (rad or m), how often they are said (Hz), and
    who is told of each robot that is shown."""

    zeros: Mapping[str, float] = field(default_factory=dict)
    rate: float = SAID_RATE
    attend: Callable[[Sliders], None] = lambda sliders: None


@dataclass
class Sliders:
    """Joints put where the sliders stand; nothing moves by itself. Says `joint_states`, `/tf` and
    `/tf_static` to those who listen."""

    robot: Robot
    positions: dict[str, float] = field(default_factory=dict)
    choice: random.Random = field(default_factory=random.Random)
    clock: Clock = field(default_factory=Clock)
    paused: bool = False
    setting: SliderSetting = SliderSetting()
    bus: Bus = field(default_factory=Bus, init=False)
    loop: bool = field(default=False, init=False)
    note: str = field(default="", init=False)
    errands: list[Callable[[], bool]] = field(default_factory=list, init=False)
    seed: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        self._tree = FrameTree(self.robot)
        self._joint_states = self.bus.advertise("joint_states", JointState, rate=self.setting.rate)
        RobotStatePublisher(self.robot, self.bus, self.clock)
        self._timer = self.clock.every(self.setting.rate, self._say)
        self._joints = {j.name: j for j in self.robot.movable_joints if j.mimic is None}
        kept = {name: self.positions[name] for name in self._joints if name in self.positions}
        start = {**self.setting.zeros, **kept}
        self.positions = {name: _held(j, start.get(name, 0.0)) for name, j in self._joints.items()}
        self.setting.attend(self)

    @property
    def world(self) -> str:
        return self.robot.root

    def run_errands(self) -> bool:
        return sum(errand() for errand in self.errands) > 0

    def moment(self) -> Moment:
        return Moment(0.0, self._all_positions(), self._tree.poses(self.positions))

    def advance(self, seconds: float) -> float:
        self.clock.advance_to(self.clock.nanoseconds + round(seconds * 1e9))
        return 0.0

    def reset(self) -> None:
        self.set_joints("zero")

    def drive(self, linear: float, angular: float) -> None:
        raise KbotError("nothing is simulated here, so the robot cannot drive: kbot sim does it")

    def push(self, link: str, force: tuple[float, float, float], seconds: float) -> None:
        raise KbotError("nothing is simulated here, so nothing can be pushed: kbot sim does it")

    def act(self, action: Action) -> None:
        raise KbotError("nothing is simulated here, so there is no world to change: kbot sim has one")

    @property
    def controls(self) -> Mapping[str, Control]:
        return dict.fromkeys(self._joints, "position")

    @property
    def present(self) -> tuple[World | None, Mapping[str, Robot]]:
        return None, {}

    @property
    def timeline(self) -> Timeline | None:
        return None

    def series(self, fields: Sequence[Field], start: float, end: float) -> None:
        return None

    def seek(self, at: float) -> None:
        raise KbotError("nothing moves here by itself, so there is no time to go to")

    def save(self) -> None:
        return None

    def resume(self, saved: object) -> None:
        raise KbotError("nothing moves here by itself, so there is nothing to go on from")

    def record(self, recording: RunRecording) -> None:
        raise KbotError("nothing is simulated here, so there is nothing to record: kbot sim does it")

    def enter(self, world: str, seed: int) -> tuple[Motion, World]:
        raise KbotError("nothing is simulated here, so there is no world: kbot sim has them")

    def set_joint(self, name: str, position: float) -> None:
        joint = self._joints.get(name)
        if joint is None:
            raise KbotError(f"no joint {name!r} that can be set by hand")
        self.positions[name] = _held(joint, position)

    def set_joints(self, preset: Literal["zero", "centre", "random"]) -> None:
        for name, joint in self._joints.items():
            lower, upper = slider_range(joint)
            match preset:
                case "zero":
                    wanted = self.setting.zeros.get(name, 0.0)
                case "centre":
                    wanted = (lower + upper) / 2
                case "random":
                    wanted = self.choice.uniform(lower, upper)
            self.positions[name] = _held(joint, wanted)

    def replace(self, robot: Robot) -> Sliders:
        self._timer.cancel()
        return Sliders(robot, self.positions, self.choice, self.clock, self.paused, self.setting)

    def _say(self) -> None:
        header = Header(self.clock.stamp)
        if self._joint_states.is_heard:
            positions = self._all_positions()
            self._joint_states.publish(JointState(header, tuple(positions), tuple(positions.values())))

    def _all_positions(self) -> dict[str, float]:
        """Those of mimic joints too."""
        found = dict(self.positions)
        for joint in self.robot.movable_joints:
            scale, offset, at, seen = 1.0, 0.0, joint, {joint.name}
            while at.mimic is not None and (leader := self.robot.joints.get(at.mimic.joint)) is not None:
                if leader.name in seen:
                    break
                seen.add(leader.name)
                offset += scale * at.mimic.offset
                scale *= at.mimic.multiplier
                at = leader
            if joint.mimic is not None:
                found[joint.name] = scale * self.positions.get(at.name, 0.0) + offset
        return found


def _held(joint: Joint, position: float) -> float:
    """The position within the joint's range; a continuous one turns without end."""
    if joint.type is JointType.CONTINUOUS:
        return position
    lower, upper = slider_range(joint)
    return min(max(position, lower), upper)


def flat(transforms: Iterable[Transform]) -> tuple[float, ...]:
    """x, y, z, qx, qy, qz, qw of each, one after the other, to a nanometre."""
    numbers: list[float] = []
    for transform in transforms:
        numbers += transform.translation.tolist()
        numbers += transform.quaternion_xyzw
    return tuple([round(number, 9) for number in numbers])
