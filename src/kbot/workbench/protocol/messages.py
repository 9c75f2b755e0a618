"""The messages between server and page: a dataclass for each, and the unions `FromPage` and `FromServer`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Literal


@dataclass(frozen=True, slots=True)
class Bounds:
    """A page may send finite numbers from `low` to `high`."""

    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Length:
    """The longest string (in characters) or list that a page may send."""

    most: int


@dataclass(frozen=True, slots=True)
class Bytes:
    """The longest string that a page may send, in bytes of UTF-8."""

    most: int


ProgramPhase = Literal["waiting", "running", "finished", "failed", "stopped"]
ShapeKind = Literal["box", "cylinder", "sphere", "capsule", "ellipsoid", "mesh"]

Name = Annotated[str, Length(256)]
SettingsText = Annotated[str, Length(60_000)]
PathName = Annotated[str, Length(4096)]
MOST_TEXT = 500_000
FileText = Annotated[str, Bytes(MOST_TEXT)]
"""The text of a file. A real description has at most a tenth of this, and a check of a longer one is slow."""
MOST_TEXTS = 2 * MOST_TEXT
"""Bytes of UTF-8 of all texts of one message: a file is saved with its text before and after."""
Fields = Annotated[tuple[Name, ...], Length(12)]
"""The fields of one plot."""


# --- Worlds, objects and faults ---


@dataclass(frozen=True, slots=True)
class Place:
    """A place in a source file: 1-based line and column, and the number of characters on that line."""

    file: str
    line: int
    column: int
    length: int


@dataclass(frozen=True, slots=True)
class Shape:
    """A primitive or a mesh, in the frame of its link or of the world.

    `size`: box x, y, z; cylinder and capsule radius, length (along z); sphere radius; ellipsoid half axes;
    mesh scale x, y, z. `mesh` is the id to fetch as `/mesh/<id>`, empty for primitives.
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
    """A built-in world or a world file. `parameters` are those of the current world, or the defaults of
    another one."""

    name: str
    parameters: tuple[WorldParameter, ...]


@dataclass(frozen=True, slots=True)
class SetWorld:
    """Start again in another world: a built-in world with optional parameters, or the world file that the run
    started with.

    `seed` is the seed of everything random in a run, for example of sensor noise.
    """

    world: PathName
    seed: Annotated[float, Bounds(0, 2**53)]
    type: Literal["set_world"] = "set_world"


@dataclass(frozen=True, slots=True)
class ResetPart:
    """Reset all models while time continues (`world`), or reset the clock to 0 while the models stay
    (`time`)."""

    what: Literal["world", "time"]
    type: Literal["reset_part"] = "reset_part"


@dataclass(frozen=True, slots=True)
class Spawn:
    """Add one of `About.things` to the running world, with its lowest point at a position (m, rad).

    A box has the given length, width and height. Everything else has its own size.
    """

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
    """Delete a robot or an object from the running world, by the name of one of its bodies."""

    name: Name
    type: Literal["delete"] = "delete"


@dataclass(frozen=True, slots=True)
class MoveModel:
    """Move a robot (on the ground) or an object to another pose (m, rad), and stop it."""

    name: Name
    x: Annotated[float, Bounds(-1e4, 1e4)]
    y: Annotated[float, Bounds(-1e4, 1e4)]
    z: Annotated[float, Bounds(-1e3, 1e3)]
    yaw: Annotated[float, Bounds(-10, 10)]
    type: Literal["move_model"] = "move_model"


@dataclass(frozen=True, slots=True)
class Push:
    """Apply a force in N along the world axes to a link of a robot, or to a body of the world, for some
    simulated seconds."""

    link: Name
    x: Annotated[float, Bounds(-1000, 1000)]
    y: Annotated[float, Bounds(-1000, 1000)]
    z: Annotated[float, Bounds(-1000, 1000)]
    seconds: Annotated[float, Bounds(0.001, 10)]
    type: Literal["push"] = "push"


@dataclass(frozen=True, slots=True)
class Kick:
    """Set the robot's velocity at once, in m/s along the world axes."""

    x: Annotated[float, Bounds(-100, 100)]
    y: Annotated[float, Bounds(-100, 100)]
    z: Annotated[float, Bounds(-100, 100)]
    type: Literal["kick"] = "kick"


