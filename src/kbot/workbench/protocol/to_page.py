"""What the server tells the pages."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from kbot.workbench.protocol.plot import PlotDrawn, Series
from kbot.workbench.protocol.scene import Scene, Things
from kbot.workbench.protocol.time import Timeline
from kbot.workbench.protocol.values import Place


@dataclass(frozen=True, slots=True)
class FaultView:
    """Something that goes wrong, in words, from `start` to `stop` s of simulated time; None is for good."""

    number: int
    words: str
    start: float
    stop: float | None


@dataclass(frozen=True, slots=True)
class State:
    """One moment. `poses` holds x, y, z, qx, qy, qz, qw of each link in the world, flat; `bodies`
    those of the moving bodies. `frames` names the frames that are no links, and their parents, as tf tells
    of them; `frame_poses` are theirs in the world.

    `command` and `twist` are forward speed and turning speed, asked and made; `odometry` is x, y,
    yaw as the wheels tell it. `rate` is simulated time per wall time. `at` is where it is in seconds along
    the timeline.
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
    type: Literal["state"] = "state"


@dataclass(frozen=True, slots=True)
class Step:
    """One macro call or include that brought a finding's element."""

    kind: Literal["macro", "include"]
    name: str
    place: Place


@dataclass(frozen=True, slots=True)
class Note:
    """Another place a finding speaks of."""

    message: str
    place: Place


@dataclass(frozen=True, slots=True)
class Finding:
    """One diagnostic; `link` is the link it lies in and `fix` what would mend it, or they are empty."""

    code: str
    severity: Literal["error", "warning", "info"]
    message: str
    hint: str
    place: Place | None
    stack: tuple[Step, ...]
    related: tuple[Note, ...]
    link: str
    fix: str


@dataclass(frozen=True, slots=True)
class Findings:
    """All findings; `stale` when the scene shows an older, still good description.

    `serial` counts readings, so that a fix is asked for from the list that is on show.
    """

    serial: int
    stale: bool
    findings: tuple[Finding, ...]
    type: Literal["findings"] = "findings"


@dataclass(frozen=True, slots=True)
class WorldParameter:
    name: str
    value: float
    is_whole: bool


@dataclass(frozen=True, slots=True)
class WorldChoice:
    """A built-in world and what its parameters are when not given."""

    name: str
    parameters: tuple[WorldParameter, ...]


@dataclass(frozen=True, slots=True)
class About:
    """What this session is; sent first. `cannot_drive` says why, and is empty when it can. `things` are what
    may be put into the world, and `seed` is that of whatever is random."""

    version: str
    file: str
    mode: Literal["view", "sim", "play"]
    world: str
    cannot_drive: str
    linear_limit: float
    angular_limit: float
    files: tuple[str, ...]
    worlds: tuple[WorldChoice, ...]
    things: tuple[str, ...]
    seed: int
    client: int
    type: Literal["about"] = "about"


@dataclass(frozen=True, slots=True)
class SourceText:
    """The text of one of the description's files; `owners` says which links each line belongs to."""

    file: str
    text: str
    owners: tuple[tuple[str, ...], ...]
    type: Literal["source"] = "source"


@dataclass(frozen=True, slots=True)
class TopicView:
    """A topic by its ROS type (`sensor_msgs/msg/LaserScan`). `rate` is messages a second of simulated time,
    None where nobody hears them; an input is what is meant to come from outside."""

    name: str
    kind: str
    rate: float | None
    is_input: bool


@dataclass(frozen=True, slots=True)
class Topics:
    """Every topic that a page may hear."""

    topics: tuple[TopicView, ...]
    type: Literal["topics"] = "topics"


@dataclass(frozen=True, slots=True)
class TopicMessage:
    """One message of a topic that was asked for, its fields by name. `time` is when it was published.

    Large arrays are no JSON: such a message comes as a binary frame, as `workbench.payload` says.
    """

    topic: str
    kind: str
    time: float
    message: dict[str, Any]
    type: Literal["message"] = "message"


@dataclass(frozen=True, slots=True)
class Displays:
    """The displays' settings out of a file, as `workbench.displays.settings` has them. `notes` say what of it
    is not shown, and `file` is where the page may save, empty where it may not."""

    name: str
    file: str
    setup: dict[str, Any]
    notes: tuple[str, ...]
    type: Literal["displays"] = "displays"


@dataclass(frozen=True, slots=True)
class DisplaysText:
    """Settings as the text of a file of that name, for the browser to keep."""

    name: str
    text: str
    notes: tuple[str, ...]
    type: Literal["displays_text"] = "displays_text"


@dataclass(frozen=True, slots=True)
class DisplaysSaved:
    """The settings were written to their file."""

    file: str
    notes: tuple[str, ...]
    type: Literal["displays_saved"] = "displays_saved"


@dataclass(frozen=True, slots=True)
class Parameter:
    """A number that the description is made with: a xacro argument or property.

    `written` is what the file says and `value` what the picture shows; `place` is that of the number.
    """

    kind: Literal["arg", "property"]
    name: str
    written: float
    value: float
    place: Place


@dataclass(frozen=True, slots=True)
class Parameters:
    """All of them, in the order they are written. `undo` says what would be undone, if anything."""

    parameters: tuple[Parameter, ...]
    undo: str
    type: Literal["parameters"] = "parameters"


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
    | Series
    | PlotDrawn
    | Told
    | Refused
)
