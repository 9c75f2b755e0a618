// Generated from src/kbot/workbench/protocol; do not edit.

export interface WorldParameter {
  name: string;
  value: number;
  is_whole: boolean;
}

/** A built-in world or a world file. `parameters` are those of the current world, or the defaults of another one. */
export interface WorldChoice {
  name: string;
  parameters: readonly WorldParameter[];
}

/** Describes the session. It is sent first. `played` is the recording on display, or empty. `cannot_drive` is the reason why the robot cannot drive, or empty. `things` can be spawned, `seed` is the seed of everything random, and recordings are written to `folder`. */
export interface About {
  file: string;
  played: string;
  mode: "view" | "sim" | "play";
  world: string;
  cannot_drive: string;
  linear_limit: number;
  angular_limit: number;
  files: readonly string[];
  worlds: readonly WorldChoice[];
  things: readonly string[];
  seed: number;
  folder: string;
  client: number;
  type: "about";
}

/** A place in a source file: 1-based line and column, and the number of characters on that line. */
export interface Place {
  file: string;
  line: number;
  column: number;
  length: number;
}

/** A primitive or a mesh, in the frame of its link or of the world. `size`: box x, y, z; cylinder and capsule radius, length (along z); sphere radius; ellipsoid half axes; mesh scale x, y, z. `mesh` is the id to fetch as `/mesh/<id>`, empty for primitives. */
export interface Shape {
  kind: "box" | "cylinder" | "sphere" | "capsule" | "ellipsoid" | "mesh";
  size: readonly number[];
  position: readonly number[];
  quaternion: readonly number[];
  rgba: readonly number[];
  mesh: string;
  place: Place | null;
}

/** Mass in kg, and the solid box of that mass with the same principal moments of inertia. */
export interface InertiaView {
  mass: number;
  box: readonly number[];
  position: readonly number[];
  quaternion: readonly number[];
  place: Place | null;
}

/** A link. `parent` and `joint` are empty for the root. */
export interface LinkView {
  name: string;
  parent: string;
  joint: string;
  visuals: readonly Shape[];
  collisions: readonly Shape[];
  inertia: InertiaView | null;
  place: Place | null;
}

/** A joint with one position, about or along `axis` in the frame of its child. `lower` and `upper` are the ends of the slider. `control` is the command that the joint accepts here, `speed` its greatest speed in rad/s or m/s. */
export interface JointView {
  name: string;
  kind: "continuous" | "revolute" | "prismatic";
  child: string;
  axis: readonly number[];
  lower: number;
  upper: number;
  mimics: string;
  control: "none" | "position" | "velocity";
  speed: number;
  place: Place | null;
}

/** A body of the world and its initial pose. The pose of a `moving` body is in every state. */
export interface BodyView {
  name: string;
  moving: boolean;
  parts: readonly Shape[];
  position: readonly number[];
  quaternion: readonly number[];
}

/** Everything that is drawn. States refer to it by `revision`, in the order of its links and joints. `world` is the frame of the poses in states, and `ground` the height of the floor. `radius` and `centre` describe a sphere around the robot with all joints at zero, in the root frame. */
export interface Scene {
  revision: number;
  robot: string;
  root: string;
  world: string;
  links: readonly LinkView[];
  joints: readonly JointView[];
  bodies: readonly BodyView[];
  ground: number;
  radius: number;
  centre: readonly number[];
  type: "scene";
}

/** New bodies of the world. The rest of the scene is unchanged. */
export interface Things {
  revision: number;
  bodies: readonly BodyView[];
  type: "things";
}

/** An injected fault: its description, and when it starts and stops in s of simulated time. None means that it does not stop. */
export interface FaultView {
  number: number;
  words: string;
  start: number;
  stop: number | null;
}

/** A robot or an object that fell off the floor at `time` s of simulated time and is now at height `z` in m. The robot on display has an empty name. */
export interface FallenView {
  name: string;
  time: number;
  z: number;
}