@dataclass(frozen=True, slots=True)
class Disturb:
    """Inject a fault for some seconds: a link slips (coefficient of friction) or carries a payload (kg), a
    joint is blocked, or a topic is silent."""

    fault: Literal["slip", "payload", "blocked", "silent"]
    target: Name
    value: Annotated[float, Bounds(-1e3, 1e3)]
    seconds: Annotated[float, Bounds(0.01, 3600)]
    type: Literal["disturb"] = "disturb"


@dataclass(frozen=True, slots=True)
class EndFault:
    """End a fault of `State.faults` and remove it from the schedule."""

    number: Annotated[float, Bounds(0, 1e9)]
    type: Literal["end_fault"] = "end_fault"


@dataclass(frozen=True, slots=True)
class FaultView:
    """An injected fault: its description, and when it starts and stops in s of simulated time. None means
    that it does not stop."""

    number: int
    words: str
    start: float
    stop: float | None


@dataclass(frozen=True, slots=True)
class FallenView:
    """A robot or an object that fell off the floor at `time` s of simulated time and is now at height `z` in
    m. The robot on display has an empty name."""

    name: str
    time: float
    z: float


@dataclass(frozen=True, slots=True)
class JointSpeed:
    """Set the speed of a joint that has a controller, in rad/s or m/s."""

    name: Name
    velocity: Annotated[float, Bounds(-1e3, 1e3)]
    type: Literal["joint_speed"] = "joint_speed"


Action = Spawn | Delete | MoveModel | Kick | Disturb | EndFault | ResetPart | JointSpeed
"""Messages that change a running world."""


# --- Topics ---


@dataclass(frozen=True, slots=True)
class TopicView:
    """A topic with its ROS type (`sensor_msgs/msg/LaserScan`).

    `rate` is in messages per simulated second: measured while a page subscribes, otherwise the publisher's
    declared rate, or None. In a recording it is the mean over the whole recording. An input is a topic that
    other programs are meant to publish. Late subscribers of a latched topic receive its last message.
    """

    name: str
    kind: str
    rate: float | None
    is_input: bool
    is_latched: bool


@dataclass(frozen=True, slots=True)
class Topics:
    """All topics that a page can subscribe to."""

    topics: tuple[TopicView, ...]
    type: Literal["topics"] = "topics"


@dataclass(frozen=True, slots=True)
class TopicMessage:
    """One message of a subscribed topic, with its fields by name.

    `time` is when it was published. `is_latched` means that it was published before the page subscribed.
    Messages with large arrays are not sent as JSON but as a binary frame, see `workbench.topics.relay`.
    """

    topic: str
    kind: str
    time: float
    is_latched: bool
    message: dict[str, Any]  # Any: JSON
    type: Literal["message"] = "message"


@dataclass(frozen=True, slots=True)
class Subscribe:
    """Subscribe to a topic. The page receives the newest message, as often as it can keep up."""

    topic: Name
    type: Literal["subscribe"] = "subscribe"


@dataclass(frozen=True, slots=True)
class Unsubscribe:
    topic: Name
    type: Literal["unsubscribe"] = "unsubscribe"


@dataclass(frozen=True, slots=True)
class Publish:
    """Publish on one of the topics that pages may publish: a goal, a pose, a point, a command."""

    topic: Name
    kind: Name
    message: dict[str, Any]
    type: Literal["publish"] = "publish"


# --- Time and recordings ---


@dataclass(frozen=True, slots=True)
class Seek:
    """Show the time `at` on the timeline: to this page only, or to all pages if a recording is played
    back."""

    at: Annotated[float, Bounds(0, 1e12)]
    type: Literal["seek"] = "seek"


@dataclass(frozen=True, slots=True)
class GoLive:
    """Return from an earlier time to the present."""

    type: Literal["go_live"] = "go_live"


@dataclass(frozen=True, slots=True)
class Resume:
    """Continue the simulation from the time on display, or from the nearest saved state."""

    type: Literal["resume"] = "resume"


@dataclass(frozen=True, slots=True)
class SetLoop:
    """Set whether playback restarts at the end of the recording."""

    loop: bool
    type: Literal["set_loop"] = "set_loop"


@dataclass(frozen=True, slots=True)
class AskTrail:
    """Request the robot's path since the given number of resets, later than the time `after` on the timeline.
    -1 requests all of it."""

    resets: Annotated[float, Bounds(0, 1e12)]
    after: Annotated[float, Bounds(-1, 1e12)]
    type: Literal["ask_trail"] = "ask_trail"


