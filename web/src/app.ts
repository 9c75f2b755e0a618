import { Connection, type Channel } from "./connection";
import { DisplaySet, type ViewSettings, type Setup, type Status } from "./displays/set";
import { download } from "./dom";
import { Drafts } from "./drafts";
import { storedOptions, storedTheme, withOption, type Options } from "./options";
import { fieldName, storedTopicFields, TopicField } from "./plots/topic-field";
import type {
  About,
  Displays as DisplayFile,
  Finding,
  Findings,
  FromPage,
  FromServer,
  Parameters,
  Place,
  PlotDrawn,
  ProgramView,
  Recorded,
  RulePage,
  SaveDisplays,
  Scene,
  Series,
  SourceText,
  State,
  Trail,
} from "./protocol";
import { Signal } from "./signal";
import { TimeTravel } from "./time/travel";
import { Topics } from "./topics";
import { PALETTES } from "./view/palette";

/** What the source panel shows: a place, and the finding at it. */
export interface Spot {
  place: Place;
  finding: Finding | null;
  /** Whether the text scrolls to the place, and gets the keyboard focus. */
  scrolls: boolean;
  takesFocus: boolean;
}

/** The state that all parts of the page share: what the server sent and what the user selected. */
export class App {
  readonly about = new Signal<About | null>(null);
  readonly scene = new Signal<Scene | null>(null);
  readonly state = new Signal<State | null>(null);
  readonly findings = new Signal<Findings | null>(null);
  readonly parameters = new Signal<Parameters | null>(null);
  /** The latest notice about a completed action. */
  readonly notice = new Signal<{ text: string } | null>(null);
  readonly refused = new Signal<{ reason: string } | null>(null);
  readonly sources = new Signal<ReadonlyMap<string, SourceText>>(new Map());
  /** The link that the view last zoomed to. */
  readonly focused = new Signal<{ link: string } | null>(null);
  /** The unsaved texts of the source panel. */
  readonly drafts = new Drafts((message) => this.send(message));
  /** The pages of rules that were requested, by code. */
  readonly rules = new Signal<ReadonlyMap<string, RulePage>>(new Map());
  readonly selected = new Signal<string>("");
  readonly spot = new Signal<Spot | null>(null);
  readonly plots = new Signal(false);
  /** The latest time series from the server, and the latest plot it drew as SVG. */
  readonly series = new Signal<Series | null>(null);
  readonly plotImage = new Signal<PlotDrawn | null>(null);
  /** The robot's trail, as last sent by the server. */
  readonly trail = new Signal<Trail | null>(null);
  /** The user's program that drives the simulation, null if there is none. */
  readonly program = new Signal<ProgramView | null>(null);
  /** The line that the program printed last. */
  readonly printed = new Signal("");
  /** The recording that ended last. */
  readonly recorded = new Signal<Recorded | null>(null);
  /** Whether the topics and the log are shown. */
  readonly traffic = new Signal(false);
  readonly topics = new Topics((message) => this.send(message));
  /** All topic fields that were plotted on this page. */
  readonly topicFields = new Signal<readonly TopicField[]>(storedTopicFields(this.topics));
  readonly options = storedOptions();
  /** Whether the view shows the whole world and stays where it is, although `follow` is on. */
  readonly overview = new Signal(false);
  readonly displays = new DisplaySet();
  /** The status of each display, by its id. */
  readonly statuses = new Signal<ReadonlyMap<number, Status>>(new Map());
  /** Marker namespaces that each display received, by the display's id. */
  readonly namespaces = new Signal<ReadonlyMap<number, readonly string[]>>(new Map());
  /** The file that the displays were loaded from, and notes on unsupported parts of it. */
  readonly displayFile = new Signal<Omit<DisplayFile, "setup" | "type"> | null>(null);
  /** Whether the browser draws the view, cannot draw it, or lost its WebGL context. */
  readonly rendering = new Signal<"drawn" | "never" | "lost">("drawn");
  /** The view that a display file asks for. */
  readonly requestedView = new Signal<ViewSettings | null>(null);
  /** Returns the current view, null before there is one. */
  currentView: () => ViewSettings | null = () => null;
  readonly travel = new TimeTravel(this.state, this.topics, (message) => this.send(message));
  readonly theme = storedTheme();
  readonly connection: Channel;
  frozen = false;
  private awaitsDisplays = true;