/** The state of a run at one time. `poses` holds x, y, z, qx, qy, qz, qw of each link in the world, flat, and `bodies` those of the moving bodies. `frames` are names and parents of the tf frames that are not links, and `frame_poses` their poses in the world. `command` and `twist` are the commanded and the actual forward and turning speed. `odometry` is x, y, yaw as estimated from the wheels. `rate` is simulated time per wall-clock time. `at` is the time in s on the timeline. `jumps` counts how often the robot was moved to another place without driving there. `previous_at` is the `at` of the state sent before: a page whose newest state is older has missed some. */
export interface State {
  revision: number;
  time: number;
  paused: boolean;
  speed: number;
  rate: number;
  positions: readonly number[];
  poses: readonly number[];
  bodies: readonly number[];
  frames: readonly (readonly string[])[];
  frame_poses: readonly number[];
  command: readonly number[];
  twist: readonly number[];
  odometry: readonly number[];
  driver: number;
  resets: number;
  at: number;
  faults: readonly FaultView[];
  fallen: readonly FallenView[];
  jumps: number;
  previous_at: number;
  type: "state";
}

/** One macro call or include that led to a finding's element. */
export interface Step {
  kind: "macro" | "include";
  name: string;
  place: Place;
}

/** Another place that a finding refers to. */
export interface Note {
  message: string;
  place: Place;
}

/** A change of a file: the text from a line and column to another (1-based, exclusive) becomes `text`. */
export interface TextEdit {
  file: string;
  line: number;
  column: number;
  end_line: number;
  end_column: number;
  text: string;
}

/** One diagnostic. `link` is the link it is in and `fix` the title of its fix, made by `edits`. All can be empty. */
export interface Finding {
  code: string;
  severity: "error" | "warning" | "info";
  message: string;
  hint: string;
  place: Place | null;
  stack: readonly Step[];
  related: readonly Note[];
  link: string;
  fix: string;
  edits: readonly TextEdit[];
}

/** All findings. `stale` means that the scene shows an older, valid description. `serial` counts readings of the description, so that a page asks for a fix in the list that it displays. */
export interface Findings {
  serial: number;
  stale: boolean;
  findings: readonly Finding[];
  type: "findings";
}

/** The values of an attribute that is written as an expression, one for each macro call with a different value. `more` means that some are omitted. */
export interface Hint {
  place: Place;
  values: readonly string[];
  more: boolean;
}

/** The text of one of the description's files. `owners` lists the links of each line, `hints` the values of its expressions. `read_only` is the reason why the page may not save it, or empty. */
export interface SourceText {
  file: string;
  text: string;
  owners: readonly (readonly string[])[];
  hints: readonly Hint[];
  read_only: string;
  type: "source";
}

/** An element that can be completed, such as a link or the call of a macro. Without `children`, it may contain any element. */
export interface ElementNames {
  name: string;
  attributes: readonly string[];
  children: readonly string[];
}

/** The values that can be completed in an attribute of an element. */
export interface AttributeValues {
  element: string;
  attribute: string;
  values: readonly string[];
}

/** A property or an argument, and its value as text. */
export interface NamedValue {
  name: string;
  value: string;
}

/** What an editor can complete: elements, attribute values, and names in `${…}` and `$(arg …)`. */
export interface Completions {
  elements: readonly ElementNames[];
  values: readonly AttributeValues[];
  properties: readonly NamedValue[];
  arguments: readonly NamedValue[];
  type: "completions";
}

/** The findings of unsaved texts. `completions` is None if the text is not well-formed. */
export interface TextsChecked {
  number: number;
  findings: readonly Finding[];
  completions: Completions | null;
  type: "texts_checked";
}

/** A file was written. `sent` is the text that the page sent. `text` is the new content of the file, which also has the changes of other programs. */
export interface SourceSaved {
  file: string;
  sent: string;
  text: string;
  type: "source_saved";
}

/** A file was not written, because another program changed the same lines or deleted it. Also sent when a page opens a file that was deleted. `text` is its content, or None if it was deleted. */
export interface SourceConflict {
  file: string;
  text: string | null;
  type: "source_conflict";
}

/** A section of a rule's page, such as Why or Fix. */
export interface RuleSection {
  title: string;
  text: string;
}

/** The page of a rule, as `kbot rule` prints it. */
export interface RulePage {
  code: string;
  name: string;
  sections: readonly RuleSection[];
  type: "rule_page";
}

/** A number in the description that can be changed: a xacro argument or property. `written` is the value in the file and `value` the one on display. With `is_truth` the value is a boolean, as 1 or 0. `unit` is the unit that the geometry implies, or empty. `place` is the place of the number. */
export interface Parameter {
  kind: "arg" | "property";
  name: string;
  written: number;
  value: number;
  is_truth: boolean;
  unit: string;
  place: Place;
}

