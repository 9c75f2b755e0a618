import type { App } from "../app";
import type { FromPage, State, Timeline } from "../protocol";
import { Signal } from "../signal";
import { Bookmarks } from "./bookmarks";

/** Who acts on the simulation wants to see what comes of it. */
const ACTS: ReadonlySet<FromPage["type"]> = new Set(["drive", "push", "reset", "advance", "spawn", "delete", "move_model", "kick", "disturb", "end_fault", "set_world", "publish"]);

/** Where this page stands in time: at what is, at a moment of the last minutes, or within a recording. */
export class TimeTravel {
  readonly timeline = new Signal<Timeline | null>(null);
  readonly bookmarks = new Bookmarks();
  private asked: number | null = null;

  constructor(private readonly app: App) {}

  /** Whether what is on show is over. */
  get isPast(): boolean {
    return this.timeline.value?.live === false;
  }

  /** The moment on show, in seconds along the timeline. */
  get at(): number {
    return this.timeline.value?.at ?? 0;
  }

  heard(now: Timeline): void {
    const before = this.timeline.value;
    this.timeline.set(now);
    if (before === null || now.end < before.end - 1 || now.start > before.start) this.bookmarks.keepWithin(now.start, now.end);
    if (before?.live !== now.live) this.app.topics.forget();
    else for (const topic of now.silent) this.app.topics.forget(topic);
    const { state } = this.app;
    if (this.isPast && state.value !== null) state.set(this.asNow(state.value));
  }

  /** A state with what of time is as it is now, not as it was. */
  asNow(state: State): State {
    const now = this.timeline.value;
    return now === null || now.live || (state.paused === now.paused && state.speed === now.speed) ? state : { ...state, paused: now.paused, speed: now.speed };
  }

  /** Shows a moment; of many asked for at once the last. */
  seek(at: number): void {
    const waits = this.asked !== null;
    this.asked = at;
    if (waits) return;
    requestAnimationFrame(() => {
      if (this.asked !== null) this.app.send({ type: "seek", at: Math.max(0, this.asked) });
      this.asked = null;
    });
  }

  goLive(): void {
    this.asked = null;
    if (this.isPast) this.app.send({ type: "go_live" });
  }

  /** Lets the simulation go on from the moment on show. */
  resume(): void {
    this.asked = null;
    if (this.isPast) this.app.send({ type: "resume" });
  }

  /** Marks the moment on show. */
  mark(): void {
    if (this.timeline.value !== null) this.bookmarks.add(this.at, this.app.state.value?.time ?? 0);
  }

  /** Goes to the bookmark before or after the moment on show. */
  jump(direction: 1 | -1): void {
    const one = this.bookmarks.next(this.at, direction);
    if (one !== undefined) this.seek(one.at);
    else if (direction > 0) this.goLive();
  }

  toggleRecording(): void {
    this.app.send({ type: "record", on: this.timeline.value?.recording == null });
  }

  /** Called before a message goes out. */
  aboutTo(message: FromPage): void {
    if (this.isPast && ACTS.has(message.type)) this.goLive();
  }
}