  constructor(
    connect: (receive: (message: FromServer) => void) => Channel = (receive) => new Connection(receive),
  ) {
    this.connection = connect((message) => this.receive(message));
  }

  /** Whether the page can edit the description. A saved page and a recording cannot be edited. */
  get canWrite(): boolean {
    return this.connection.writes && this.about.value?.mode !== "play";
  }

  /** Whether the camera follows the robot. */
  get follows(): boolean {
    return this.options.value.follow && !this.overview.value;
  }

  send(message: FromPage): void {
    this.travel.beforeSend(message);
    this.connection.send(message);
  }

  /** The names of all frames. */
  frames(): readonly string[] {
    const world = this.scene.value?.world ?? "";
    const links = (this.scene.value?.links ?? []).map((link) => link.name);
    return [
      ...(links.includes(world) ? [] : [world]),
      ...links,
      ...(this.state.value?.frames ?? []).map(([name]) => name ?? ""),
    ];
  }

  setOption<K extends keyof Options>(name: K, value: Options[K]): void {
    this.options.set(withOption(this.options.value, name, value));
  }

  /** Loads display settings from a file that the user selected. */
  openDisplays(name: string, text: string): void {
    this.awaitsDisplays = true;
    this.send({ type: "open_displays", name, text });
  }

  saveDisplays(kind: SaveDisplays["kind"]): void {
    const { globals, displays } = this.displays.setup;
    const view = this.currentView();
    const forRviz =
      kind === "file" ? this.displayFile.value?.file.endsWith(".rviz") === true : kind !== "kbot";
    // rviz has no themes, so its file gets the background colour of the current theme
    const background =
      globals["background"] || `#${PALETTES[this.theme.value].background.toString(16).padStart(6, "0")}`;
    this.send({
      type: "save_displays",
      kind,
      setup: {
        globals: forRviz ? { ...globals, background } : globals,
        displays,
        ...(view === null ? {} : { view }),
      },
    });
  }

  /** Applies a file's settings, unless they were applied before: a reconnect must not undo changes made here. */
  private applyDisplayFile({ name, file, setup, notes }: DisplayFile): void {
    this.displayFile.set({ name, file, notes });
    if (!this.awaitsDisplays || !("globals" in setup)) return;
    this.awaitsDisplays = false;
    const { view, ...settings } = { displays: this.displays.setup.displays, ...setup } as unknown as Setup & {
      view?: ViewSettings;
    };
    // every page requests the server's file again, so only a file opened here is stored in the browser
    this.displays.replace(settings, file === "" && name !== "");
    if (view !== undefined) this.requestedView.set(view);
  }

  /** Plots a numeric field of a topic. */
  plotTopic(topic: string, path: readonly string[]): void {
    const name = fieldName(topic, path);
    const others = this.topicFields.value.filter((field) => field.name !== name);
    const field =
      this.topicFields.value.find((field) => field.name === name) ?? new TopicField(this.topics, topic, path);
    this.plots.set(true);
    this.topicFields.set([...others, field]);
  }

  /** The findings of the text that the page shows: of the unsaved texts if there are any, otherwise of the files. */
  get shownFindings(): readonly Finding[] {
    return this.drafts.findings.value ?? this.findings.value?.findings ?? [];
  }

  /** Applies the fix of a finding to the unsaved text, or to the files if there is no unsaved text. */
  applyFix(finding: Finding): void {
    const index = this.findings.value?.findings.indexOf(finding) ?? -1;
    if (this.drafts.isEmpty && index >= 0)
      this.send({ type: "apply_fix", serial: this.findings.value?.serial ?? 0, index });
    else this.drafts.edits.set([...finding.edits]);
  }

  /** Opens the description in the source panel, to type in it. */
  edit(): void {
    const file = this.about.value?.file;
    if (file === undefined) return;
    this.show({ file, line: 1, column: 1, length: 0 }, null, true);
  }

  /** Saves the unsaved text of a file. */
  save(file: string): void {
    if (this.connection.link.value === "live") this.drafts.save(file);
    else
      this.refused.set({
        reason: "The text is not saved, because the server cannot be reached. Save again later.",
      });
  }

  /** Shows a place in the source panel, with the finding at it if any. */
  show(place: Place, finding: Finding | null = null, takesFocus = false): void {
    if (!this.sources.value.has(place.file)) this.send({ type: "open_source", file: place.file });
    this.spot.set({ place, finding, scrolls: true, takesFocus });
  }

