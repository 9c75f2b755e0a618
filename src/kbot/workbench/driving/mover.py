"""The interface of what moves the robot in the page: sliders, a simulation or a recording."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, Protocol

from kbot.kinematics.transform import Transform
from kbot.messages import Bus, Clock
from kbot.model import RobotModel
from kbot.workbench.protocol import Action, FallenView, FaultView, Timeline
from kbot.workbench.scene.foreign_frames import Frames
from kbot.workbench.scene.scene import Control
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


class Mover(Protocol):
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
    def present(self) -> tuple[World | None, Mapping[str, RobotModel]]:
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

    def replace(self, robot: RobotModel) -> Mover:
        """The same with a changed robot, standing as this one does. Raises KbotError."""
        ...

    def enter(self, world: str, seed: int) -> tuple[Mover, World]:
        """The same robot at the start of another world. Raises KbotError."""
        ...


def flat(transforms: Iterable[Transform]) -> tuple[float, ...]:
    """x, y, z, qx, qy, qz, qw of each, one after the other, to a nanometre."""
    numbers: list[float] = []
    for transform in transforms:
        numbers += transform.translation.tolist()
        numbers += transform.quaternion_xyzw
    return tuple([round(number, 9) for number in numbers])
