// Generated from src/kbot/workbench/protocol; do not edit.

export interface WorldParameter {
  name: string;
  value: number;
  is_whole: boolean;
}

/** A built-in world, or the file of one, and what its parameters are: those of the present world, or what they are when not given. */
export interface WorldChoice {
  name: string;
  parameters: readonly WorldParameter[];
}

/** What this session is; sent first. `played` is the recording on show, empty where none is. `cannot_drive` says why, and is empty when it can. `things` are what may be put into the world, `seed` is that of whatever is random, and `folder` is where recordings go. */
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

/** Where something was written: 1-based line and column, and how many characters of that line. */
export interface Place {
  file: string;
  line: number;
  column: number;
  length: number;
}

/** A primitive or a mesh, in the frame of its link or of the world. `size`: box x, y, z; cylinder and capsule radius, length (along z); sphere radius; ellipsoid half axes; mesh scale x, y, z. `mesh` is the id to fetch as `/mesh/<id>`, empty where there is none. */
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

/** A link; `parent` and `joint` are empty for the root. */
export interface LinkView {
  name: string;
  parent: string;
  joint: string;
  visuals: readonly Shape[];
  collisions: readonly Shape[];
  inertia: InertiaView | null;
  place: Place | null;
}

/** A joint whose position is one number, about or along `axis` in the frame of its child. `lower` and `upper` are the slider's ends. `control` is what may be told to it here, `speed` the most it goes at in rad/s or m/s. */
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

/** A thing in the world and where it starts; a `moving` one has its pose in every state. */
export interface BodyView {
  name: string;
  moving: boolean;
  parts: readonly Shape[];
  position: readonly number[];
  quaternion: readonly number[];
}

/** All that is drawn; states refer to it by `revision`, in the order of its links and joints. `world` is the frame that states have their poses in, `ground` the height the floor lies at; `radius` is that of a sphere around the robot and `centre` its middle in the root frame, at zero. */
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

/** The world's bodies are others, and all else of the scene is as it was. */
export interface Things {
  revision: number;
  bodies: readonly BodyView[];
  type: "things";
}

/** Something that goes wrong, in words, from `start` to `stop` s of simulated time; None is for good. */
export interface FaultView {
  number: number;
  words: string;
  start: number;
  stop: number | null;
}

/** A robot or a thing that fell out of the world, at `time` s of simulated time, and is at `z` m now; the robot on show has no name. */
export interface FallenView {
  name: string;
  time: number;
  z: number;
}

/** One moment. `poses` holds x, y, z, qx, qy, qz, qw of each link in the world, flat; `bodies` those of the moving bodies. `frames` names the frames that are no links, and their parents, as tf tells of them; `frame_poses` are theirs in the world. `command` and `twist` are forward speed and turning speed, asked and made; `odometry` is x, y, yaw as the wheels tell it. `rate` is simulated time per wall time. `at` is where it is in seconds along the timeline. `jumps` counts how often the robot was put elsewhere, which is no part of its way. */
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
  type: "state";
}

/** One macro call or include that brought a finding's element. */
export interface Step {
  kind: "macro" | "include";
  name: string;
  place: Place;
}

/** Another place a finding speaks of. */
export interface Note {
  message: string;
  place: Place;
}

/** One diagnostic; `link` is the link it lies in and `fix` what would mend it, or they are empty. */
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
}

/** All findings; `stale` when the scene shows an older, still good description. `serial` counts readings, so that a fix is asked for from the list that is on show. */
export interface Findings {
  serial: number;
  stale: boolean;
  findings: readonly Finding[];
  type: "findings";
}

/** What an attribute that is written as an expression came to: a value for each macro call that made another one; `more` where there are more than are told. */
export interface Hint {
  place: Place;
  values: readonly string[];
  more: boolean;
}

/** The text of one of the description's files; `owners` says which links each line belongs to, `hints` what the expressions in it came to. */
export interface SourceText {
  file: string;
  text: string;
  owners: readonly (readonly string[])[];
  hints: readonly Hint[];
  type: "source";
}

/** A number that the description is made with: a xacro argument or property. `written` is what the file says and `value` what the picture shows; with `is_truth` it is true or false, as 1 or 0. `place` is that of the number. */
export interface Parameter {
  kind: "arg" | "property";
  name: string;
  written: number;
  value: number;
  is_truth: boolean;
  place: Place;
}

/** All of them, in the order they are written. `undo` says what would be undone, if anything, and `redo` what would be done again. */
export interface Parameters {
  parameters: readonly Parameter[];
  undo: string;
  redo: string;
  type: "parameters";
}

/** A topic by its ROS type (`sensor_msgs/msg/LaserScan`). `rate` is messages a second of simulated time, counted where a page hears them, otherwise by the word of who says them, or None; in a recording the mean of all of it. An input is what is meant to come from outside. */
export interface TopicView {
  name: string;
  kind: string;
  rate: number | null;
  is_input: boolean;
}

/** Every topic that a page may hear. */
export interface Topics {
  topics: readonly TopicView[];
  type: "topics";
}