/** All parameters in the order of the file. `undo` and `redo` are the titles of the changes to undo and redo, or empty. `read_only` is the reason why nothing may be changed, so that no parameters are listed, or empty. */
export interface Parameters {
  parameters: readonly Parameter[];
  undo: string;
  redo: string;
  read_only: string;
  type: "parameters";
}

/** A topic with its ROS type (`sensor_msgs/msg/LaserScan`). `rate` is in messages per simulated second: measured while a page subscribes, otherwise the publisher's declared rate, or None. In a recording it is the mean over the whole recording. An input is a topic that other programs are meant to publish. Late subscribers of a latched topic receive its last message. */
export interface TopicView {
  name: string;
  kind: string;
  rate: number | null;
  is_input: boolean;
  is_latched: boolean;
}

/** All topics that a page can subscribe to. */
export interface Topics {
  topics: readonly TopicView[];
  type: "topics";
}

/** One message of a subscribed topic, with its fields by name. `time` is when it was published. `is_latched` means that it was published before the page subscribed. Messages with large arrays are not sent as JSON but as a binary frame, see `workbench.topics.relay`. */
export interface TopicMessage {
  topic: string;
  kind: string;
  time: number;
  is_latched: boolean;
  message: { [name: string]: unknown };
  type: "message";
}

/** Display settings from a file, in the format of `workbench.displays.display_settings`. `notes` report what is not displayed. `file` is the file that the page can save to, or empty. */
export interface Displays {
  name: string;
  file: string;
  setup: { [name: string]: unknown };
  notes: readonly string[];
  type: "displays";
}

/** Display settings as the text of a file with that name, for the browser to save. */
export interface DisplaysText {
  name: string;
  text: string;
  notes: readonly string[];
  type: "displays_text";
}

/** The display settings were written to their file. */
export interface DisplaysSaved {
  file: string;
  notes: readonly string[];
  type: "displays_saved";
}

/** A running recording: its file, its size in bytes, and its length in simulated seconds. */
export interface RecordingView {
  file: string;
  bytes: number;
  seconds: number;
}

/** The times that a page can display, from `start` to `end` in s on a timeline that never goes back. `at` is the time that this page displays, `live` means that it displays the present, and `asked` is the time it asked for last, which can be outside the timeline. `played` means that the timeline is that of a recording. `paused` and `speed` describe the present. Topics in `silent` had not published anything until `at`. */
export interface Timeline {
  start: number;
  end: number;
  at: number;
  live: boolean;
  played: boolean;
  loop: boolean;
  paused: boolean;
  speed: number;
  silent: readonly string[];
  recording: RecordingView | null;
  asked: number | null;
  type: "timeline";
}

/** A bookmarked time, in s on the timeline and by the simulation's clock, with its note. */
export interface Bookmark {
  number: number;
  at: number;
  time: number;
  note: string;
}

/** All bookmarks, ordered by time. */
export interface Bookmarks {
  all: readonly Bookmark[];
  type: "bookmarks";
}

/** A recording has ended: its file, and the address to download it, empty if it is too large. */
export interface Recorded {
  file: string;
  address: string;
  type: "recorded";
}

/** The robot's path since the given number of resets and later than `after`, as far as it is kept: x and y in m of the world at times in s on the timeline. `jumps` are the indices of points that the robot did not drive to but was moved to. */
export interface Trail {
  resets: number;
  after: number;
  at: readonly number[];
  x: readonly number[];
  y: readonly number[];
  jumps: readonly number[];
  type: "trail";
}

/** Values over time: `at` on the timeline, `time` by the simulation's clock, and a list of values for each field, null where there is no value yet. With `is_thinned` only every n-th value is included, because there are more than a plot has columns. */
export interface Series {
  number: number;
  start: number;
  end: number;
  is_thinned: boolean;
  at: readonly number[];
  time: readonly number[];
  values: readonly (readonly (number | null)[])[];
  type: "series";
}

/** A plot as SVG, for the browser to save. */
export interface PlotDrawn {
  svg: string;
  type: "plot_drawn";
}

/** The user's program that drives the simulation. `name` is its file. `note` is a sentence about a running program that makes no step, or a finished one that made none. Otherwise it is empty. `can_start` means that `RunProgram` starts it again. `error` is the reason why it failed, with file and line. */
export interface ProgramView {
  name: string;
  phase: "waiting" | "running" | "finished" | "failed" | "stopped";
  note: string;
  can_start: boolean;
  error: string;
  type: "program";
}

