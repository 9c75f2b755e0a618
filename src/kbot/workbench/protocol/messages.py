"""The messages between server and page, a dataclass for each; the unions `FromPage` and `FromServer`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Literal


@dataclass(frozen=True, slots=True)
class Bounds:
    """The finite numbers from `low` to `high` that a page may send."""

    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Length:
    """The longest text, in characters, or list that a page may send."""

    most: int


ShapeKind = Literal["box", "cylinder", "sphere", "capsule", "ellipsoid", "mesh"]

Name = Annotated[str, Length(256)]
SettingsText = Annotated[str, Length(60_000)]
PathName = Annotated[str, Length(4096)]
Fields = Annotated[tuple[Name, ...], Length(12)]
"""What is plotted together."""


# --- Worlds, objects and faults ---


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
    seed: Annotated[float, Bounds(0, 2**53)]
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
    x: Annotated[float, Bounds(-1e4, 1e4)]
    y: Annotated[float, Bounds(-1e4, 1e4)]
    z: Annotated[float, Bounds(-1e3, 1e3)]
    yaw: Annotated[float, Bounds(-10, 10)]
    length: Annotated[float, Bounds(0.01, 10)]
    width: Annotated[float, Bounds(0.01, 10)]
    height: Annotated[float, Bounds(0.01, 10)]
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
    x: Annotated[float, Bounds(-1e4, 1e4)]
    y: Annotated[float, Bounds(-1e4, 1e4)]
    z: Annotated[float, Bounds(-1e3, 1e3)]
    yaw: Annotated[float, Bounds(-10, 10)]
    type: Literal["move_model"] = "move_model"


@dataclass(frozen=True, slots=True)
class Push:
    """Push a link of the robot, or a body of the world, with a force in N along the world's axes for a while
    of simulated time."""

    link: Name
    x: Annotated[float, Bounds(-1000, 1000)]
    y: Annotated[float, Bounds(-1000, 1000)]
    z: Annotated[float, Bounds(-1000, 1000)]
    seconds: Annotated[float, Bounds(0.001, 10)]
    type: Literal["push"] = "push"


@dataclass(frozen=True, slots=True)
class Kick:
    """Give the robot a speed at once, m/s along the world's axes."""

    x: Annotated[float, Bounds(-100, 100)]
    y: Annotated[float, Bounds(-100, 100)]
    z: Annotated[float, Bounds(-100, 100)]
    type: Literal["kick"] = "kick"


@dataclass(frozen=True, slots=True)
class Disturb:
    """Let something go wrong for some seconds from now on: a link slips with a coefficient of friction, or
    carries a payload in kg; a joint is blocked; a topic is silent."""

    fault: Literal["slip", "payload", "blocked", "silent"]
    target: Name
    value: Annotated[float, Bounds(-1e3, 1e3)]
    seconds: Annotated[float, Bounds(0.01, 3600)]
    type: Literal["disturb"] = "disturb"


@dataclass(frozen=True, slots=True)
class EndFault:
    """Let a fault of `State.faults` be over, and not come again."""

    number: Annotated[float, Bounds(0, 1e9)]
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
    velocity: Annotated[float, Bounds(-1e3, 1e3)]
    type: Literal["joint_speed"] = "joint_speed"


Action = Spawn | Delete | MoveModel | Kick | Disturb | EndFault | ResetPart | JointSpeed
"""What changes a running world."""


# --- Topics ---


@dataclass(frozen=True, slots=True)
class TopicView:
    """A topic by its ROS type (`sensor_msgs/msg/LaserScan`). `rate` is messages a second of simulated time,
    counted where a page hears them, otherwise by the word of who says them, or None; in a recording the mean
    of all of it. An input is what is meant to come from outside."""

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
    """One message of a topic that was asked for, its fields by name. `time` is when it was published; with
    `is_latched` that was before it was asked for.

    Large arrays are no JSON: such a message comes as a binary frame, as `workbench.topics.relay` says.
    """

    topic: str
    kind: str
    time: float
    is_latched: bool
    message: dict[str, Any]  # Any: JSON
    type: Literal["message"] = "message"


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


# --- Time and recordings ---


@dataclass(frozen=True, slots=True)
class Seek:
    """Show the moment `at` seconds along the timeline: to this page alone, or where a recording is played to
    all."""

    at: Annotated[float, Bounds(0, 1e12)]
    type: Literal["seek"] = "seek"


@dataclass(frozen=True, slots=True)
class GoLive:
    """Show what is, and no longer what was."""

    type: Literal["go_live"] = "go_live"


@dataclass(frozen=True, slots=True)
class Resume:
    """Let the simulation go on from the moment that this page is shown, or the nearest one that was saved."""

    type: Literal["resume"] = "resume"


@dataclass(frozen=True, slots=True)
class SetLoop:
    """Whether a recording that came to its end begins again."""

    loop: bool
    type: Literal["set_loop"] = "set_loop"


