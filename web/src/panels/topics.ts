import type { App } from "../app";
import { shortType } from "../displays/live";
import { h } from "../dom";
import { icon } from "../icons";
import type { TopicMessage, TopicView } from "../protocol";

/** Limit of list entries shown, and milliseconds between two updates of a message. */
const MOST = 12;
const EVERY = 200;
/** The text in place of an unknown rate, and the tooltips of an unknown and a known rate. */
type RateTexts = readonly [string, readonly [string, string]];
const PLAYED: RateTexts = [
  "\u2013",
  ["Published once, or the rate is unknown", "Mean rate of the recording"],
];
const COUNTED = "Measured while the topic is open here or displayed, otherwise its nominal rate";
const PUBLISHED: RateTexts = [
  "no rate",
  ["No nominal rate. The rate is measured while the topic is open here or displayed.", COUNTED],
];
const INPUT: RateTexts = ["in", ["", COUNTED]];
const LATCHED: RateTexts = [
  "latched",
  ["Published once. Late subscribers receive the last message.", COUNTED],
];

/** The data type of a field that is dragged into the plots. */
export const DRAGGED = "application/x-kbot-field";

/** The list of topics with types and rates. An open topic shows its fields live, and they can be plotted. */
export function topicTree(app: App): HTMLElement {
  const list = h("ul", { class: "topics", "aria-label": "Topics" });
  const rows = new Map<string, Row>();
  app.topics.list.watch((all) => {
    for (const [name, row] of rows) {
      if (all.some((topic) => topic.name === name)) continue;
      row.close();
      row.element.remove();
      rows.delete(name);
    }
    all.forEach((topic, index) => {
      let row = rows.get(topic.name);
      if (row === undefined) rows.set(topic.name, (row = new Row(app, topic.name)));
      row.update(topic);
      if (list.children[index] !== row.element) list.insertBefore(row.element, list.children[index] ?? null);
    });
  });
  return list;
}

class Row {
  readonly element: HTMLElement;
  private readonly head: HTMLButtonElement;
  private readonly rate = h("span", { class: "rate" });
  private readonly type = h("span", { class: "type" });
  private readonly body = h("dl", { class: "fields", hidden: true });
  private readonly values = new Map<string, HTMLElement>();
  private shape = "";
  private drawnAt = 0;
  private stop: (() => void) | null = null;

  constructor(
    private readonly app: App,
    private readonly topic: string,
  ) {
    this.head = h(
      "button",
      { type: "button", class: "head", "aria-expanded": "false", onclick: () => this.toggle() },
      icon("chevron"),
      h("span", { class: "name", title: topic }, topic),
      this.type,
      this.rate,
    );
    this.element = h("li", { "data-topic": topic }, this.head, this.body);
  }

  update({ kind, rate, is_input, is_latched }: TopicView): void {
    this.type.textContent = shortType(kind);
    const isPlayed = this.app.about.value?.mode === "play";
    const [without, title] = isPlayed ? PLAYED : is_input ? INPUT : is_latched ? LATCHED : PUBLISHED;
    const hasRate = rate !== null && !(rate === 0 && is_latched);
    this.rate.textContent = hasRate ? `${rate} Hz` : without;
    this.rate.title = title[hasRate ? 1 : 0];
  }

  close(): void {
    this.stop?.();
    this.stop = null;
  }

  private toggle(): void {
    const open = this.stop === null;
    this.head.setAttribute("aria-expanded", String(open));
    this.body.hidden = !open;
    if (!open) return this.close();
    this.body.replaceChildren(h("dd", { class: "nothing" }, "No message received yet."));
    this.shape = "";
    this.drawnAt = 0;
    this.stop = () => undefined;
    this.stop = this.app.topics.subscribe(this.topic, (message) => this.show(message));
  }

  private show({ message }: TopicMessage): void {
    const now = performance.now();
    if (now - this.drawnAt < EVERY) return;
    this.drawnAt = now;
    const fields = [...leaves(message, [])];
    const shape = fields.map(([path]) => path.join(".")).join(" ");
    if (shape !== this.shape) {
      this.shape = shape;
      this.values.clear();
      this.body.replaceChildren(...fields.flatMap(([path, value]) => this.field(path, value)));
    }
    for (const [path, value] of fields) this.values.get(path.join("."))!.textContent = formatValue(value);
  }

  private field(path: readonly string[], value: unknown): HTMLElement[] {
    const name = path.join(".");
    const shown = h("dd", {});
    this.values.set(name, shown);
    if (typeof value !== "number" && typeof value !== "boolean")
      return [h("dt", { title: name }, h("bdi", {}, name)), shown];
    const plot = h(
      "button",
      {
        type: "button",
        draggable: "true",
        title: `Plot ${name}: click, or drag it into the plots`,
        onclick: () => this.app.plotTopic(this.topic, path),
      },
      h("bdi", {}, name),
    );
    plot.addEventListener("dragstart", (event) =>
      event.dataTransfer?.setData(DRAGGED, JSON.stringify([this.topic, ...path])),
    );
    return [h("dt", {}, plot), shown];
  }
}

/** The leaf values of a message with their paths. Long lists are cut off after `MOST` entries. */
export function* leaves(
  value: unknown,
  path: readonly string[],
): Generator<[readonly string[], unknown], void, undefined> {
  if (ArrayBuffer.isView(value)) return yield [path, `${(value as Uint8Array).length} numbers`];
  if (value === null || typeof value !== "object") return yield [path, value];
  const entries: [string, unknown][] = Object.entries(value);
  for (const [key, inner] of Array.isArray(value) ? entries.slice(0, MOST) : entries)
    yield* leaves(inner, [...path, key]);
  if (Array.isArray(value) && entries.length > MOST) yield [[...path, "…"], `${entries.length - MOST} more`];
}

export function formatValue(value: unknown): string {
  if (typeof value !== "number") return String(value);
  return String(Number(value.toPrecision(6)));
}
