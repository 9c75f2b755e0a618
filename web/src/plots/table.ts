import type { App } from "../app";
import type { Series, State } from "../protocol";
import { labelled, type Field } from "./fields";

type Cell = number | null;

/** Seconds that are requested beyond each end of the visible range. */
const MARGIN = 1;
/** Limit of rows. Beyond it, the server is asked for a thinned series. */
const MOST = 9000;
/** A longer pause in s between two rows is a gap. */
const GAP = 0.5;
/** Largest difference in s between timeline and simulated time that is due to rounding. */
const ROUNDED = 0.01;
/** Milliseconds after which a request is repeated if it was not answered. */
const PATIENCE = 20_000;

/** The values to plot: those that the server stored, and those of the states since. */
export class Table {
  /** Timeline time and simulated time of each row, in s. */
  at: number[] = [];
  time: number[] = [];
  columns: Cell[][] = [];
  private chosen: readonly Field[] = [];
  private from = Infinity;
  private to = -Infinity;
  private thinned = false;
  private request: { number: number; start: number; when: number } | null = null;
  private count = 0;

  constructor(private readonly app: App) {}

  get fields(): readonly Field[] {
    return this.chosen;
  }

  choose(chosen: readonly Field[]): void {
    this.chosen = chosen;
    this.forget();
  }

  /** Drops all rows, so that the next `need` requests them again. */
  forget(): void {
    [this.at, this.time, this.columns] = [[], [], this.chosen.map(() => [])];
    [this.from, this.to, this.thinned] = [Infinity, -Infinity, false];
    this.request = null;
  }

  /** Requests the rows between two times, unless they are here or already requested. */
  need(start: number, end: number): void {
    if (this.chosen.length === 0 || end < start) return;
    const isHere = this.from <= start + 0.1 && this.to >= end - GAP;
    const isFine = !this.thinned || end - start > (this.to - this.from) / 2;
    if (isHere && isFine && this.at.length < MOST) return;
    const now = performance.now();
    if (this.request !== null && now - this.request.when < PATIENCE) return; // a new request would cancel it
    this.count += 1;
    this.request = { number: this.count, start: Math.max(0, start - MARGIN), when: now };
    this.app.send({
      type: "ask_series",
      number: this.count,
      fields: this.chosen.map((field) => field.key),
      start: this.request.start,
      end: end + MARGIN,
    });
  }

  /** Takes the server's answer, and keeps the rows that were added after its end. Returns whether it was expected. */
  receive(series: Series): boolean {
    if (series.number !== this.request?.number) return false;
    const { start } = this.request;
    this.request = null;
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

  /** Adds the current state. */
  add(state: State): void {
    const last = this.at.at(-1);
    if (last !== undefined && state.at <= last) return;
    if (last === undefined || state.at - last > GAP) return; // `need` requests it, together with the rows in the gap
    this.at.push(state.at);
    this.time.push(state.time);
    this.chosen.forEach((field, index) => this.columns[index]!.push(finiteOrNull(field.value(state))));
    this.to = Math.max(this.to, state.at);
  }

  /** Index of the last row that is not after a time, -1 if there is none. */
  indexAt(at: number): number {
    let [low, high] = [0, this.at.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.at[middle]! <= at + 1e-6) low = middle + 1;
      else high = middle;
    }
    return low - 1;
  }

  /** The rows from `first` to before `last` that are the first after a jump of the simulated time. */
  jumps(first: number, last: number): number[] {
    const offset = (index: number): number => this.time[index]! - this.at[index]!;
    const jumpRows: number[] = [];
    for (let index = Math.max(1, first); index < Math.min(last, this.at.length); index += 1)
      if (Math.abs(offset(index) - offset(index - 1)) > ROUNDED) jumpRows.push(index);
    return jumpRows;
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

/** Replaces NaN and infinity by null, which is not drawn. */
function finiteOrNull(value: number): Cell {
  return Number.isFinite(value) ? value : null;
}
