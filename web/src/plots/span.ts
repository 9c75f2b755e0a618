import type { App } from "../app";

export const SPANS = { "20": "20 s", "60": "1 min", all: "All" } as const;
export type SpanName = keyof typeof SPANS;

/** Which part of time a plot shows: what is now or the moment on show within a span, or what was zoomed to. */
export class Span {
  zoom: readonly [number, number] | null = null;
  private chosen: SpanName = "20";
  /** What was shown last, which stays while the moment on show is within it. */
  private before: readonly [number, number] | null = null;

  constructor(private readonly app: App) {}

  get name(): SpanName {
    return this.chosen;
  }

  choose(name: SpanName): void {
    this.chosen = name;
    this.zoom = this.before = null;
  }

  /** The end of all there is. */
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

  /** Whether the plot runs on with what is now. */
  get follows(): boolean {
    return this.zoom === null && !this.app.travel.isPast && this.app.travel.timeline.value?.played !== true;
  }

  /** First and last moment on show. */
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
    const wanted = this.follows ? end : Math.max(at - length / 2, start);
    const from = Math.max(start, Math.min(wanted, end - length));
    return (this.before = [from, Math.max(Math.min(from + length, end), from + 1)]);
  }

  /** Zooms about a moment; a factor below 1 shows more closely. */
  zoomBy(factor: number, about: number): void {
    const [low, high] = this.range();
    const wanted = Math.min(Math.max((high - low) * factor, 0.1), Math.max(1, this.end - this.start));
    const part = high > low ? Math.min(Math.max((about - low) / (high - low), 0), 1) : 0.5;
    this.zoom = [about - wanted * part, about + wanted * (1 - part)];
  }
}