/** A notice for the user about something that was done. */
export interface Notice {
  text: string;
  type: "notice";
}

/** A message was not carried out. */
export interface Refused {
  reason: string;
  type: "refused";
}

/** The page replies with `BeatReply` when it has processed everything before the beat. A page that lags receives fewer messages. */
export interface Beat {
  type: "beat";
}

/** Forward speed in m/s and turning speed in rad/s, held until changed or until the page stops sending. */
export interface Drive {
  linear: number;
  angular: number;
  type: "drive";
}

/** Stop the robot, whichever page or program drives it. */
export interface Stop {
  type: "stop";
}

/** Start the program again that `kbot sim --script` was started with. */
export interface RunProgram {
  type: "run_program";
}

export interface SetJoint {
  name: string;
  position: number;
  type: "set_joint";
}

/** Set all joints: to zero or the nearest limit, to the middle of their range, or at random. */
export interface SetJoints {
  preset: "zero" | "centre" | "random";
  type: "set_joints";
}

export interface Pause {
  paused: boolean;
  type: "pause";
}

/** Simulate for a short time while paused. */
export interface Advance {
  seconds: number;
  type: "advance";
}

export interface Reset {
  type: "reset";
}

/** Simulated seconds per wall-clock second. */
export interface SetSpeed {
  factor: number;
  type: "set_speed";
}

/** Apply a force in N along the world axes to a link of a robot, or to a body of the world, for some simulated seconds. */
export interface Push {
  link: string;
  x: number;
  y: number;
  z: number;
  seconds: number;
  type: "push";
}

/** Add one of `About.things` to the running world, with its lowest point at a position (m, rad). A box has the given length, width and height. Everything else has its own size. */
export interface Spawn {
  what: string;
  x: number;
  y: number;
  z: number;
  yaw: number;
  length: number;
  width: number;
  height: number;
  type: "spawn";
}

/** Delete a robot or an object from the running world, by the name of one of its bodies. */
export interface Delete {
  name: string;
  type: "delete";
}

/** Move a robot (on the ground) or an object to another pose (m, rad), and stop it. */
export interface MoveModel {
  name: string;
  x: number;
  y: number;
  z: number;
  yaw: number;
  type: "move_model";
}

/** Set the robot's velocity at once, in m/s along the world axes. */
export interface Kick {
  x: number;
  y: number;
  z: number;
  type: "kick";
}

/** Inject a fault for some seconds: a link slips (coefficient of friction) or carries a payload (kg), a joint is blocked, or a topic is silent. */
export interface Disturb {
  fault: "slip" | "payload" | "blocked" | "silent";
  target: string;
  value: number;
  seconds: number;
  type: "disturb";
}

/** End a fault of `State.faults` and remove it from the schedule. */
export interface EndFault {
  number: number;
  type: "end_fault";
}

/** Reset all models while time continues (`world`), or reset the clock to 0 while the models stay (`time`). */
export interface ResetPart {
  what: "world" | "time";
  type: "reset_part";
}

/** Set the speed of a joint that has a controller, in rad/s or m/s. */
export interface JointSpeed {
  name: string;
  velocity: number;
  type: "joint_speed";
}

/** Start again in another world: a built-in world with optional parameters, or the world file that the run started with. `seed` is the seed of everything random in a run, for example of sensor noise. */
export interface SetWorld {
  world: string;
  seed: number;
  type: "set_world";
}

export interface OpenSource {
  file: string;
  type: "open_source";
}

/** Check the description with unsaved texts of some of its files, in the same order as `files`. Only the newest request of a page is answered. The answer has the same `number`. */
export interface CheckTexts {
  number: number;
  files: readonly string[];
  texts: readonly string[];
  type: "check_texts";
}

/** Write a file. `was` is its content when the page read it. If the file has changed since, changes at other lines are kept. If it was deleted, it is created again only if `was` is None. */
export interface SaveSource {
  file: string;
  was: string | null;
  text: string;
  type: "save_source";
}

/** Request the page of a rule by its code. */
export interface AskRule {
  code: string;
  type: "ask_rule";
}

/** Display the robot with another value, without changing the file. */
export interface SetParameter {
  kind: "arg" | "property";
  name: string;
  value: number;
  type: "set_parameter";
}

/** Display the values of the file again. */
export interface DropParameters {
  type: "drop_parameters";
}

