"""What may be done to a running world, and what of it can be chosen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from kbot.workbench.protocol.values import Name, PathName, Range


@dataclass(frozen=True, slots=True)
class WorldParameter:
    name: str
    value: float
    is_whole: bool


@dataclass(frozen=True, slots=True)
class WorldChoice:
    """A built-in world, or the file of one, and what its parameters are: those of the present world, or what
    they are when not given."""

    name: str
    parameters: tuple[WorldParameter, ...]


@dataclass(frozen=True, slots=True)
class SetWorld:
    """Start again in another world: a built-in world's name, with parameters if any, or the file of the world
    that the run was started in. `seed` is that of whatever is random in a run, as the noise of sensors is."""

    world: PathName
    seed: Annotated[float, Range(0, 2**53)]
    type: Literal["set_world"] = "set_world"


@dataclass(frozen=True, slots=True)
class ResetPart:
    """Everything back to its start while time goes on, or time to 0 while everything goes on."""

    what: Literal["world", "time"]
    type: Literal["reset_part"] = "reset_part"


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
class FaultView:
    """Something that goes wrong, in words, from `start` to `stop` s of simulated time; None is for good."""

    number: int
    words: str
    start: float
    stop: float | None


@dataclass(frozen=True, slots=True)
class FallenView:
    """A robot or a thing that fell out of the world, at `time` s of simulated time, and is at `z` m now; the
    robot on show has no name."""

    name: str
    time: float
    z: float


@dataclass(frozen=True, slots=True)
class JointSpeed:
    """Let a joint that has a controller go at a speed, rad/s or m/s."""

    name: Name
    velocity: Annotated[float, Range(-1e3, 1e3)]
    type: Literal["joint_speed"] = "joint_speed"


Action = Spawn | Delete | MoveModel | Kick | Disturb | EndFault | ResetPart | JointSpeed
"""What changes a running world."""