  selectLink(name: string, showSource: boolean): void {
    this.selected.set(name);
    const place = this.scene.value?.links.find((link) => link.name === name)?.place;
    if (showSource && place) this.show(place);
  }

  selectFinding(finding: Finding): void {
    this.selected.set(finding.link);
    if (finding.place) this.show(finding.place, finding);
  }

  private receive(message: FromServer): void {
    switch (message.type) {
      case "about":
        this.about.set({ ...message, client: message.client || (this.about.value?.client ?? 0) });
        if (message.client > 0) {
          this.travel.reconnected();
          this.topics.resubscribe();
        }
        this.refreshSources();
        break;
      case "displays":
        this.applyDisplayFile(message);
        break;
      case "displays_text":
        download(new Blob([message.text], { type: "application/yaml" }), message.name);
        this.notice.set({ text: [`Saved as ${message.name}.`, ...message.notes].join(" ") });
        break;
      case "displays_saved":
        this.notice.set({ text: [`Saved to ${message.file}.`, ...message.notes].join(" ") });
        break;
      case "scene":
        if (JSON.stringify(message) === JSON.stringify(this.scene.value)) break; // the server sends it again after a reconnect
        if (this.scene.value === null) this.awaitsDisplays = false;
        this.scene.set(message);
        if (!message.links.some((link) => link.name === this.selected.value)) this.selected.set("");
        break;
      case "things":
        if (this.scene.value !== null)
          this.scene.set({ ...this.scene.value, revision: message.revision, bodies: message.bodies });
        break;
      case "state":
        this.travel.stateArrived();
        if (!this.frozen && message.revision === this.scene.value?.revision)
          this.state.set(this.travel.withCurrentSpeed(message));
        break;
      case "timeline":
        this.travel.receive(message);
        break;
      case "findings":
        this.findings.set(message);
        if (this.drafts.findings.value === null) this.updateSpot(message.findings);
        this.drafts.check();
        break;
      case "source":
        this.sources.set(new Map(this.sources.value).set(message.file, message));
        break;
      case "completions":
        this.drafts.completions.set(message);
        break;
      case "texts_checked":
        this.drafts.checked(message);
        if (!this.drafts.isEmpty) this.updateSpot(message.findings);
        break;
      case "source_saved":
        this.drafts.saved(message);
        if (message.sent !== message.text)
          this.notice.set({ text: "Saved, together with the changes of another program." });
        break;
      case "source_conflict":
        this.drafts.conflict.set(message);
        break;
      case "rule_page":
        this.rules.set(new Map(this.rules.value).set(message.code, message));
        break;
      case "topics":
        this.topics.setList(message);
        break;
      case "message":
        if (!this.frozen) this.topics.receive(message);
        break;
      case "bookmarks":
        this.travel.bookmarks.all.set(message.all);
        break;
      case "recorded":
        this.recorded.set(message);
        break;
      case "trail":
        this.trail.set(message);
        break;
      case "series":
        this.series.set(message);
        break;
      case "plot_drawn":
        this.plotImage.set(message);
        break;
      case "program":
        if (message.phase === "running" && this.program.value?.phase !== "running") this.printed.set("");
        this.program.set(message);
        break;
      case "notice":
        this.notice.set({ text: message.text });
        break;
      case "parameters":
        this.parameters.set(message);
        break;
      case "refused":
        this.refused.set({ reason: message.reason });
        break;
    }
  }

  /** Updates the finding in the source panel, or removes it once it is fixed. */
  private updateSpot(now: readonly Finding[]): void {
    const spot = this.spot.value;
    if (spot?.finding == null) return;
    const { code, message, place } = spot.finding;
    const quiet = { scrolls: false, takesFocus: false };
    const still = now.find(
      (other) => other.code === code && other.message === message && other.place?.line === place?.line,
    );
    this.spot.set(
      still?.place
        ? { ...quiet, place: still.place, finding: still }
        : { ...quiet, place: { ...spot.place, length: 0 }, finding: null },
    );
  }

  /** The files may have changed, so this requests the open one again and drops the others. */
  private refreshSources(): void {
    const open = this.spot.value?.place.file;
    const kept = open === undefined ? undefined : this.sources.value.get(open);
    this.sources.set(kept ? new Map([[kept.file, kept]]) : new Map());
    if (open !== undefined) this.send({ type: "open_source", file: open });
  }
}
