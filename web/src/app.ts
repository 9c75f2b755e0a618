import { Connection, type Line } from "./connection";
import { DisplaySet, type LookingFrom, type Setup, type Status } from "./displays/set";
import { download } from "./dom";
import { rememberedOptions, rememberedTheme, withOption, type Options } from "./options";
import { fieldName, rememberedTopics, TopicField } from "./plots/topic-field";
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
  Recorded,
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

/** What the source panel shows: a place, and what is said about it. */
export interface Spot {
  place: Place;
  finding: Finding | null;
}

/** What the parts of the page share: what the server said, and what is chosen here. */
export class App {
  readonly about = new Signal<About | null>(null);
  readonly scene = new Signal<Scene | null>(null);
  readonly state = new Signal<State | null>(null);
  readonly findings = new Signal<Findings | null>(null);
  readonly parameters = new Signal<Parameters | null>(null);
  /** What was done, in words. */
  readonly told = new Signal<{ text: string } | null>(null);
  readonly refused = new Signal<{ reason: string } | null>(null);
  readonly sources = new Signal<ReadonlyMap<string, SourceText>>(new Map());
  /** The link that was last asked to fill the picture. */
  readonly focused = new Signal<{ link: string } | null>(null);
  readonly selected = new Signal<string>("");
  readonly spot = new Signal<Spot | null>(null);
  readonly plots = new Signal(false);
  /** How numbers went, as the server said last, and what it drew of them. */
  readonly series = new Signal<Series | null>(null);
  readonly drawing = new Signal<PlotDrawn | null>(null);
  /** The way that the robot took, as the server said last. */
  readonly trail = new Signal<Trail | null>(null);
  /** A recording that has ended. */
  readonly recorded = new Signal<Recorded | null>(null);
  /** Whether topics and the log are seen. */
  readonly traffic = new Signal(false);
  readonly topics = new Topics((message) => this.send(message));
  /** The fields of topics that were ever plotted here. */
  readonly topicFields = new Signal<readonly TopicField[]>(rememberedTopics(this.topics));
  readonly options = rememberedOptions();
  readonly displays = new DisplaySet();
  /** How each display fares, by its number. */
  readonly statuses = new Signal<ReadonlyMap<number, Status>>(new Map());
  /** Namespaces of the markers that displays heard of, by the displays' numbers. */
  readonly namespaces = new Signal<ReadonlyMap<number, readonly string[]>>(new Map());
  /** The file that the displays came from, and what of it is not shown. */
  readonly displayFile = new Signal<Omit<DisplayFile, "setup" | "type"> | null>(null);
  /** Whether the browser draws the picture, never could, or lost what it draws with. */
  readonly drawn = new Signal<"drawn" | "never" | "lost">("drawn");
  /** A view that a file asks for. */
  readonly asked = new Signal<LookingFrom | null>(null);
  /** From where one looks now. */
  lookingFrom: () => LookingFrom | null = () => null;
  readonly travel = new TimeTravel(this.state, this.topics, (message) => this.send(message));
  readonly theme = rememberedTheme();
  readonly connection: Line;
  frozen = false;
  private awaitsDisplays = true;

  constructor(connect: (hear: (message: FromServer) => void) => Line = (hear) => new Connection(hear)) {
    this.connection = connect((message) => this.hear(message));
  }

  /** Whether the description can be changed from here: not in a page that was saved, nor that of a recording. */
  get canWrite(): boolean {
    return this.connection.writes && this.about.value?.mode !== "play";
  }

  send(message: FromPage): void {
    this.travel.aboutTo(message);
    this.connection.send(message);
  }

  /** Names of all frames there are. */
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

  /** Asks for the settings in a file that was chosen here. */
  openDisplays(name: string, text: string): void {
    this.awaitsDisplays = true;
    this.send({ type: "open_displays", name, text });
  }

