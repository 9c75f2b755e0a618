"""What the server tells the pages."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from kbot.workbench.protocol.displays import Displays, DisplaysSaved, DisplaysText
from kbot.workbench.protocol.plot import PlotDrawn, Series
from kbot.workbench.protocol.scene import Scene, Things
from kbot.workbench.protocol.source import Findings, Parameters, SourceText
from kbot.workbench.protocol.time import Bookmarks, Recorded, Timeline, Trail
from kbot.workbench.protocol.topics import TopicMessage, Topics
from kbot.workbench.protocol.world import FallenView, FaultView, WorldChoice


@dataclass(frozen=True, slots=True)
class State:
    """One moment. `poses` holds x, y, z, qx, qy, qz, qw of each link in the world, flat; `bodies`
    those of the moving bodies. `frames` names the frames that are no links, and their parents, as tf tells
    of them; `frame_poses` are theirs in the world.

    `command` and `twist` are forward speed and turning speed, asked and made; `odometry` is x, y,
    yaw as the wheels tell it. `rate` is simulated time per wall time. `at` is where it is in seconds along
    the timeline. `jumps` counts how often the robot was put elsewhere, which is no part of its way.
    """

    revision: int
    time: float
    paused: bool
    speed: float
    rate: float
    positions: tuple[float, ...]
    poses: tuple[float, ...]
    bodies: tuple[float, ...]
    frames: tuple[tuple[str, str], ...]
    frame_poses: tuple[float, ...]
    command: tuple[float, ...]
    twist: tuple[float, ...]
    odometry: tuple[float, ...]
    driver: int
    resets: int
    at: float = 0.0
    faults: tuple[FaultView, ...] = ()
    fallen: tuple[FallenView, ...] = ()
    jumps: int = 0
    type: Literal["state"] = "state"


@dataclass(frozen=True, slots=True)
class About:
    """What this session is; sent first. `played` is the recording on show, empty where none is.
    `cannot_drive` says why, and is empty when it can. `things` are what may be put into the world, `seed`
    is that of whatever is random, and `folder` is where recordings go."""

    file: str
    played: str
    mode: Literal["view", "sim", "play"]
    world: str
    cannot_drive: str
    linear_limit: float
    angular_limit: float
    files: tuple[str, ...]
    worlds: tuple[WorldChoice, ...]
    things: tuple[str, ...]
    seed: int
    folder: str
    client: int
    type: Literal["about"] = "about"


@dataclass(frozen=True, slots=True)
class Told:
    """What was done, in words."""

    text: str
    type: Literal["told"] = "told"


@dataclass(frozen=True, slots=True)
class Refused:
    """A message was not obeyed."""

    reason: str
    type: Literal["refused"] = "refused"


@dataclass(frozen=True, slots=True)
class Beat:
    """Answered by `Heard` once all that was said before it is taken in: a page that lags is told less."""

    type: Literal["beat"] = "beat"


FromServer = (
    About
    | Scene
    | Things
    | State
    | Findings
    | SourceText
    | Parameters
    | Topics
    | TopicMessage
    | Displays
    | DisplaysText
    | DisplaysSaved
    | Timeline
    | Bookmarks
    | Recorded
    | Trail
    | Series
    | PlotDrawn
    | Told
    | Refused
    | Beat
)
