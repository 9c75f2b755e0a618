"""What a page may ask; `workbench.serving.decode` checks it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Literal

from kbot.workbench.protocol.plot import AskSeries, DrawPlot
from kbot.workbench.protocol.time import GoLive, RecordRun, Resume, Seek, SetLoop
from kbot.workbench.protocol.values import Name, PathName, Range, SettingsText


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
class Push:
    """Push a link of the robot, or a body of the world, with a force in N along the world's axes for a while
    of simulated time."""

    link: Name
    x: Annotated[float, Range(-1000, 1000)]
    y: Annotated[float, Range(-1000, 1000)]
    z: Annotated[float, Range(-1000, 1000)]
    seconds: Annotated[float, Range(0.001, 10)]
    type: Literal["push"] = "push"


@dataclass(frozen=True, slots=True)
class Kick:
    """Give the robot a speed at once, m/s along the world's axes."""

    x: Annotated[float, Range(-100, 100)]
    y: Annotated[float, Range(-100, 100)]
    z: Annotated[float, Range(-100, 100)]
    type: Literal["kick"] = "kick"


@dataclass(frozen=True, slots=True)
class Spawn:
    """Put something of `About.things` into the running world, with its foot at a place (m, rad). A box is as
    long, wide and high as asked; everything else has its own size."""

    what: Name
    x: Annotated[float, Range(-1e4, 1e4)]
    y: Annotated[float, Range(-1e4, 1e4)]
    z: Annotated[float, Range(-1e3, 1e3)]
    yaw: Annotated[float, Range(-10, 10)]
    length: Annotated[float, Range(0.01, 10)]
    width: Annotated[float, Range(0.01, 10)]
    height: Annotated[float, Range(0.01, 10)]
    type: Literal["spawn"] = "spawn"


@dataclass(frozen=True, slots=True)
class Delete:
    """Take a robot or a thing out of the running world, by the name of one of its bodies."""

    name: Name
    type: Literal["delete"] = "delete"


@dataclass(frozen=True, slots=True)
class MoveModel:
    """Put a robot (on the ground) or a thing somewhere else, standing still: metres and radians."""

    name: Name
    x: Annotated[float, Range(-1e4, 1e4)]
    y: Annotated[float, Range(-1e4, 1e4)]
    z: Annotated[float, Range(-1e3, 1e3)]
    yaw: Annotated[float, Range(-10, 10)]
    type: Literal["move_model"] = "move_model"


@dataclass(frozen=True, slots=True)
class Disturb:
    """Let something go wrong for some seconds from now on: a link slips with a coefficient of friction, or
    carries a payload in kg; a joint is blocked; a topic is silent."""

    fault: Literal["slip", "payload", "blocked", "silent"]
    target: Name
    value: Annotated[float, Range(-1e3, 1e3)]
    seconds: Annotated[float, Range(0.01, 3600)]
    type: Literal["disturb"] = "disturb"


@dataclass(frozen=True, slots=True)
class EndFault:
    """Let a fault of `State.faults` be over, and not come again."""

    number: Annotated[float, Range(0, 1e9)]
    type: Literal["end_fault"] = "end_fault"


@dataclass(frozen=True, slots=True)
class ResetPart:
    """Everything back to its start while time goes on, or time to 0 while everything goes on."""

    what: Literal["world", "time"]
    type: Literal["reset_part"] = "reset_part"


@dataclass(frozen=True, slots=True)
class JointSpeed:
    """Let a joint that has a controller go at a speed, rad/s or m/s."""

    name: Name
    velocity: Annotated[float, Range(-1e3, 1e3)]
    type: Literal["joint_speed"] = "joint_speed"


@dataclass(frozen=True, slots=True)
class SetWorld:
    """Start again in another world: a built-in world's name, with parameters if any. `seed` is that of
    whatever is random in a run, as the noise of sensors is."""

    world: Name
    seed: Annotated[float, Range(0, 2**53)]
    type: Literal["set_world"] = "set_world"


@dataclass(frozen=True, slots=True)
class OpenSource:
    file: PathName
    type: Literal["open_source"] = "open_source"


@dataclass(frozen=True, slots=True)
class SetParameter:
    """Show the robot with another value, the file left as it is."""

    kind: Literal["arg", "property"]
    name: Name
    value: Annotated[float, Range(-1e9, 1e9)]
    type: Literal["set_parameter"] = "set_parameter"


@dataclass(frozen=True, slots=True)
class DropParameters:
    """Show what the file says again."""

    type: Literal["drop_parameters"] = "drop_parameters"


@dataclass(frozen=True, slots=True)
class KeepParameters:
    """Write the values on show into the file."""

    type: Literal["keep_parameters"] = "keep_parameters"


@dataclass(frozen=True, slots=True)
class EditSource:
    """Replace `was`, which stands at a line and column (1-based) of one of the files, by `text`."""

    file: PathName
    line: Annotated[float, Range(1, 1e9)]
    column: Annotated[float, Range(1, 1e9)]
    was: Name
    text: Name
    type: Literal["edit_source"] = "edit_source"


@dataclass(frozen=True, slots=True)
class ApplyFix:
    """Carry out the fix of a finding of the list with this serial."""

    serial: Annotated[float, Range(0, 1e15)]
    index: Annotated[float, Range(0, 1e6)]
    type: Literal["apply_fix"] = "apply_fix"


@dataclass(frozen=True, slots=True)
class Undo:
    """Take back the last change that the page made to a file."""

    type: Literal["undo"] = "undo"


@dataclass(frozen=True, slots=True)
class Subscribe:
    """Hear a topic: the newest message whenever there is one and this page keeps up."""

    topic: Name
    type: Literal["subscribe"] = "subscribe"


@dataclass(frozen=True, slots=True)
class Unsubscribe:
    topic: Name
    type: Literal["unsubscribe"] = "unsubscribe"


@dataclass(frozen=True, slots=True)
class Publish:
    """Say something on a topic that is meant for it: a goal, a pose, a point, a command."""

    topic: Name
    kind: Name
    message: dict[str, Any]
    type: Literal["publish"] = "publish"


@dataclass(frozen=True, slots=True)
class SaveDisplays:
    """Write the displays' settings: to the file they came from, or as a text of KBot's or rviz's kind for the
    browser to keep."""

    kind: Literal["file", "kbot", "rviz1", "rviz2"]
    setup: dict[str, Any]
    type: Literal["save_displays"] = "save_displays"


@dataclass(frozen=True, slots=True)
class OpenDisplays:
    """Show the settings in a file that was chosen in the browser."""

    name: Name
    text: SettingsText
    type: Literal["open_displays"] = "open_displays"


Action = Spawn | Delete | MoveModel | Kick | Disturb | EndFault | ResetPart | JointSpeed
"""What changes a running world."""

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
    | AskSeries
    | DrawPlot
)
