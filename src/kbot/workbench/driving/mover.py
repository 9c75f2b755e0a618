"""The interface of what moves the robot in the page: sliders, a simulation or a recording."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, Protocol

from kbot.kinematics.transform import Transform
from kbot.messages import Bus, Clock
from kbot.model import RobotModel
from kbot.text import Diagnostic
from kbot.tf.foreign_frames import Frames
from kbot.workbench.protocol import Action, FallenView, FaultView, Timeline
from kbot.workbench.scene.scene import Control
from kbot.workbench.timeline.recording import RunRecording
from kbot.workbench.timeline.series import Field, Making
from kbot.world import World


@dataclass(frozen=True, slots=True)
class Moment:
    """The state at one time: poses in the world, and speeds as forward m/s and turning rad/s."""

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
    """How often the robot was moved to another place without driving there."""


class Mover(Protocol):
    """A way to move the robot."""

    @property
    def world(self) -> str:
        """The frame of the poses."""
        ...

    @property
    def bus(self) -> Bus: ...

    @property
    def clock(self) -> Clock: ...

    paused: bool
    """Whether the simulation or playback is paused."""

    note: str
    """A notice for the user about how it replaced another mover, or empty."""

    @property
    def seed(self) -> int:
        """The seed of everything random."""
        ...

    def moment(self) -> Moment: ...

    @property
    def findings(self) -> tuple[Diagnostic, ...]:
        """How the run differs from its commands and odometry. Empty if nothing is simulated."""
        ...

    def run_errands(self) -> bool:
        """Run the tasks that other threads requested. Returns whether anything may have changed."""
        ...

    def advance(self, seconds: float) -> float:
        """Advance time. Returns the simulated seconds that passed, which are fewer on a slow machine."""
        ...

    def reset(self) -> None: ...

    def drive(self, linear: float, angular: float) -> None:
        """Raises KbotError if the robot cannot drive."""
        ...

    def push(self, link: str, force: tuple[float, float, float], seconds: float) -> None:
        """Apply a force in N along the world axes. Raises KbotError if nothing is simulated."""
        ...

    def set_joint(self, name: str, position: float) -> None:
        """Raises KbotError if there is no such joint, or if joints cannot be set by hand."""
        ...

    def set_joints(self, preset: Literal["zero", "centre", "random"]) -> None: ...

    def act(self, action: Action) -> None:
        """Change the running world. Raises KbotError if the action is not possible."""
        ...

    @property
    def controls(self) -> Mapping[str, Control]:
        """The command that each joint accepts. Joints without one are missing."""
        ...

    @property
    def present(self) -> tuple[World | None, Mapping[str, RobotModel]]:
        """The current world, and the robots besides the one on display."""
        ...

    loop: bool
    """Whether playback restarts at the end."""

    @property
    def timeline(self) -> Timeline | None:
        """The position in the recording that is played back, or None."""
        ...

    def series(self, fields: Sequence[Field], start: float, end: float) -> Making | None:
        """Values from `start` to `end` seconds of the recording that is played back, or None."""
        ...

    def seek(self, at: float) -> None:
        """Go to a time in s from the recording's start. Raises KbotError if no recording is played back."""
        ...

    def renewed(self, robot: RobotModel) -> Mover:
        """Return a robot in the same world, as a new run from the start. Raises KbotError if nothing is
        simulated."""
        ...

    def record(self, recording: RunRecording) -> None:
        """Start recording. Raises KbotError if nothing is simulated, or as `RunRecording.begin`."""
        ...

    def save(self) -> tuple[object, int] | None:
        """Return the complete state and its size in bytes, or None if nothing is simulated."""
        ...

    def resume(self, saved: object) -> None:
        """Continue from a state that `save` returned, at rest. Raises KbotError if it is of another
        simulation."""
        ...

    def replace(self, robot: RobotModel) -> Mover:
        """Return the mover of a changed robot at the same pose. Raises KbotError."""
        ...

    def enter(self, world: str, seed: int) -> tuple[Mover, World]:
        """Return the mover of the same robot at the start of another world. Raises KbotError."""
        ...


def flat(transforms: Iterable[Transform]) -> tuple[float, ...]:
    """Return x, y, z, qx, qy, qz, qw of each transform in one flat tuple, rounded to a nanometre."""
    numbers: list[float] = []
    for transform in transforms:
        numbers += transform.translation.tolist()
        numbers += transform.quaternion_xyzw
    return tuple([round(number, 9) for number in numbers])
