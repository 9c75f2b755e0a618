"""What the server and the page say to each other; `web/src/protocol.ts` is generated from here.

Lengths in metres, angles in radians, quaternions x, y, z, w, colours in 0..1. Every message is a
JSON object with a `type`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal


@dataclass(frozen=True, slots=True)
class Range:
    """The finite numbers from `low` to `high` that a page may send."""

    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Length:
    """The longest text, in characters, that a page may send."""

    most: int


ShapeKind = Literal["box", "cylinder", "sphere", "capsule", "ellipsoid", "mesh"]

Name = Annotated[str, Length(256)]
PathName = Annotated[str, Length(4096)]


@dataclass(frozen=True, slots=True)
class Place:
    """Where something was written: 1-based line and column, and how many characters of that line."""

    file: str
    line: int
    column: int
    length: int


@dataclass(frozen=True, slots=True)
class Shape:
    """A primitive or a mesh, in the frame of its link or of the world.

    `size`: box x, y, z; cylinder and capsule radius, length (along z); sphere radius; ellipsoid half
    axes; mesh scale x, y, z. `mesh` is the id to fetch as `/mesh/<id>`, empty where there is none.
    """

    kind: ShapeKind
    size: tuple[float, ...]
    position: tuple[float, ...]
    quaternion: tuple[float, ...]
    rgba: tuple[float, ...]
    mesh: str
    place: Place | None


@dataclass(frozen=True, slots=True)
class InertiaView:
    """Mass in kg, and the solid box of that mass with the same principal moments of inertia."""

    mass: float
    box: tuple[float, ...]
    position: tuple[float, ...]
    quaternion: tuple[float, ...]
    place: Place | None


@dataclass(frozen=True, slots=True)
class LinkView:
    """A link; `parent` and `joint` are empty for the root."""

    name: str
    parent: str
    joint: str
    visuals: tuple[Shape, ...]
    collisions: tuple[Shape, ...]
    inertia: InertiaView | None
    place: Place | None


@dataclass(frozen=True, slots=True)
class JointView:
    """A joint whose position is one number. `lower` and `upper` are the slider's ends."""

    name: str
    kind: Literal["continuous", "revolute", "prismatic"]
    child: str
    lower: float
    upper: float
    mimics: str
    place: Place | None


@dataclass(frozen=True, slots=True)
class BodyView:
    """A thing in the world and where it starts; a `moving` one has its pose in every state."""

    name: str
    moving: bool
    parts: tuple[Shape, ...]
    position: tuple[float, ...]
    quaternion: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Scene:
    """All that is drawn; states refer to it by `revision`, in the order of its links and joints.

    `ground` is the height the grid lies at; `radius` that of a sphere around the robot and `centre`
    its middle in the root frame, at zero.
    """

    revision: int
    robot: str
    root: str
    links: tuple[LinkView, ...]
    joints: tuple[JointView, ...]
    bodies: tuple[BodyView, ...]
    ground: float
    radius: float
    centre: tuple[float, ...]
    type: Literal["scene"] = "scene"


@dataclass(frozen=True, slots=True)
class State:
    """One moment. `poses` holds x, y, z, qx, qy, qz, qw of each link in the world, flat; `bodies`
    those of the moving bodies.

    `command` and `twist` are forward speed and turning speed, asked and made; `odometry` is x, y,
    yaw as the wheels tell it. `rate` is simulated time per wall time.
    """

    revision: int
    time: float
    paused: bool
    speed: float
    rate: float
    positions: tuple[float, ...]
    poses: tuple[float, ...]
    bodies: tuple[float, ...]
    command: tuple[float, ...]
    twist: tuple[float, ...]
    odometry: tuple[float, ...]
    driver: int
    resets: int
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
class About:
    """What this session is; sent first. `cannot_drive` says why, and is empty when it can."""

    version: str
    file: str
    mode: Literal["view", "sim"]
    world: str
    cannot_drive: str
    linear_limit: float
    angular_limit: float
    files: tuple[str, ...]
    worlds: tuple[str, ...]
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
class Scan:
    """What a lidar saw last: `points` x, y, z in the world, flat."""

    sensor: str
    link: str
    time: float
    points: tuple[float, ...]
    type: Literal["scan"] = "scan"


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
class Refused:
    """A message was not obeyed."""

    reason: str
    type: Literal["refused"] = "refused"


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
    """Push a link with a force in N along the world's axes, for a moment of simulated time."""

    link: Name
    x: Annotated[float, Range(-1000, 1000)]
    y: Annotated[float, Range(-1000, 1000)]
    z: Annotated[float, Range(-1000, 1000)]
    seconds: Annotated[float, Range(0.001, 1)]
    type: Literal["push"] = "push"


@dataclass(frozen=True, slots=True)
class SetWorld:
    """Start again in another world: a built-in world's name, with parameters if any."""

    world: Name
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


FromServer = About | Scene | State | Findings | SourceText | Parameters | Scan | Refused
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
    | SetWorld
    | OpenSource
    | SetParameter
    | DropParameters
    | KeepParameters
    | EditSource
    | ApplyFix
    | Undo
)