  saveDisplays(kind: SaveDisplays["kind"]): void {
    const { globals, displays } = this.displays.setup;
    const view = this.lookingFrom();
    const forRviz =
      kind === "file" ? this.displayFile.value?.file.endsWith(".rviz") === true : kind !== "kbot";
    // rviz has no themes: what is behind everything is as it is here
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

  /** Takes over a file's settings: what was changed here since outlives a lost connection. */
  private takeDisplays({ name, file, setup, notes }: DisplayFile): void {
    this.displayFile.set({ name, file, notes });
    if (!this.awaitsDisplays || !("globals" in setup)) return;
    this.awaitsDisplays = false;
    const { view, ...settings } = { displays: this.displays.setup.displays, ...setup } as unknown as Setup & {
      view?: LookingFrom;
    };
    // what a file on the server says is asked for anew by each page, and is not this browser's own
    this.displays.replace(settings, file === "" && name !== "");
    if (view !== undefined) this.asked.set(view);
  }

  /** Plots a number of a topic's messages. */
  plotTopic(topic: string, path: readonly string[]): void {
    const name = fieldName(topic, path);
    const others = this.topicFields.value.filter((field) => field.name !== name);
    const field =
      this.topicFields.value.find((one) => one.name === name) ?? new TopicField(this.topics, topic, path);
    this.plots.set(true);
    this.topicFields.set([...others, field]);
  }

  /** Shows a place in the source panel, with a finding's words where there is one. */
  show(place: Place, finding: Finding | null = null): void {
    if (!this.sources.value.has(place.file)) this.send({ type: "open_source", file: place.file });
    this.spot.set({ place, finding });
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

  private hear(message: FromServer): void {
    switch (message.type) {
      case "about":
        this.about.set({ ...message, client: message.client || (this.about.value?.client ?? 0) });
        if (message.client > 0) {
          this.travel.connected();
          this.topics.connected();
        }
        this.refreshSources();
        break;
      case "displays":
        this.takeDisplays(message);
        break;
      case "displays_text":
        download(new Blob([message.text], { type: "application/yaml" }), message.name);
        this.told.set({ text: [`Kept as ${message.name}.`, ...message.notes].join(" ") });
        break;
      case "displays_saved":
        this.told.set({ text: [`Saved to ${message.file}.`, ...message.notes].join(" ") });
        break;
      case "scene":
        if (JSON.stringify(message) === JSON.stringify(this.scene.value)) break; // as after a lost connection
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
          this.state.set(this.travel.asNow(message));
        break;
      case "timeline":
        this.travel.heard(message);
        break;
      case "findings":
        this.findings.set(message);
        this.forgetMended(message);
        break;
      case "source":
        this.sources.set(new Map(this.sources.value).set(message.file, message));
        break;
      case "topics":
        this.topics.listed(message);
        break;
      case "message":
        if (!this.frozen) this.topics.heard(message);
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
        this.drawing.set(message);
        break;
      case "told":
        this.told.set({ text: message.text });
        break;
      case "parameters":
        this.parameters.set(message);
        break;
      case "refused":
        this.refused.set({ reason: message.reason });
        break;
    }
  }

  /** A finding that is no more has nothing to say in the source panel. */
  private forgetMended(now: Findings): void {
    const spot = this.spot.value;
    if (spot?.finding == null) return;
    const { code, message, place } = spot.finding;
    const still = now.findings.find(
      (one) => one.code === code && one.message === message && one.place?.line === place?.line,
    );
    this.spot.set(
      still?.place
        ? { place: still.place, finding: still }
        : { place: { ...spot.place, length: 0 }, finding: null },
    );
  }

  /** The files may have changed: asks anew for the one on show, and forgets the others. */
  private refreshSources(): void {
    const open = this.spot.value?.place.file;
    const kept = open === undefined ? undefined : this.sources.value.get(open);
    this.sources.set(kept ? new Map([[kept.file, kept]]) : new Map());
    if (open !== undefined) this.send({ type: "open_source", file: open });
  }
}
