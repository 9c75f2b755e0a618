import { Group, type Object3D } from "three";

import type { App } from "../app";
import type { Scene, State, TopicMessage, TopicView } from "../protocol";
import type { Display, Picture } from "./display";
import { GAPS, hasGaps } from "./gaps";
import { MAKERS } from "./registry";
import { kindOf, valuesOf, type DisplayConfig, type Status } from "./set";

/** A display with its subscription and status. `display` is null while its code is loading. */
interface Live {
  config: DisplayConfig;
  display: Display | null;
  /** The group that is hidden while the display is disabled. */
  holder: Group;
  topic: string;
  stop: (() => void) | null;
  hasMessage: boolean;
  problem: Status | null;
}

/** Creates, configures, updates and removes the displays in the view, as the settings change. */
export class LiveDisplays {
  readonly group = new Group();
  private readonly live = new Map<number, Live>();
  private scene: Scene | null = null;
  /** The objects that fell out of the world and the second of their last report: the status changes once a second. */
  private fallen = "";

  constructor(
    private readonly app: App,
    private readonly picture: Picture,
  ) {
    app.displays.all.watch((all) => this.follow(all));
    app.topics.list.watch((topics) => {
      for (const entry of this.live.values()) {
        if (entry.hasMessage && !topics.some(({ name }) => name === entry.topic)) this.empty(entry); // the topic no longer exists
        this.connect(entry);
      }
      this.report();
      this.picture.invalidate();
    });
    app.topics.forgotten.watch((what) => what !== null && this.forget(what.topic));
    app.findings.watch(() => this.report());
    app.selected.watch((link) => this.each((display) => display.select?.(link)));
  }

  rebuild(scene: Scene): void {
    this.scene = scene;
    this.each((display) => display.rebuild?.(scene));
    this.report();
  }

  /** Passes a state to all displays. */
  state(state: State): void {
    for (const { display } of this.live.values()) display?.state?.(state);
    const fallen = state.fallen.map(({ name }) => `${name} ${Math.floor(state.time)}`).join();
    if (fallen === this.fallen) return;
    this.fallen = fallen;
    this.report();
  }

  frame(): void {
    const shown = [...this.live.values()].filter(({ config }) => config.enabled);
    for (const { display } of shown) display?.frame?.();
    for (const { display } of shown) display?.look?.();
  }

  /** The objects that the displays with matching names draw. */
  objects(isAsked: (name: string) => boolean): Object3D[] {
    const requested = [...this.live.values()].filter(({ config }) => isAsked(config.name));
    return requested.flatMap(({ holder, display }) =>
      display?.beside === undefined ? [holder] : [holder, display.beside],
    );
  }

  private each(action: (display: Display) => void): void {
    for (const { display } of this.live.values()) if (display !== null) action(display);
    this.picture.invalidate();
  }

  private follow(all: readonly DisplayConfig[]): void {
    for (const [id, entry] of this.live) if (!all.some((config) => config.id === id)) this.drop(entry);
    for (const config of all) {
      const existing = this.live.get(config.id);
      if (existing === undefined) this.create(config);
      else if (existing.config !== config) {
        existing.config = config;
        this.configure(existing);
      }
    }
    this.report();
    this.picture.invalidate();
  }

  private create(config: DisplayConfig): void {
    const entry: Live = {
      config,
      display: null,
      holder: new Group(),
      topic: "",
      stop: null,
      hasMessage: false,
      problem: null,
    };
    this.live.set(config.id, entry);
    const made = MAKERS[config.kind]!();
    const setProblem = (display: Display): void => {
      entry.display = display;
      entry.holder.add(display.group);
      this.group.add(entry.holder);
      if (this.scene !== null) display.rebuild?.(this.scene);
      display.select?.(this.app.selected.value);
      this.configure(entry);
      this.report();
    };
    if (made instanceof Promise) {
      void made.then((create) => this.live.get(config.id) === entry && setProblem(create(this.picture)));
    } else {
      setProblem(made(this.picture));
    }
  }

  private drop(entry: Live): void {
    this.live.delete(entry.config.id);
    if (entry.display?.namespaces !== undefined)
      this.app.namespaces.set(
        new Map([...this.app.namespaces.value].filter(([id]) => id !== entry.config.id)),
      );
    entry.stop?.();
    entry.holder.removeFromParent();
    entry.display?.dispose();
  }

