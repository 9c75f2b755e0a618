import type { FromPage, State, Timeline } from "../protocol";
import { Signal } from "../signal";
import type { Topics } from "../topics";
import { Bookmarks } from "./bookmarks";

/** Messages that act on the simulation. They return the page to live, so that the user sees their effect. */
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
/** Seconds of one step. */
const STEP = 0.1;

/** Rounds a time in s to whole milliseconds, as the server does. */
const inMilliseconds = (seconds: number): number => Math.round(seconds * 1000) / 1000;

/** The time that this page shows: live, in the last minutes, or in a recording. */
export class TimeTravel {
  readonly timeline = new Signal<Timeline | null>(null);
  readonly bookmarks = new Bookmarks();
  /** The time to request in the next frame, null if none. */
  private pending: number | null = null;
  /** The time requested last, until the server shows it. */
  private requested: number | null = null;
  /** Whether the server has confirmed the requested time, but not sent its state yet. */
  private awaitsState = false;
  /** Whether the topics' messages here belong to the past. */
  private wasPast = false;

  constructor(
    private readonly state: Signal<State | null>,
    private readonly topics: Topics,
    private readonly send: (message: FromPage) => void,
  ) {}

  /** Whether the page shows the past of a simulation, or a recording that is not live. */
  get isPast(): boolean {
    return this.timeline.value?.live === false;
  }

  /** Whether the page shows the past of a simulation or a recording. */
  get showsHistory(): boolean {
    return this.isPast || this.timeline.value?.played === true;
  }

  /** The time shown, in s along the timeline. */
  get at(): number {
    return this.timeline.value?.at ?? 0;
  }

  /** The requested time that is not shown yet, null if none. */
  get awaited(): number | null {
    return this.requested;
  }

  /** Whether a requested time or its state has not arrived yet. */
  get seeks(): boolean {
    return this.requested !== null || this.awaitsState;
  }

  /** Called when a state arrives. The server sends the state of a time after the timeline message with that time. */
  stateArrived(): void {
    this.awaitsState = false;
  }

  /** Called after a reconnect: the server shows live, and may send messages before it reports this. */
  reconnected(): void {
    if (this.wasPast) this.topics.forget();
    this.wasPast = this.awaitsState = false;
    this.requested = null;
  }

  receive(now: Timeline): void {
    if (this.requested !== null && this.requested === now.asked) {
      this.requested = null;
      this.awaitsState = true;
    }
    this.timeline.set(now);
    if (this.wasPast === now.live) this.topics.forget();
    else for (const topic of now.silent) this.topics.forget(topic);
    this.wasPast = !now.live;
    const { state } = this;
    if (this.isPast && state.value !== null) state.set(this.withCurrentSpeed(state.value));
  }

  /** A state with the current pause and speed instead of those of the time shown. */
  withCurrentSpeed(state: State): State {
    const now = this.timeline.value;
    return now === null || now.live || (state.paused === now.paused && state.speed === now.speed)
      ? state
      : { ...state, paused: now.paused, speed: now.speed };
  }

  /** The current end of the timeline in s. States arrive more often than timelines, so the latest state counts too. */
  newest(now: Timeline): number {
    return Math.max(now.end, inMilliseconds(this.state.value?.at ?? 0));
  }

  /** Requests a time. Of several requests in one frame, only the last is sent. */
  seek(at: number): void {
    const waits = this.pending !== null;
    this.pending = this.requested = Math.max(0, at);
    if (waits) return;
    requestAnimationFrame(() => {
      if (this.pending !== null) this.send({ type: "seek", at: this.pending });
      this.pending = null;
    });
  }

  /** Moves one step back or forward. A step back leaves live. */
  step(direction: 1 | -1): void {
    const now = this.timeline.value;
    if (now === null) return;
    const from = this.requested ?? (this.showsHistory ? now.at : this.newest(now));
    const at = inMilliseconds(from + direction * STEP);
    // timelines arrive less often than states, so their end may be more than a step behind
    if (at < (now.played ? now.end : this.newest(now))) this.seek(Math.max(now.start, at));
    else if (now.played) this.seek(now.end);
    else this.goLive();
  }

  goLive(): void {
    const isGoing = this.requested !== null; // a request may be on its way
    this.pending = this.requested = null;
    if (this.isPast || isGoing) this.send({ type: "go_live" });
  }

  /** Continues the simulation from the time shown. */
  resume(): void {
    this.pending = this.requested = null;
    if (this.isPast) this.send({ type: "resume" });
  }

  /** Bookmarks the time shown. */
  mark(): void {
    const state = this.state.value;
    if (this.timeline.value !== null && state !== null)
      this.send({ type: "mark", at: state.at, time: state.time });
  }

  /** Moves to the previous or next bookmark. */
  jump(direction: 1 | -1): void {
    const now = this.timeline.value;
    if (now === null) return;
    const shown = this.requested ?? this.state.value?.at ?? now.at;
    const bookmark = this.bookmarks.next(this.showsHistory ? shown : Infinity, direction, now.start);
    if (bookmark !== undefined) this.seek(bookmark.at);
    else if (direction > 0) this.goLive();
  }

  toggleRecording(): void {
    this.send({ type: "record", on: this.timeline.value?.recording == null });
  }

  /** Called before a message is sent. */
  beforeSend(message: FromPage): void {
    if ((this.isPast || this.requested !== null) && ACTS.has(message.type)) this.goLive();
  }
}