@dataclass(frozen=True, slots=True)
class Trail:
    """The robot's path since the given number of resets and later than `after`, as far as it is kept: x and y
    in m of the world at times in s on the timeline.

    `jumps` are the indices of points that the robot did not drive to but was moved to.
    """

    resets: int
    after: float
    at: tuple[float, ...]
    x: tuple[float, ...]
    y: tuple[float, ...]
    jumps: tuple[int, ...]
    type: Literal["trail"] = "trail"


@dataclass(frozen=True, slots=True)
class Mark:
    """Bookmark the time `at` on the timeline, which is `time` by the simulation's clock."""

    at: Annotated[float, Bounds(0, 1e12)]
    time: Annotated[float, Bounds(-1e12, 1e12)]
    type: Literal["mark"] = "mark"


@dataclass(frozen=True, slots=True)
class NoteMark:
    """Change the note of a bookmark."""

    number: Annotated[float, Bounds(0, 1e15)]
    note: Name
    type: Literal["note_mark"] = "note_mark"


@dataclass(frozen=True, slots=True)
class RemoveMark:
    number: Annotated[float, Bounds(0, 1e15)]
    type: Literal["remove_mark"] = "remove_mark"


@dataclass(frozen=True, slots=True)
class Bookmark:
    """A bookmarked time, in s on the timeline and by the simulation's clock, with its note."""

    number: int
    at: float
    time: float
    note: str


@dataclass(frozen=True, slots=True)
class Bookmarks:
    """All bookmarks, ordered by time."""

    all: tuple[Bookmark, ...]
    type: Literal["bookmarks"] = "bookmarks"


@dataclass(frozen=True, slots=True)
class RecordRun:
    """Start or stop a recording of the simulation. The server chooses the file name."""

    on: bool
    type: Literal["record"] = "record"


@dataclass(frozen=True, slots=True)
class RecordingView:
    """A running recording: its file, its size in bytes, and its length in simulated seconds."""

    file: str
    bytes: int
    seconds: float


@dataclass(frozen=True, slots=True)
class Recorded:
    """A recording has ended: its file, and the address to download it, empty if it is too large."""

    file: str
    address: str
    type: Literal["recorded"] = "recorded"


@dataclass(frozen=True, slots=True)
class Timeline:
    """The times that a page can display, from `start` to `end` in s on a timeline that never goes back.

    `at` is the time that this page displays, `live` means that it displays the present, and `asked` is the
    time it asked for last, which can be outside the timeline. `played` means that the timeline is that of a
    recording. `paused` and `speed` describe the present. Topics in `silent` had not published anything until
    `at`.
    """

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
    """One macro call or include that led to a finding's element."""

    kind: Literal["macro", "include"]
    name: str
    place: Place


@dataclass(frozen=True, slots=True)
class Note:
    """Another place that a finding refers to."""

    message: str
    place: Place


# --- Findings and source text ---


@dataclass(frozen=True, slots=True)
class TextEdit:
    """A change of a file: the text from a line and column to another (1-based, exclusive) becomes `text`."""

    file: str
    line: int
    column: int
    end_line: int
    end_column: int
    text: str


@dataclass(frozen=True, slots=True)
class Finding:
    """One diagnostic. `link` is the link it is in and `fix` the title of its fix, made by `edits`. All can be
    empty."""

    code: str
    severity: Literal["error", "warning", "info"]
    message: str
    hint: str
    place: Place | None
    stack: tuple[Step, ...]
    related: tuple[Note, ...]
    link: str
    fix: str
    edits: tuple[TextEdit, ...]