/** One message of a topic that was asked for, its fields by name. `time` is when it was published; with `is_latched` that was before it was asked for. Large arrays are no JSON: such a message comes as a binary frame, as `workbench.topics.relay` says. */
export interface TopicMessage {
  topic: string;
  kind: string;
  time: number;
  is_latched: boolean;
  message: { [name: string]: unknown };
  type: "message";
}

/** The displays' settings from a file, as `workbench.displays.display_settings` has them. `notes` report what is not shown, and `file` is where the page may save, empty where it may not. */
export interface Displays {
  name: string;
  file: string;
  setup: { [name: string]: unknown };
  notes: readonly string[];
  type: "displays";
}

/** Settings as the text of a file of that name, for the browser to keep. */
export interface DisplaysText {
  name: string;
  text: string;
  notes: readonly string[];
  type: "displays_text";
}

/** The settings were written to their file. */
export interface DisplaysSaved {
  file: string;
  notes: readonly string[];
  type: "displays_saved";
}

/** A recording under way: its file, its bytes on disk so far, and the seconds of simulated time in it. */
export interface RecordingView {
  file: string;
  bytes: number;
  seconds: number;
}

/** What there is to go back to, from `start` to `end` in seconds along a timeline that only grows, and what this page is shown of it: the moment `at`, or what is (`live`). With `played` it is that of a recorded file, whole. `paused` and `speed` are of now. Topics that are `silent` had said nothing until that moment. The page `asked` for a moment last, which may be before or after all there is. */
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

/** A moment that was marked, in seconds along the timeline and by the simulation's clock, and what was noted of it. */
export interface Bookmark {
  number: number;
  at: number;
  time: number;
  note: string;
}

/** All of them, in the order of their moments. */
export interface Bookmarks {
  all: readonly Bookmark[];
  type: "bookmarks";
}

/** A recording has ended: its file, and the address that gives it, empty where it is too large. */
export interface Recorded {
  file: string;
  address: string;
  type: "recorded";
}

/** The way since so many resets, as far as it is kept: where the robot was, x and y in m of the world, at moments in s along the timeline. To the points of these numbers, from 0, it did not drive: it was put there. */
export interface Trail {
  resets: number;
  at: readonly number[];
  x: readonly number[];
  y: readonly number[];
  jumps: readonly number[];
  type: "trail";
}

/** What was at moments `at` along the timeline, which were `time` by the simulation's clock: a list of values for each field, null where there was none yet. Of more moments than a picture has columns every second, third and so on is given. */
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

/** A plot as SVG, for the browser to keep. */
export interface PlotDrawn {
  svg: string;
  type: "plot_drawn";
}

/** What was done, in words. */
export interface Told {
  text: string;
  type: "told";
}

/** A message was not obeyed. */
export interface Refused {
  reason: string;
  type: "refused";
}

/** Answered by `Heard` once all that was said before it is taken in: a page that lags is told less. */
export interface Beat {
  type: "beat";
}

/** Forward speed in m/s and turning speed in rad/s, held until changed or the page falls silent. */
export interface Drive {
  linear: number;
  angular: number;
  type: "drive";
}

/** Stand still, whoever is driving. */
export interface Stop {
  type: "stop";
}

export interface SetJoint {
  name: string;
  position: number;
  type: "set_joint";
}

/** All joints at once: to zero or the limit nearest to it, to the middle of their range, or anywhere. */
export interface SetJoints {
  preset: "zero" | "centre" | "random";
  type: "set_joints";
}

export interface Pause {
  paused: boolean;
  type: "pause";
}

/** Simulate a little while paused. */
export interface Advance {
  seconds: number;
  type: "advance";
}

export interface Reset {
  type: "reset";
}

/** Simulated seconds per second of wall time. */
export interface SetSpeed {
  factor: number;
  type: "set_speed";
}

/** Push a link of the robot, or a body of the world, with a force in N along the world's axes for a while of simulated time. */
export interface Push {
  link: string;
  x: number;
  y: number;
  z: number;
  seconds: number;
  type: "push";
}

/** Put something of `About.things` into the running world, with its foot at a place (m, rad). A box is as long, wide and high as asked; everything else has its own size. */
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

/** Take a robot or a thing out of the running world, by the name of one of its bodies. */
export interface Delete {
  name: string;
  type: "delete";
}

/** Put a robot (on the ground) or a thing somewhere else, standing still: metres and radians. */
export interface MoveModel {
  name: string;
  x: number;
  y: number;
  z: number;
  yaw: number;
  type: "move_model";
}

/** Give the robot a speed at once, m/s along the world's axes. */
export interface Kick {
  x: number;
  y: number;
  z: number;
  type: "kick";
}

/** Let something go wrong for some seconds from now on: a link slips with a coefficient of friction, or carries a payload in kg; a joint is blocked; a topic is silent. */
export interface Disturb {
  fault: "slip" | "payload" | "blocked" | "silent";
  target: string;
  value: number;
  seconds: number;
  type: "disturb";
}