@dataclass(frozen=True, slots=True)
class AskTrail:
    """Say which way the robot took since the simulation was reset so many times."""

    resets: Annotated[float, Bounds(0, 1e12)]
    type: Literal["ask_trail"] = "ask_trail"


@dataclass(frozen=True, slots=True)
class Trail:
    """The way since so many resets, as far as it is kept: where the robot was, x and y in m of the world, at
    moments in s along the timeline. To the points of these numbers, from 0, it did not drive: it was put
    there."""

    resets: int
    at: tuple[float, ...]
    x: tuple[float, ...]
    y: tuple[float, ...]
    jumps: tuple[int, ...]
    type: Literal["trail"] = "trail"


@dataclass(frozen=True, slots=True)
class Mark:
    """Bookmark the moment `at` seconds along the timeline, which is `time` by the simulation's clock."""

    at: Annotated[float, Bounds(0, 1e12)]
    time: Annotated[float, Bounds(-1e12, 1e12)]
    type: Literal["mark"] = "mark"


@dataclass(frozen=True, slots=True)
class NoteMark:
    """Write on a bookmark."""

    number: Annotated[float, Bounds(0, 1e15)]
    note: Name
    type: Literal["note_mark"] = "note_mark"


@dataclass(frozen=True, slots=True)
class RemoveMark:
    number: Annotated[float, Bounds(0, 1e15)]
    type: Literal["remove_mark"] = "remove_mark"


@dataclass(frozen=True, slots=True)
class Bookmark:
    """A moment that was marked, in seconds along the timeline and by the simulation's clock, and what was
    noted of it."""

    number: int
    at: float
    time: float
    note: str


@dataclass(frozen=True, slots=True)
class Bookmarks:
    """All of them, in the order of their moments."""

    all: tuple[Bookmark, ...]
    type: Literal["bookmarks"] = "bookmarks"


@dataclass(frozen=True, slots=True)
class RecordRun:
    """Begin or end a recording of the simulation, in a file that the server names."""

    on: bool
    type: Literal["record"] = "record"


@dataclass(frozen=True, slots=True)
class RecordingView:
    """A recording under way: its file, its bytes on disk so far, and the seconds of simulated time in it."""

    file: str
    bytes: int
    seconds: float


@dataclass(frozen=True, slots=True)
class Recorded:
    """A recording has ended: its file, and the address that gives it, empty where it is too large."""

    file: str
    address: str
    type: Literal["recorded"] = "recorded"


@dataclass(frozen=True, slots=True)
class Timeline:
    """What there is to go back to, from `start` to `end` in seconds along a timeline that only grows, and
    what this page is shown of it: the moment `at`, or what is (`live`). With `played` it is that of a
    recorded file, whole. `paused` and `speed` are of now. Topics that are `silent` had said nothing until
    that moment. The page `asked` for a moment last, which may be before or after all there is."""

    start: float
    end: float
    at: float
    live: bool
    played: bool
    loop: bool
    paused: bool
    speed: float
    silent: tuple[str, ...]
    recording: RecordingView | None
    asked: float | None = None
    type: Literal["timeline"] = "timeline"


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


# --- Findings and source text ---


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
class OpenSource:
    file: PathName
    type: Literal["open_source"] = "open_source"


@dataclass(frozen=True, slots=True)
class Hint:
    """What an attribute that is written as an expression came to: a value for each macro call that made
    another one; `more` where there are more than are told."""

    place: Place
    values: tuple[str, ...]
    more: bool


@dataclass(frozen=True, slots=True)
class SourceText:
    """The text of one of the description's files; `owners` says which links each line belongs to, `hints`
    what the expressions in it came to."""

    file: str
    text: str
    owners: tuple[tuple[str, ...], ...]
    hints: tuple[Hint, ...]
    type: Literal["source"] = "source"


@dataclass(frozen=True, slots=True)
class Parameter:
    """A number that the description is made with: a xacro argument or property.

    `written` is what the file says and `value` what the picture shows; with `is_truth` it is true or false,
    as 1 or 0. `place` is that of the number.
    """

    kind: Literal["arg", "property"]
    name: str
    written: float
    value: float
    is_truth: bool
    place: Place


@dataclass(frozen=True, slots=True)
class Parameters:
    """All of them, in the order they are written. `undo` says what would be undone, if anything, and `redo`
    what would be done again."""

    parameters: tuple[Parameter, ...]
    undo: str
    redo: str
    type: Literal["parameters"] = "parameters"


@dataclass(frozen=True, slots=True)
class SetParameter:
    """Show the robot with another value, the file left as it is."""

    kind: Literal["arg", "property"]
    name: Name
    value: Annotated[float, Bounds(-1e9, 1e9)]
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
    line: Annotated[float, Bounds(1, 1e9)]
    column: Annotated[float, Bounds(1, 1e9)]
    was: Name
    text: Name
    type: Literal["edit_source"] = "edit_source"


