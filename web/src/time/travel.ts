import type { FromPage, State, Timeline } from "../protocol";
import { Signal } from "../signal";
import type { Topics } from "../topics";
import { Bookmarks } from "./bookmarks";

/** Who acts on the simulation wants to see what comes of it. */
const ACTS: ReadonlySet<FromPage["type"]> = new Set([
  "drive",
  "push",
  "reset",
  "advance",
  "spawn",
  "delete",
  "move_model",
  "kick",
  "disturb",
  "end_fault",
  "set_world",
  "publish",
]);
/** Seconds that one step goes. */
const STEP = 0.1;

/** A time in s as the server tells it, in whole milliseconds. */
const inMilliseconds = (seconds: number): number => Math.round(seconds * 1000) / 1000;

/** Where this page stands in time: at what is, at a moment of the last minutes, or within a recording. */
export class TimeTravel {
  readonly timeline = new Signal<Timeline | null>(null);
  readonly bookmarks = new Bookmarks();
  private asked: number | null = null;
  /** The moment that was asked for last, until the server says that it is shown. */
  private wanted: number | null = null;
  /** Whether the server has answered which moment it shows, and its state is still to come. */
  private awaitsState = false;
  /** Whether what topics said here was of a moment that was. */
  private wasPast = false;

  constructor(
    private readonly state: Signal<State | null>,
    private readonly topics: Topics,
    private readonly send: (message: FromPage) => void,
  ) {}

  /** Whether what is on show is over. */
  get isPast(): boolean {
    return this.timeline.value?.live === false;
  }

  /** Whether it is a moment that was: of the last minutes, or of a recording. */
  get isElsewhere(): boolean {
    return this.isPast || this.timeline.value?.played === true;
  }

  /** The moment on show, in seconds along the timeline. */
  get at(): number {
    return this.timeline.value?.at ?? 0;
  }

  /** The moment asked for that is not on show yet, null where none is. */
  get awaited(): number | null {
    return this.wanted;
  }

  /** Whether a moment that was asked for, or its state, is still to come. */
  get seeks(): boolean {
    return this.wanted !== null || this.awaitsState;
  }

  /** A state has arrived; the server sends that of a moment after the timeline that names it. */
  stateArrived(): void {
    this.awaitsState = false;
  }

  /** The server that is connected now shows what is; it may answer before it says so. */
  connected(): void {
    if (this.wasPast) this.topics.forget();
    this.wasPast = this.awaitsState = false;
    this.wanted = null;
  }

  heard(now: Timeline): void {
    if (this.wanted !== null && this.wanted === now.asked) {
      this.wanted = null;
      this.awaitsState = true;
    }
    this.timeline.set(now);
    if (this.wasPast === now.live) this.topics.forget();
    else for (const topic of now.silent) this.topics.forget(topic);
    this.wasPast = !now.live;
    const { state } = this;
    if (this.isPast && state.value !== null) state.set(this.asNow(state.value));
  }

  /** A state with what of time is as it is now, not as it was. */
  asNow(state: State): State {
    const now = this.timeline.value;
    return now === null || now.live || (state.paused === now.paused && state.speed === now.speed)
      ? state
      : { ...state, paused: now.paused, speed: now.speed };
  }

  /** The moment that is now, in seconds along the timeline: states are told of more often than timelines. */
  newest(now: Timeline): number {
    return Math.max(now.end, inMilliseconds(this.state.value?.at ?? 0));
  }

  /** Shows a moment; of many asked for at once the last. */
  seek(at: number): void {
    const waits = this.asked !== null;
    this.asked = this.wanted = Math.max(0, at);
    if (waits) return;
    requestAnimationFrame(() => {
      if (this.asked !== null) this.send({ type: "seek", at: this.asked });
      this.asked = null;
    });
  }

  /** Shows the moment a step before or after the one on show; a step back leaves what is now. */
  step(direction: 1 | -1): void {
    const now = this.timeline.value;
    if (now === null) return;
    const from = this.wanted ?? (this.isElsewhere ? now.at : this.newest(now));
    const at = inMilliseconds(from + direction * STEP);
    // a timeline is sent less often than states, so its end may be more than a step behind
    if (at < (now.played ? now.end : this.newest(now))) this.seek(Math.max(now.start, at));
    else if (now.played) this.seek(now.end);
    else this.goLive();
  }

  goLive(): void {
    const isGoing = this.wanted !== null; // the server may not have said so yet
    this.asked = this.wanted = null;
    if (this.isPast || isGoing) this.send({ type: "go_live" });
  }

  /** Lets the simulation go on from the moment on show. */
  resume(): void {
    this.asked = this.wanted = null;
    if (this.isPast) this.send({ type: "resume" });
  }

  /** Marks the moment on show. */
  mark(): void {
    const state = this.state.value;
    if (this.timeline.value !== null && state !== null)
      this.send({ type: "mark", at: state.at, time: state.time });
  }

  /** Goes to the bookmark before or after the moment on show. */
  jump(direction: 1 | -1): void {
    const now = this.timeline.value;
    if (now === null) return;
    const shown = this.wanted ?? this.state.value?.at ?? now.at;
    const one = this.bookmarks.next(this.isElsewhere ? shown : Infinity, direction, now.start);
    if (one !== undefined) this.seek(one.at);
    else if (direction > 0) this.goLive();
  }

  toggleRecording(): void {
    this.send({ type: "record", on: this.timeline.value?.recording == null });
  }

  /** Called before a message goes out. */
  aboutTo(message: FromPage): void {
    if ((this.isPast || this.wanted !== null) && ACTS.has(message.type)) this.goLive();
  }
}