/** Write the displayed values to the file. */
export interface KeepParameters {
  type: "keep_parameters";
}

/** Replace the text `was` at a line and column (1-based) of one of the files with `text`. */
export interface EditSource {
  file: string;
  line: number;
  column: number;
  was: string;
  text: string;
  type: "edit_source";
}

/** Apply the fix of a finding in the list with this serial. */
export interface ApplyFix {
  serial: number;
  index: number;
  type: "apply_fix";
}

/** Undo the last change that the page made to a file. */
export interface Undo {
  type: "undo";
}

/** Redo the change that was undone last. */
export interface Redo {
  type: "redo";
}

/** Subscribe to a topic. The page receives the newest message, as often as it can keep up. */
export interface Subscribe {
  topic: string;
  type: "subscribe";
}

export interface Unsubscribe {
  topic: string;
  type: "unsubscribe";
}

/** Publish on one of the topics that pages may publish: a goal, a pose, a point, a command. */
export interface Publish {
  topic: string;
  kind: string;
  message: { [name: string]: unknown };
  type: "publish";
}

/** Save display settings: to their file, or as text in the format of KBot or rviz for the browser to save. */
export interface SaveDisplays {
  kind: "file" | "kbot" | "rviz1" | "rviz2";
  setup: { [name: string]: unknown };
  type: "save_displays";
}

/** Load display settings from a file that was chosen in the browser. */
export interface OpenDisplays {
  name: string;
  text: string;
  type: "open_displays";
}

/** Show the time `at` on the timeline: to this page only, or to all pages if a recording is played back. */
export interface Seek {
  at: number;
  type: "seek";
}

/** Return from an earlier time to the present. */
export interface GoLive {
  type: "go_live";
}

/** Continue the simulation from the time on display, or from the nearest saved state. */
export interface Resume {
  type: "resume";
}

/** Set whether playback restarts at the end of the recording. */
export interface SetLoop {
  loop: boolean;
  type: "set_loop";
}

/** Start or stop a recording of the simulation. The server chooses the file name. */
export interface RecordRun {
  on: boolean;
  type: "record";
}

/** Bookmark the time `at` on the timeline, which is `time` by the simulation's clock. */
export interface Mark {
  at: number;
  time: number;
  type: "mark";
}

/** Change the note of a bookmark. */
export interface NoteMark {
  number: number;
  note: string;
  type: "note_mark";
}

export interface RemoveMark {
  number: number;
  type: "remove_mark";
}

/** Request the robot's path since the given number of resets, later than the time `after` on the timeline. -1 requests all of it. */
export interface AskTrail {
  resets: number;
  after: number;
  type: "ask_trail";
}

/** Request values over time, from `start` to `end` in s on the timeline. The answer has the same `number`. A field is `/topic path.to.field`, or `state path.to.field` of the State, whose positions are by joint name. */
export interface AskSeries {
  number: number;
  fields: readonly string[];
  start: number;
  end: number;
  type: "ask_series";
}

/** Request the same as an SVG of the given size in pixels. `labels` are the names of the fields. */
export interface DrawPlot {
  fields: readonly string[];
  labels: readonly string[];
  start: number;
  end: number;
  theme: "dark" | "light";
  width: number;
  height: number;
  type: "draw_plot";
}

/** The page has processed everything up to a `Beat`. */
export interface BeatReply {
  type: "heard";
}

export type FromServer = About | Scene | Things | State | Findings | SourceText | Completions | TextsChecked | SourceSaved | SourceConflict | RulePage | Parameters | Topics | TopicMessage | Displays | DisplaysText | DisplaysSaved | Timeline | Bookmarks | Recorded | Trail | Series | PlotDrawn | ProgramView | Notice | Refused | Beat;

export type FromPage = Drive | Stop | RunProgram | SetJoint | SetJoints | Pause | Advance | Reset | SetSpeed | Push | Spawn | Delete | MoveModel | Kick | Disturb | EndFault | ResetPart | JointSpeed | SetWorld | OpenSource | CheckTexts | SaveSource | AskRule | SetParameter | DropParameters | KeepParameters | EditSource | ApplyFix | Undo | Redo | Subscribe | Unsubscribe | Publish | SaveDisplays | OpenDisplays | Seek | GoLive | Resume | SetLoop | RecordRun | Mark | NoteMark | RemoveMark | AskTrail | AskSeries | DrawPlot | BeatReply;