@dataclass(frozen=True, slots=True)
class Findings:
    """All findings. `stale` means that the scene shows an older, valid description.

    `serial` counts readings of the description, so that a page asks for a fix in the list that it displays.
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
    """The values of an attribute that is written as an expression, one for each macro call with a different
    value. `more` means that some are omitted."""

    place: Place
    values: tuple[str, ...]
    more: bool


@dataclass(frozen=True, slots=True)
class SourceText:
    """The text of one of the description's files. `owners` lists the links of each line, `hints` the values
    of its expressions. `read_only` is the reason why the page may not save it, or empty."""

    file: str
    text: str
    owners: tuple[tuple[str, ...], ...]
    hints: tuple[Hint, ...]
    read_only: str
    type: Literal["source"] = "source"


@dataclass(frozen=True, slots=True)
class ElementNames:
    """An element that can be completed, such as a link or the call of a macro.

    Without `children`, it may contain any element.
    """

    name: str
    attributes: tuple[str, ...]
    children: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class AttributeValues:
    """The values that can be completed in an attribute of an element."""

    element: str
    attribute: str
    values: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class NamedValue:
    """A property or an argument, and its value as text."""

    name: str
    value: str


@dataclass(frozen=True, slots=True)
class Completions:
    """What an editor can complete: elements, attribute values, and names in `${…}` and `$(arg …)`."""

    elements: tuple[ElementNames, ...]
    values: tuple[AttributeValues, ...]
    properties: tuple[NamedValue, ...]
    arguments: tuple[NamedValue, ...]
    type: Literal["completions"] = "completions"


@dataclass(frozen=True, slots=True)
class CheckTexts:
    """Check the description with unsaved texts of some of its files, in the same order as `files`.

    Only the newest request of a page is answered. The answer has the same `number`.
    """

    number: Annotated[float, Bounds(0, 1e15)]
    files: Annotated[tuple[PathName, ...], Length(20)]
    texts: Annotated[tuple[FileText, ...], Length(20)]
    type: Literal["check_texts"] = "check_texts"


@dataclass(frozen=True, slots=True)
class TextsChecked:
    """The findings of unsaved texts. `completions` is None if the text is not well-formed."""

    number: float
    findings: tuple[Finding, ...]
    completions: Completions | None
    type: Literal["texts_checked"] = "texts_checked"


@dataclass(frozen=True, slots=True)
class SaveSource:
    """Write a file. `was` is its content when the page read it.

    If the file has changed since, changes at other lines are kept. If it was deleted, it is created again
    only if `was` is None.
    """

    file: PathName
    was: FileText | None
    text: FileText
    type: Literal["save_source"] = "save_source"


@dataclass(frozen=True, slots=True)
class SourceSaved:
    """A file was written. `sent` is the text that the page sent. `text` is the new content of the file, which
    also has the changes of other programs."""

    file: str
    sent: str
    text: str
    type: Literal["source_saved"] = "source_saved"


@dataclass(frozen=True, slots=True)
class SourceConflict:
    """A file was not written, because another program changed the same lines or deleted it. Also sent when a
    page opens a file that was deleted. `text` is its content, or None if it was deleted."""

    file: str
    text: str | None
    type: Literal["source_conflict"] = "source_conflict"


@dataclass(frozen=True, slots=True)
class AskRule:
    """Request the page of a rule by its code."""

    code: Name
    type: Literal["ask_rule"] = "ask_rule"


@dataclass(frozen=True, slots=True)
class RuleSection:
    """A section of a rule's page, such as Why or Fix."""

    title: str
    text: str


@dataclass(frozen=True, slots=True)
class RulePage:
    """The page of a rule, as `kbot rule` prints it."""

    code: str
    name: str
    sections: tuple[RuleSection, ...]
    type: Literal["rule_page"] = "rule_page"


@dataclass(frozen=True, slots=True)
class Parameter:
    """A number in the description that can be changed: a xacro argument or property.

    `written` is the value in the file and `value` the one on display. With `is_truth` the value is a boolean,
    as 1 or 0. `unit` is the unit that the geometry implies, or empty. `place` is the place of the number.
    """

    kind: Literal["arg", "property"]
    name: str
    written: float
    value: float
    is_truth: bool
    unit: str
    place: Place


@dataclass(frozen=True, slots=True)
class Parameters:
    """All parameters in the order of the file. `undo` and `redo` are the titles of the changes to undo and
    redo, or empty. `read_only` is the reason why nothing may be changed, so that no parameters are listed, or
    empty."""

    parameters: tuple[Parameter, ...]
    undo: str
    redo: str
    read_only: str
    type: Literal["parameters"] = "parameters"


@dataclass(frozen=True, slots=True)
class SetParameter:
    """Display the robot with another value, without changing the file."""

    kind: Literal["arg", "property"]
    name: Name
    value: Annotated[float, Bounds(-1e9, 1e9)]
    type: Literal["set_parameter"] = "set_parameter"


@dataclass(frozen=True, slots=True)
class DropParameters:
    """Display the values of the file again."""

    type: Literal["drop_parameters"] = "drop_parameters"


@dataclass(frozen=True, slots=True)
class KeepParameters:
    """Write the displayed values to the file."""

    type: Literal["keep_parameters"] = "keep_parameters"


