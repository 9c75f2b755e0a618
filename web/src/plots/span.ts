import type { App } from "../app";

export const SPANS = { "20": "20 s", "60": "1 min", all: "All" } as const;
export type SpanName = keyof typeof SPANS;

/** The time range of a plot: a span that follows the simulation, a span around the time shown, or a zoomed range. */
export class Span {
  zoom: readonly [number, number] | null = null;
  private chosen: SpanName = "20";
  /** The last range, which stays while it contains the time shown. */
  private before: readonly [number, number] | null = null;

  constructor(private readonly app: App) {}

  get name(): SpanName {
    return this.chosen;
  }

  choose(name: SpanName): void {
    this.chosen = name;
    this.zoom = this.before = null;
  }

  /** The end of the stored time. */
  get end(): number {
    const { timeline } = this.app.travel;
    return Math.max(
      timeline.value?.end ?? 0,
      timeline.value?.played ? 0 : this.app.travel.isPast ? 0 : (this.app.state.value?.at ?? 0),
    );
  }

  get start(): number {
    return this.app.travel.timeline.value?.start ?? 0;
  }

  /** Whether the plot follows the running simulation. */
  get follows(): boolean {
    return this.zoom === null && !this.app.travel.isPast && this.app.travel.timeline.value?.played !== true;
  }

  /** First and last time in the plot. */
  range(): readonly [number, number] {
    if (this.zoom !== null) return this.zoom;
    const { start, end } = this;
    const length = this.name === "all" ? end - start : Number(this.name);
    const { at } = this.app.travel;
    const stays =
      !this.follows &&
      this.before !== null &&
      this.name !== "all" &&
      this.before[0] <= at &&
      at <= this.before[1];
    if (this.before !== null && stays) return this.before;
    const target = this.follows ? end : Math.max(at - length / 2, start);
    const from = Math.max(start, Math.min(target, end - length));
    return (this.before = [from, Math.max(Math.min(from + length, end), from + 1)]);
  }

  /** Zooms about a time. A factor below 1 zooms in. */
  zoomBy(factor: number, about: number): void {
    const [low, high] = this.range();
    const target = Math.min(Math.max((high - low) * factor, 0.1), Math.max(1, this.end - this.start));
    const part = high > low ? Math.min(Math.max((about - low) / (high - low), 0), 1) : 0.5;
    this.zoom = [about - target * part, about + target * (1 - part)];
  }
}