@dataclass(frozen=True, slots=True)
class ApplyFix:
    """Carry out the fix of a finding of the list with this serial."""

    serial: Annotated[float, Bounds(0, 1e15)]
    index: Annotated[float, Bounds(0, 1e6)]
    type: Literal["apply_fix"] = "apply_fix"


@dataclass(frozen=True, slots=True)
class Undo:
    """Take back the last change that the page made to a file."""

    type: Literal["undo"] = "undo"


@dataclass(frozen=True, slots=True)
class Redo:
    """Do again what was taken back last."""

    type: Literal["redo"] = "redo"


# --- The scene ---


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
    """A joint whose position is one number, about or along `axis` in the frame of its child. `lower` and
    `upper` are the slider's ends. `control` is what may be told to it here, `speed` the most it goes at in
    rad/s or m/s."""

    name: str
    kind: Literal["continuous", "revolute", "prismatic"]
    child: str
    axis: tuple[float, ...]
    lower: float
    upper: float
    mimics: str
    control: Literal["none", "position", "velocity"]
    speed: float
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

    `world` is the frame that states have their poses in, `ground` the height the floor lies at; `radius` is
    that of a sphere around the robot and `centre` its middle in the root frame, at zero.
    """

    revision: int
    robot: str
    root: str
    world: str
    links: tuple[LinkView, ...]
    joints: tuple[JointView, ...]
    bodies: tuple[BodyView, ...]
    ground: float
    radius: float
    centre: tuple[float, ...]
    type: Literal["scene"] = "scene"


@dataclass(frozen=True, slots=True)
class Things:
    """The world's bodies are others, and all else of the scene is as it was."""

    revision: int
    bodies: tuple[BodyView, ...]
    type: Literal["things"] = "things"


# --- Plots ---


@dataclass(frozen=True, slots=True)
class AskSeries:
    """Say how numbers went from `start` to `end` seconds along the timeline; `number` comes back with the
    answer. A field is `/topic path.to.it`, or `state path.to.it` of the State, whose positions go by
    joint."""

    number: Annotated[float, Bounds(0, 1e15)]
    fields: Fields
    start: Annotated[float, Bounds(0, 1e12)]
    end: Annotated[float, Bounds(0, 1e12)]
    type: Literal["ask_series"] = "ask_series"


@dataclass(frozen=True, slots=True)
class DrawPlot:
    """Draw the same as SVG, of so many pixels; `labels` are the names of the fields."""

    fields: Fields
    labels: Fields
    start: Annotated[float, Bounds(0, 1e12)]
    end: Annotated[float, Bounds(0, 1e12)]
    theme: Literal["dark", "light"]
    width: Annotated[float, Bounds(100, 8192)]
    height: Annotated[float, Bounds(100, 8192)]
    type: Literal["draw_plot"] = "draw_plot"


@dataclass(frozen=True, slots=True)
class Series:
    """What was at moments `at` along the timeline, which were `time` by the simulation's clock: a list of
    values for each field, null where there was none yet. Of more moments than a picture has columns every
    second, third and so on is given."""

    number: float
    start: float
    end: float
    is_thinned: bool
    at: tuple[float, ...]
    time: tuple[float, ...]
    values: tuple[tuple[float | None, ...], ...]
    type: Literal["series"] = "series"


@dataclass(frozen=True, slots=True)
class PlotDrawn:
    """A plot as SVG, for the browser to keep."""

    svg: str
    type: Literal["plot_drawn"] = "plot_drawn"


# --- Displays ---


@dataclass(frozen=True, slots=True)
class Displays:
    """The displays' settings from a file, as `workbench.displays.display_settings` has them. `notes` report
    what is not shown, and `file` is where the page may save, empty where it may not."""

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


# --- The state of the run ---


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


# --- Messages by direction: from the server, and at the end from the page ---

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


# --- Driving ---


@dataclass(frozen=True, slots=True)
class Drive:
    """Forward speed in m/s and turning speed in rad/s, held until changed or the page falls silent."""

    linear: Annotated[float, Bounds(-10, 10)]
    angular: Annotated[float, Bounds(-50, 50)]
    type: Literal["drive"] = "drive"


@dataclass(frozen=True, slots=True)
class Stop:
    """Stand still, whoever is driving."""

    type: Literal["stop"] = "stop"


@dataclass(frozen=True, slots=True)
class SetJoint:
    name: Name
    position: Annotated[float, Bounds(-1e6, 1e6)]
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

    seconds: Annotated[float, Bounds(0.001, 1)]
    type: Literal["advance"] = "advance"


@dataclass(frozen=True, slots=True)
class Reset:
    type: Literal["reset"] = "reset"


@dataclass(frozen=True, slots=True)
class SetSpeed:
    """Simulated seconds per second of wall time."""

    factor: Annotated[float, Bounds(0.1, 10)]
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