@dataclass(frozen=True, slots=True)
class EditSource:
    """Replace the text `was` at a line and column (1-based) of one of the files with `text`."""

    file: PathName
    line: Annotated[float, Bounds(1, 1e9)]
    column: Annotated[float, Bounds(1, 1e9)]
    was: Name
    text: Name
    type: Literal["edit_source"] = "edit_source"


@dataclass(frozen=True, slots=True)
class ApplyFix:
    """Apply the fix of a finding in the list with this serial."""

    serial: Annotated[float, Bounds(0, 1e15)]
    index: Annotated[float, Bounds(0, 1e6)]
    type: Literal["apply_fix"] = "apply_fix"


@dataclass(frozen=True, slots=True)
class Undo:
    """Undo the last change that the page made to a file."""

    type: Literal["undo"] = "undo"


@dataclass(frozen=True, slots=True)
class Redo:
    """Redo the change that was undone last."""

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
    """A link. `parent` and `joint` are empty for the root."""

    name: str
    parent: str
    joint: str
    visuals: tuple[Shape, ...]
    collisions: tuple[Shape, ...]
    inertia: InertiaView | None
    place: Place | None


@dataclass(frozen=True, slots=True)
class JointView:
    """A joint with one position, about or along `axis` in the frame of its child.

    `lower` and `upper` are the ends of the slider. `control` is the command that the joint accepts here,
    `speed` its greatest speed in rad/s or m/s.
    """

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
    """A body of the world and its initial pose. The pose of a `moving` body is in every state."""

    name: str
    moving: bool
    parts: tuple[Shape, ...]
    position: tuple[float, ...]
    quaternion: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Scene:
    """Everything that is drawn. States refer to it by `revision`, in the order of its links and joints.

    `world` is the frame of the poses in states, and `ground` the height of the floor. `radius` and `centre`
    describe a sphere around the robot with all joints at zero, in the root frame.
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
    """New bodies of the world. The rest of the scene is unchanged."""

    revision: int
    bodies: tuple[BodyView, ...]
    type: Literal["things"] = "things"


# --- Plots ---


@dataclass(frozen=True, slots=True)
class AskSeries:
    """Request values over time, from `start` to `end` in s on the timeline. The answer has the same `number`.

    A field is `/topic path.to.field`, or `state path.to.field` of the State, whose positions are by joint
    name.
    """

    number: Annotated[float, Bounds(0, 1e15)]
    fields: Fields
    start: Annotated[float, Bounds(0, 1e12)]
    end: Annotated[float, Bounds(0, 1e12)]
    type: Literal["ask_series"] = "ask_series"


@dataclass(frozen=True, slots=True)
class DrawPlot:
    """Request the same as an SVG of the given size in pixels. `labels` are the names of the fields."""

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
    """Values over time: `at` on the timeline, `time` by the simulation's clock, and a list of values for each
    field, null where there is no value yet.

    With `is_thinned` only every n-th value is included, because there are more than a plot has columns.
    """

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
    """A plot as SVG, for the browser to save."""

    svg: str
    type: Literal["plot_drawn"] = "plot_drawn"


# --- Displays ---


@dataclass(frozen=True, slots=True)
class Displays:
    """Display settings from a file, in the format of `workbench.displays.display_settings`.

    `notes` report what is not displayed. `file` is the file that the page can save to, or empty.
    """

    name: str
    file: str
    setup: dict[str, Any]
    notes: tuple[str, ...]
    type: Literal["displays"] = "displays"


@dataclass(frozen=True, slots=True)
class DisplaysText:
    """Display settings as the text of a file with that name, for the browser to save."""

    name: str
    text: str
    notes: tuple[str, ...]
    type: Literal["displays_text"] = "displays_text"


@dataclass(frozen=True, slots=True)
class DisplaysSaved:
    """The display settings were written to their file."""

    file: str
    notes: tuple[str, ...]
    type: Literal["displays_saved"] = "displays_saved"


@dataclass(frozen=True, slots=True)
class SaveDisplays:
    """Save display settings: to their file, or as text in the format of KBot or rviz for the browser to
    save."""

    kind: Literal["file", "kbot", "rviz1", "rviz2"]
    setup: dict[str, Any]
    type: Literal["save_displays"] = "save_displays"


@dataclass(frozen=True, slots=True)
class OpenDisplays:
    """Load display settings from a file that was chosen in the browser."""

    name: Name
    text: SettingsText
    type: Literal["open_displays"] = "open_displays"


# --- The state of the run ---


@dataclass(frozen=True, slots=True)
class State:
    """The state of a run at one time.

    `poses` holds x, y, z, qx, qy, qz, qw of each link in the world, flat, and `bodies` those of the moving
    bodies. `frames` are names and parents of the tf frames that are not links, and `frame_poses` their poses
    in the world.

    `command` and `twist` are the commanded and the actual forward and turning speed. `odometry` is x, y, yaw
    as estimated from the wheels. `rate` is simulated time per wall-clock time. `at` is the time in s on the
    timeline. `jumps` counts how often the robot was moved to another place without driving there.
    `previous_at` is the `at` of the state sent before: a page whose newest state is older has missed some.
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
    previous_at: float = 0.0
    type: Literal["state"] = "state"


