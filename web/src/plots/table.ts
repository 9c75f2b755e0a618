import type { App } from "../app";
import type { Series, State } from "../protocol";
import { labelled, type Field } from "./fields";

type Cell = number | null;

/** Seconds more than is seen that are asked for on either side. */
const MARGIN = 1;
/** Moments that are held before the server is asked for fewer. */
const MOST = 9000;
/** Seconds between two moments that are still next to each other. */
const GAP = 0.5;
/** Seconds by which time along the timeline and by the clock differ from rounding alone, at the most. */
const ROUNDED = 0.01;
/** Milliseconds after which an answer is not waited for any more. */
const PATIENCE = 20_000;

/** The numbers on show: what the server kept or recorded, and what came since. */
export class Table {
  /** Seconds along the timeline, and by the simulation's clock. */
  at: number[] = [];
  time: number[] = [];
  columns: Cell[][] = [];
  private chosen: readonly Field[] = [];
  private from = Infinity;
  private to = -Infinity;
  private thinned = false;
  private asked: { number: number; start: number; when: number } | null = null;
  private count = 0;

  constructor(private readonly app: App) {}

  get fields(): readonly Field[] {
    return this.chosen;
  }

  choose(chosen: readonly Field[]): void {
    this.chosen = chosen;
    this.forget();
  }

  /** Knows nothing any more, and asks anew when something is to be shown. */
  forget(): void {
    [this.at, this.time, this.columns] = [[], [], this.chosen.map(() => [])];
    [this.from, this.to, this.thinned] = [Infinity, -Infinity, false];
    this.asked = null;
  }

  /** Sees to it that what lies between two moments is here, soon. */
  need(start: number, end: number): void {
    if (this.chosen.length === 0 || end < start) return;
    const isHere = this.from <= start + 0.1 && this.to >= end - GAP;
    const isFine = !this.thinned || end - start > (this.to - this.from) / 2;
    if (isHere && isFine && this.at.length < MOST) return;
    const now = performance.now();
    if (this.asked !== null && now - this.asked.when < PATIENCE) return; // a new question would end the work on that one
    this.count += 1;
    this.asked = { number: this.count, start: Math.max(0, start - MARGIN), when: now };
    this.app.send({
      type: "ask_series",
      number: this.count,
      fields: this.chosen.map((field) => field.key),
      start: this.asked.start,
      end: end + MARGIN,
    });
  }

  /** Takes an answer; what came here after its end is kept. */
  heard(series: Series): boolean {
    if (series.number !== this.asked?.number) return false;
    const { start } = this.asked;
    this.asked = null;
    const end = series.at.at(-1) ?? -Infinity;
    const follows = this.at.findIndex((at) => at > end + 1e-6);
    const isNext = follows >= 0 && this.at[follows]! - end < GAP && series.end >= this.at[follows]!;
    const rest = <T>(all: T[]): T[] => (isNext ? all.slice(follows) : []);
    this.columns = this.chosen.map((_, index) => [
      ...(series.values[index] ?? []),
      ...rest(this.columns[index] ?? []),
    ]);
    this.at = [...series.at, ...rest(this.at)];
    this.time = [...series.time, ...rest(this.time)];
    this.from = start;
    this.to = Math.max(series.end - MARGIN, this.at.at(-1) ?? -Infinity);
    this.thinned = series.is_thinned;
    return true;
  }

  /** Takes what is now. */
  add(state: State): void {
    const last = this.at.at(-1);
    if (last !== undefined && state.at <= last) return;
    if (last === undefined || state.at - last > GAP) return; // asked for, with what lies between
    this.at.push(state.at);
    this.time.push(state.time);
    this.chosen.forEach((field, index) => this.columns[index]!.push(known(field.value(state))));
    this.to = Math.max(this.to, state.at);
  }

  /** Index of the last moment until one, -1 before the first. */
  indexAt(at: number): number {
    let [low, high] = [0, this.at.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.at[middle]! <= at + 1e-6) low = middle + 1;
      else high = middle;
    }
    return low - 1;
  }

  /** Where, of the rows from `first` to before `last`, the clock was set to another time: the first row after each. */
  jumps(first: number, last: number): number[] {
    const offset = (index: number): number => this.time[index]! - this.at[index]!;
    const found: number[] = [];
    for (let index = Math.max(1, first); index < Math.min(last, this.at.length); index += 1)
      if (Math.abs(offset(index) - offset(index - 1)) > ROUNDED) found.push(index);
    return found;
  }

  csv(start: number, end: number): Blob {
    const quoted = (text: string): string => `"${text.replaceAll('"', '""')}"`;
    const head = ["time [s]", ...this.chosen.map(labelled)].map(quoted).join(",");
    const rows = this.at.flatMap((at, index) =>
      at < start || at > end
        ? []
        : [[this.time[index], ...this.columns.map((column) => column[index] ?? NaN)].join(",")],
    );
    return new Blob([[head, ...rows].join("\n"), "\n"], { type: "text/csv" });
  }
}

/** What is not known is not drawn. */
function known(value: number): Cell {
  return Number.isFinite(value) ? value : null;
}