  private configure(entry: Live): void {
    if (entry.display === null) return;
    entry.holder.visible = entry.config.enabled;
    entry.display.configure(valuesOf(entry.config), entry.config.enabled);
    this.connect(entry);
    this.picture.invalidate();
  }

  /** Subscribes to the display's topic while it is enabled. */
  private connect(entry: Live): void {
    const kind = kindOf(entry.config.kind);
    if (kind.topics.length === 0 || entry.display === null) return;
    const topic = entry.config.enabled
      ? String(valuesOf(entry.config)["topic"]) || this.app.topics.firstOfType(kind.topics)
      : "";
    const topicView = this.app.topics.list.value.find(({ name }) => name === topic)?.kind;
    const target = topicView === undefined || kind.topics.includes(topicView) ? topic : "";
    if (target === entry.topic) return;
    entry.stop?.();
    entry.stop = null;
    this.empty(entry);
    entry.topic = target;
    if (target !== "")
      entry.stop = this.app.topics.subscribe(target, (message) => this.receive(entry, message));
  }

  /** Clears the displays of a topic, or of all topics, until a new message arrives. */
  private forget(topic: string | undefined): void {
    for (const entry of this.live.values()) {
      if (entry.topic === "" || (topic !== undefined && entry.topic !== topic)) continue;
      this.empty(entry);
    }
    this.report();
    this.picture.invalidate();
  }

  private empty(entry: Live): void {
    entry.display?.clear?.();
    Object.assign(entry, { hasMessage: false, problem: null });
  }

  private receive(entry: Live, message: TopicMessage): void {
    if (entry.display?.takesGaps !== true && hasGaps(message.message))
      return this.setProblem(entry, { level: "error", reason: `the message contains ${GAPS}` });
    const problem = entry.display?.message?.(message) ?? null;
    if (problem instanceof Promise)
      void problem.then(
        (status) =>
          this.live.get(entry.config.id) === entry &&
          entry.topic === message.topic &&
          this.setProblem(entry, status),
      );
    else this.setProblem(entry, problem);
  }

  private setProblem(entry: Live, problem: Status | null): void {
    const isNew = !entry.hasMessage || problem?.reason !== entry.problem?.reason;
    Object.assign(entry, { hasMessage: true, problem });
    if (isNew) this.report();
    const names = entry.display?.namespaces;
    if (
      names !== undefined &&
      names.join("\n") !== this.app.namespaces.value.get(entry.config.id)?.join("\n")
    )
      this.app.namespaces.set(new Map([...this.app.namespaces.value, [entry.config.id, names]]));
    this.picture.invalidate();
  }

  private report(): void {
    this.app.statuses.set(new Map([...this.live].map(([id, entry]) => [id, this.status(entry)])));
  }

  private status(entry: Live): Status {
    if (!entry.config.enabled) return { level: "off", reason: "hidden" };
    if (entry.display === null) return { level: "ok", reason: "loading" };
    const { topics } = kindOf(entry.config.kind);
    if (topics.length === 0) return entry.display.status?.() ?? { level: "ok", reason: "" };
    const types = topics.map(shortType).join(" or ");
    const requested = String(valuesOf(entry.config)["topic"]);
    const topicView = this.app.topics.list.value.find(({ name }) => name === (requested || entry.topic));
    if (requested === "" && entry.topic === "") return { level: "off", reason: `no topic of type ${types}` };
    if (topicView === undefined)
      return { level: "warn", reason: `topic ${requested || entry.topic} does not exist` };
    if (!topics.includes(topicView.kind))
      return {
        level: "error",
        reason: `${topicView.name} has type ${shortType(topicView.kind)}, not ${types}`,
      };
    if (!entry.hasMessage && this.app.travel.isPast)
      return { level: "off", reason: `no message of ${entry.topic} is stored for this time` };
    if (!entry.hasMessage) return { level: "warn", reason: `no message received on ${entry.topic} yet` };
    if (entry.problem !== null) return entry.problem;
    return {
      level: "ok",
      reason: `${entry.topic}${rateOf(topicView)}`,
    };
  }
}

/** The rate of a topic, after a comma. Empty if it is unknown. */
function rateOf({ rate, is_latched }: TopicView): string {
  if (is_latched && !rate) return ", latched";
  return rate === null ? "" : `, ${rate} Hz`;
}

/** A type without its package: `LaserScan` for `sensor_msgs/msg/LaserScan`. */
export function shortType(type: string): string {
  return type.split("/").pop() ?? type;
}