@dataclass(frozen=True, slots=True)
class ProgramView:
    """The user's program that drives the simulation. `name` is its file.

    `note` is a sentence about a running program that makes no step, or a finished one that made none.
    Otherwise it is empty. `can_start` means that `RunProgram` starts it again. `error` is the reason why it
    failed, with file and line.
    """

    name: str
    phase: ProgramPhase
    note: str
    can_start: bool
    error: str
    type: Literal["program"] = "program"


@dataclass(frozen=True, slots=True)
class About:
    """Describes the session. It is sent first.

    `played` is the recording on display, or empty. `cannot_drive` is the reason why the robot cannot drive,
    or empty. `things` can be spawned, `seed` is the seed of everything random, and recordings are written to
    `folder`.
    """

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
class Notice:
    """A notice for the user about something that was done."""

    text: str
    type: Literal["notice"] = "notice"


@dataclass(frozen=True, slots=True)
class Refused:
    """A message was not carried out."""

    reason: str
    type: Literal["refused"] = "refused"


@dataclass(frozen=True, slots=True)
class Beat:
    """The page replies with `BeatReply` when it has processed everything before the beat. A page that lags
    receives fewer messages."""

    type: Literal["beat"] = "beat"


# --- Messages by direction: from the server, and at the end from the page ---

FromServer = (
    About
    | Scene
    | Things
    | State
    | Findings
    | SourceText
    | Completions
    | TextsChecked
    | SourceSaved
    | SourceConflict
    | RulePage
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
    | ProgramView
    | Notice
    | Refused
    | Beat
)


# --- Driving ---


@dataclass(frozen=True, slots=True)
class Drive:
    """Forward speed in m/s and turning speed in rad/s, held until changed or until the page stops sending."""

    linear: Annotated[float, Bounds(-10, 10)]
    angular: Annotated[float, Bounds(-50, 50)]
    type: Literal["drive"] = "drive"


@dataclass(frozen=True, slots=True)
class Stop:
    """Stop the robot, whichever page or program drives it."""

    type: Literal["stop"] = "stop"


@dataclass(frozen=True, slots=True)
class RunProgram:
    """Start the program again that `kbot sim --script` was started with."""

    type: Literal["run_program"] = "run_program"


@dataclass(frozen=True, slots=True)
class SetJoint:
    name: Name
    position: Annotated[float, Bounds(-1e6, 1e6)]
    type: Literal["set_joint"] = "set_joint"


@dataclass(frozen=True, slots=True)
class SetJoints:
    """Set all joints: to zero or the nearest limit, to the middle of their range, or at random."""

    preset: Literal["zero", "centre", "random"]
    type: Literal["set_joints"] = "set_joints"


@dataclass(frozen=True, slots=True)
class Pause:
    paused: bool
    type: Literal["pause"] = "pause"


@dataclass(frozen=True, slots=True)
class Advance:
    """Simulate for a short time while paused."""

    seconds: Annotated[float, Bounds(0.001, 1)]
    type: Literal["advance"] = "advance"


@dataclass(frozen=True, slots=True)
class Reset:
    type: Literal["reset"] = "reset"


@dataclass(frozen=True, slots=True)
class SetSpeed:
    """Simulated seconds per wall-clock second."""

    factor: Annotated[float, Bounds(0.1, 10)]
    type: Literal["set_speed"] = "set_speed"


@dataclass(frozen=True, slots=True)
class BeatReply:
    """The page has processed everything up to a `Beat`."""

    type: Literal["heard"] = "heard"


FromPage = (
    Drive
    | Stop
    | RunProgram
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
    | CheckTexts
    | SaveSource
    | AskRule
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
    | BeatReply
)