/** Let a fault of `State.faults` be over, and not come again. */
export interface EndFault {
  number: number;
  type: "end_fault";
}

/** Everything back to its start while time goes on, or time to 0 while everything goes on. */
export interface ResetPart {
  what: "world" | "time";
  type: "reset_part";
}

/** Let a joint that has a controller go at a speed, rad/s or m/s. */
export interface JointSpeed {
  name: string;
  velocity: number;
  type: "joint_speed";
}

/** Start again in another world: a built-in world's name, with parameters if any, or the file of the world that the run was started in. `seed` is that of whatever is random in a run, as the noise of sensors is. */
export interface SetWorld {
  world: string;
  seed: number;
  type: "set_world";
}

export interface OpenSource {
  file: string;
  type: "open_source";
}

/** Show the robot with another value, the file left as it is. */
export interface SetParameter {
  kind: "arg" | "property";
  name: string;
  value: number;
  type: "set_parameter";
}

/** Show what the file says again. */
export interface DropParameters {
  type: "drop_parameters";
}

/** Write the values on show into the file. */
export interface KeepParameters {
  type: "keep_parameters";
}

/** Replace `was`, which stands at a line and column (1-based) of one of the files, by `text`. */
export interface EditSource {
  file: string;
  line: number;
  column: number;
  was: string;
  text: string;
  type: "edit_source";
}

/** Carry out the fix of a finding of the list with this serial. */
export interface ApplyFix {
  serial: number;
  index: number;
  type: "apply_fix";
}

/** Take back the last change that the page made to a file. */
export interface Undo {
  type: "undo";
}

/** Do again what was taken back last. */
export interface Redo {
  type: "redo";
}

/** Hear a topic: the newest message whenever there is one and this page keeps up. */
export interface Subscribe {
  topic: string;
  type: "subscribe";
}

export interface Unsubscribe {
  topic: string;
  type: "unsubscribe";
}

/** Say something on a topic that is meant for it: a goal, a pose, a point, a command. */
export interface Publish {
  topic: string;
  kind: string;
  message: { [name: string]: unknown };
  type: "publish";
}

/** Write the displays' settings: to the file they came from, or as a text of KBot's or rviz's kind for the browser to keep. */
export interface SaveDisplays {
  kind: "file" | "kbot" | "rviz1" | "rviz2";
  setup: { [name: string]: unknown };
  type: "save_displays";
}

/** Show the settings in a file that was chosen in the browser. */
export interface OpenDisplays {
  name: string;
  text: string;
  type: "open_displays";
}

/** Show the moment `at` seconds along the timeline: to this page alone, or where a recording is played to all. */
export interface Seek {
  at: number;
  type: "seek";
}

/** Show what is, and no longer what was. */
export interface GoLive {
  type: "go_live";
}

/** Let the simulation go on from the moment that this page is shown, or the nearest one that was saved. */
export interface Resume {
  type: "resume";
}

/** Whether a recording that came to its end begins again. */
export interface SetLoop {
  loop: boolean;
  type: "set_loop";
}

/** Begin or end a recording of the simulation, in a file that the server names. */
export interface RecordRun {
  on: boolean;
  type: "record";
}

/** Bookmark the moment `at` seconds along the timeline, which is `time` by the simulation's clock. */
export interface Mark {
  at: number;
  time: number;
  type: "mark";
}

/** Write on a bookmark. */
export interface NoteMark {
  number: number;
  note: string;
  type: "note_mark";
}

export interface RemoveMark {
  number: number;
  type: "remove_mark";
}

/** Say which way the robot took since the simulation was reset so many times. */
export interface AskTrail {
  resets: number;
  type: "ask_trail";
}

/** Say how numbers went from `start` to `end` seconds along the timeline; `number` comes back with the answer. A field is `/topic path.to.it`, or `state path.to.it` of the State, whose positions go by joint. */
export interface AskSeries {
  number: number;
  fields: readonly string[];
  start: number;
  end: number;
  type: "ask_series";
}

/** Draw the same as SVG, of so many pixels; `labels` are the names of the fields. */
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

/** All up to a `Beat` is taken in. */
export interface Heard {
  type: "heard";
}

export type FromServer = About | Scene | Things | State | Findings | SourceText | Parameters | Topics | TopicMessage | Displays | DisplaysText | DisplaysSaved | Timeline | Bookmarks | Recorded | Trail | Series | PlotDrawn | Told | Refused | Beat;

export type FromPage = Drive | Stop | SetJoint | SetJoints | Pause | Advance | Reset | SetSpeed | Push | Spawn | Delete | MoveModel | Kick | Disturb | EndFault | ResetPart | JointSpeed | SetWorld | OpenSource | SetParameter | DropParameters | KeepParameters | EditSource | ApplyFix | Undo | Redo | Subscribe | Unsubscribe | Publish | SaveDisplays | OpenDisplays | Seek | GoLive | Resume | SetLoop | RecordRun | Mark | NoteMark | RemoveMark | AskTrail | AskSeries | DrawPlot | Heard;
