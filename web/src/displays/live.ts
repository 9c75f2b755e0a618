import { Group, type Object3D } from "three";

import type { App } from "../app";
import type { Scene, State, TopicMessage } from "../protocol";
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
  heard: boolean;
  said: Status | null;
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
      for (const one of this.live.values()) {
        if (one.heard && !topics.some(({ name }) => name === one.topic)) this.empty(one); // the topic no longer exists
        this.connect(one);
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
    const asked = [...this.live.values()].filter(({ config }) => isAsked(config.name));
    return asked.flatMap(({ holder, display }) =>
      display?.beside === undefined ? [holder] : [holder, display.beside],
    );
  }

  private each(action: (display: Display) => void): void {
    for (const { display } of this.live.values()) if (display !== null) action(display);
    this.picture.invalidate();
  }

  private follow(all: readonly DisplayConfig[]): void {
    for (const [id, one] of this.live) if (!all.some((config) => config.id === id)) this.drop(one);
    for (const config of all) {
      const known = this.live.get(config.id);
      if (known === undefined) this.make(config);
      else if (known.config !== config) {
        known.config = config;
        this.configure(known);
      }
    }
    this.report();
    this.picture.invalidate();
  }

  private make(config: DisplayConfig): void {
    const one: Live = {
      config,
      display: null,
      holder: new Group(),
      topic: "",
      stop: null,
      heard: false,
      said: null,
    };
    this.live.set(config.id, one);
    const made = MAKERS[config.kind]!();
    const take = (display: Display): void => {
      one.display = display;
      one.holder.add(display.group);
      this.group.add(one.holder);
      if (this.scene !== null) display.rebuild?.(this.scene);
      display.select?.(this.app.selected.value);
      this.configure(one);
      this.report();
    };
    if (made instanceof Promise) {
      void made.then((make) => this.live.get(config.id) === one && take(make(this.picture)));
    } else {
      take(made(this.picture));
    }
  }

  private drop(one: Live): void {
    this.live.delete(one.config.id);
    if (one.display?.namespaces !== undefined)
      this.app.namespaces.set(new Map([...this.app.namespaces.value].filter(([id]) => id !== one.config.id)));
    one.stop?.();
    one.holder.removeFromParent();
    one.display?.dispose();
  }

  private configure(one: Live): void {
    if (one.display === null) return;
    one.holder.visible = one.config.enabled;
    one.display.configure(valuesOf(one.config), one.config.enabled);
    this.connect(one);
    this.picture.invalidate();
  }

  /** Subscribes to the display's topic while it is enabled. */
  private connect(one: Live): void {
    const kind = kindOf(one.config.kind);
    if (kind.topics.length === 0 || one.display === null) return;
    const topic = one.config.enabled
      ? String(valuesOf(one.config)["topic"]) || this.app.topics.first(kind.topics)
      : "";
    const carried = this.app.topics.list.value.find(({ name }) => name === topic)?.kind;
    const wanted = carried === undefined || kind.topics.includes(carried) ? topic : "";
    if (wanted === one.topic) return;
    one.stop?.();
    one.stop = null;
    this.empty(one);
    one.topic = wanted;
    if (wanted !== "") one.stop = this.app.topics.listen(wanted, (message) => this.hear(one, message));
  }

  /** Clears the displays of a topic, or of all topics, until a new message arrives. */
  private forget(topic: string | undefined): void {
    for (const one of this.live.values()) {
      if (one.topic === "" || (topic !== undefined && one.topic !== topic)) continue;
      this.empty(one);
    }
    this.report();
    this.picture.invalidate();
  }

  private empty(one: Live): void {
    one.display?.clear?.();
    Object.assign(one, { heard: false, said: null });
  }

  private hear(one: Live, message: TopicMessage): void {
    if (one.display?.takesGaps !== true && hasGaps(message.message))
      return this.take(one, { level: "error", reason: `the message contains ${GAPS}` });
    const said = one.display?.message?.(message) ?? null;
    if (said instanceof Promise)
      void said.then(
        (status) =>
          this.live.get(one.config.id) === one && one.topic === message.topic && this.take(one, status),
      );
    else this.take(one, said);
  }

  private take(one: Live, said: Status | null): void {
    const isNew = !one.heard || said?.reason !== one.said?.reason;
    Object.assign(one, { heard: true, said });
    if (isNew) this.report();
    const names = one.display?.namespaces;
    if (names !== undefined && names.join("\n") !== this.app.namespaces.value.get(one.config.id)?.join("\n"))
      this.app.namespaces.set(new Map([...this.app.namespaces.value, [one.config.id, names]]));
    this.picture.invalidate();
  }

  private report(): void {
    this.app.statuses.set(new Map([...this.live].map(([id, one]) => [id, this.status(one)])));
  }

  private status(one: Live): Status {
    if (!one.config.enabled) return { level: "off", reason: "hidden" };
    if (one.display === null) return { level: "ok", reason: "loading" };
    const { topics } = kindOf(one.config.kind);
    if (topics.length === 0) return one.display.status?.() ?? { level: "ok", reason: "" };
    const types = topics.map(shortType).join(" or ");
    const asked = String(valuesOf(one.config)["topic"]);
    const carried = this.app.topics.list.value.find(({ name }) => name === (asked || one.topic));
    if (asked === "" && one.topic === "") return { level: "off", reason: `no topic of type ${types}` };
    if (carried === undefined) return { level: "warn", reason: `topic ${asked || one.topic} does not exist` };
    if (!topics.includes(carried.kind))
      return {
        level: "error",
        reason: `${carried.name} has type ${shortType(carried.kind)}, not ${types}`,
      };
    if (!one.heard && this.app.travel.isPast)
      return { level: "off", reason: `no message of ${one.topic} is stored for this time` };
    if (!one.heard) return { level: "warn", reason: `no message received on ${one.topic} yet` };
    if (one.said !== null) return one.said;
    return { level: "ok", reason: carried.rate === null ? one.topic : `${one.topic}, ${carried.rate} Hz` };
  }
}

/** A type without its package: `LaserScan` for `sensor_msgs/msg/LaserScan`. */
export function shortType(type: string): string {
  return type.split("/").pop() ?? type;
}
