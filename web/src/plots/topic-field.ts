import { PLOTTED } from "../program-topics";
import type { State } from "../protocol";
import type { Topics } from "../topics";
import { storedFields, type Field } from "./fields";

/** Limit of samples: a minute at the rate at which the server sends messages to a page. */
const MOST = 2000;

/** The name of a topic's field in the plots. */
export function fieldName(topic: string, path: readonly string[]): string {
  return `${topic} ${path.join(".")}`;
}

/** The topic fields among those that this browser plotted last. */
export function storedTopicFields(topics: Topics): TopicField[] {
  return storedFields().flatMap((name) => {
    const [topic, path] = name.split(" ");
    return topic?.startsWith("/") && path ? [new TopicField(topics, topic, path.split("."))] : [];
  });
}

/** A numeric field of a topic over time. The topic is subscribed while the field is plotted. */
export class TopicField implements Field {
  readonly name: string;
  readonly label: string;
  readonly key: string;
  readonly group = "Topics";
  readonly unit = "";
  private times: number[] = [];
  private values: number[] = [];
  private stop: (() => void) | null = null;

  constructor(
    private readonly topics: Topics,
    readonly topic: string,
    readonly path: readonly string[],
  ) {
    this.name = this.key = fieldName(topic, path);
    this.label = topic.startsWith(PLOTTED) ? topic.slice(PLOTTED.length) : this.name;
  }

  /** Subscribes to the topic or unsubscribes from it. */
  setActive(on: boolean): void {
    if (on === (this.stop !== null)) return;
    this.stop?.();
    [this.times, this.values] = [[], []];
    this.stop = on
      ? this.topics.subscribe(this.topic, ({ time, message }) => this.add(time, numberAt(message, this.path)))
      : null;
  }

  /** The last value before a state. Before the first message it is NaN, which is not drawn. */
  readonly value = (state: State): number => {
    let [low, high] = [0, this.times.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.times[middle]! <= state.time) low = middle + 1;
      else high = middle;
    }
    return this.values[low - 1] ?? NaN;
  };

  private add(time: number, value: number | null): void {
    if (value === null) return;
    if (time < (this.times.at(-1) ?? -Infinity)) [this.times, this.values] = [[], []]; // the simulation was reset
    this.times.push(time);
    this.values.push(value);
    if (this.times.length > MOST * 1.2)
      [this.times, this.values] = [this.times.slice(-MOST), this.values.slice(-MOST)];
  }
}

/** The number at a path of a message, with booleans as 0 or 1. Null if there is no number. */
export function numberAt(message: unknown, path: readonly string[]): number | null {
  let value: unknown = message;
  for (const key of path) value = (value as Record<string, unknown> | null | undefined)?.[key];
  if (typeof value === "boolean") return Number(value);
  return typeof value === "number" ? value : null;
}
