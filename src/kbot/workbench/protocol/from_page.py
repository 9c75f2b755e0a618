"""What a page may ask; `workbench.protocol.decode` checks it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from kbot.workbench.protocol.displays import OpenDisplays, SaveDisplays
from kbot.workbench.protocol.plot import AskSeries, DrawPlot
from kbot.workbench.protocol.source import (
    ApplyFix,
    DropParameters,
    EditSource,
    KeepParameters,
    OpenSource,
    Redo,
    SetParameter,
    Undo,
)
from kbot.workbench.protocol.time import (
    AskTrail,
    GoLive,
    Mark,
    NoteMark,
    RecordRun,
    RemoveMark,
    Resume,
    Seek,
    SetLoop,
)
from kbot.workbench.protocol.topics import Publish, Subscribe, Unsubscribe
from kbot.workbench.protocol.values import Name, Range
from kbot.workbench.protocol.world import (
    Delete,
    Disturb,
    EndFault,
    JointSpeed,
    Kick,
    MoveModel,
    Push,
    ResetPart,
    SetWorld,
    Spawn,
)


@dataclass(frozen=True, slots=True)
class Drive:
    """Forward speed in m/s and turning speed in rad/s, held until changed or the page falls silent."""

    linear: Annotated[float, Range(-10, 10)]
    angular: Annotated[float, Range(-50, 50)]
    type: Literal["drive"] = "drive"


@dataclass(frozen=True, slots=True)
class Stop:
    """Stand still, whoever is driving."""

    type: Literal["stop"] = "stop"


@dataclass(frozen=True, slots=True)
class SetJoint:
    name: Name
    position: Annotated[float, Range(-1e6, 1e6)]
    type: Literal["set_joint"] = "set_joint"


@dataclass(frozen=True, slots=True)
class SetJoints:
    """All joints at once: to zero or the limit nearest to it, to the middle of their range, or anywhere."""

    preset: Literal["zero", "centre", "random"]
    type: Literal["set_joints"] = "set_joints"


@dataclass(frozen=True, slots=True)
class Pause:
    paused: bool
    type: Literal["pause"] = "pause"


@dataclass(frozen=True, slots=True)
class Advance:
    """Simulate a little while paused."""

    seconds: Annotated[float, Range(0.001, 1)]
    type: Literal["advance"] = "advance"


@dataclass(frozen=True, slots=True)
class Reset:
    type: Literal["reset"] = "reset"


@dataclass(frozen=True, slots=True)
class SetSpeed:
    """Simulated seconds per second of wall time."""

    factor: Annotated[float, Range(0.1, 10)]
    type: Literal["set_speed"] = "set_speed"


@dataclass(frozen=True, slots=True)
class Heard:
    """All up to a `Beat` is taken in."""

    type: Literal["heard"] = "heard"


FromPage = (
    Drive
    | Stop
    | SetJoint
    | SetJoints
    | Pause
    | Advance
    | Reset
    | SetSpeed
    | Push
    | Spawn
    | Delete
    | MoveModel
    | Kick
    | Disturb
    | EndFault
    | ResetPart
    | JointSpeed
    | SetWorld
    | OpenSource
    | SetParameter
    | DropParameters
    | KeepParameters
    | EditSource
    | ApplyFix
    | Undo
    | Redo
    | Subscribe
    | Unsubscribe
    | Publish
    | SaveDisplays
    | OpenDisplays
    | Seek
    | GoLive
    | Resume
    | SetLoop
    | RecordRun
    | Mark
    | NoteMark
    | RemoveMark
    | AskTrail
    | AskSeries
    | DrawPlot
    | Heard
)
