import type { App } from "./app";
import { takesKeys } from "./focus";
import { Signal } from "./signal";

const KEYS: Record<string, readonly [number, number]> = {
  KeyW: [1, 0],
  ArrowUp: [1, 0],
  KeyS: [-1, 0],
  ArrowDown: [-1, 0],
  KeyA: [0, 1],
  ArrowLeft: [0, 1],
  KeyD: [0, -1],
  ArrowRight: [0, -1],
};
const SEND_EVERY = 50;
/** Milliseconds between two commands after which the computer was asleep: keys may have been let go of meanwhile. */
const ASLEEP = 5000;

/** Forward and to the left, from -1 to 1, by a pad and held keys; opposite keys cancel out. */
export function stickOf(pad: readonly [number, number], held: Iterable<string>): [number, number] {
  let [forward, left] = pad;
  for (const key of held) {
    forward += KEYS[key]![0];
    left += KEYS[key]![1];
  }
  const clamp = (value: number): number => Math.min(1, Math.max(-1, value));
  return [clamp(forward), clamp(left)];
}

/** Turns held keys and the pad into commands, twenty a second while held, and zero on release. What is held while
 * all is stopped, or the connection is lost, drives only when it is pressed again. */
export class Driver {
  /** What is asked for, as parts of the limits: forward and to the left. */
  readonly stick = new Signal<readonly [number, number]>([0, 0]);
  /** The part of the limits that full means. */
  readonly share = new Signal(0.6);
  private readonly held = new Set<string>();
  private pad: readonly [number, number] = [0, 0];
  /** Whether the pad is to come to rest before it counts again. */
  private isPadDropped = false;
  private sentAt = 0;
  private timer: ReturnType<typeof setInterval> | null = null;

  constructor(private readonly app: App) {
    addEventListener("keydown", (event) => this.press(event));
    addEventListener("keyup", (event) => this.release(event));
    addEventListener("blur", () => this.stop());
    app.connection.link.watch(() => this.isCut && this.stop());
    document.addEventListener("visibilitychange", () => document.hidden && this.stop());
  }

  /** The pad's knob, from -1 to 1 forward and to the left. */
  setPad(forward: number, left: number): void {
    const rests = forward === 0 && left === 0;
    this.isPadDropped = !rests && (this.isPadDropped || this.isCut);
    this.pad = this.isPadDropped ? [0, 0] : [forward, left];
    this.update();
  }

  stop(): void {
    this.held.clear();
    this.isPadDropped ||= this.pad[0] !== 0 || this.pad[1] !== 0;
    this.pad = [0, 0];
    this.update();
  }

  private press(event: KeyboardEvent): void {
    if (event.ctrlKey || event.metaKey || event.altKey || takesKeys(event)) return;
    if (!(event.code in KEYS) || !this.canDrive || this.isCut) return;
    if (event.shiftKey && event.code.startsWith("Arrow")) return; // turns the view
    if (this.app.travel.isPast && (event.code === "ArrowLeft" || event.code === "ArrowRight")) return; // goes through time
    event.preventDefault();
    // a key that was let go of by a stop counts again when it is pressed again
    if (event.repeat) return;
    this.held.add(event.code);
    this.update();
  }

  private release(event: KeyboardEvent): void {
    if (this.held.delete(event.code)) this.update();
  }

  private get canDrive(): boolean {
    const about = this.app.about.value;
    return about?.mode === "sim" && about.cannot_drive === "";
  }

  private get isCut(): boolean {
    return ["lost", "full"].includes(this.app.connection.link.value);
  }

  private update(): void {
    const [forward, left] = stickOf(this.pad, this.held);
    this.stick.set([forward, left]);
    const idle = forward === 0 && left === 0 && this.held.size === 0;
    if (idle && this.timer !== null) {
      clearInterval(this.timer);
      this.timer = null;
      this.send();
    } else if (!idle && this.timer === null) {
      if (this.app.state.value?.paused) this.app.refused.set({ reason: "Paused: press P to go on." });
      this.timer = setInterval(
        () => (Date.now() - this.sentAt > ASLEEP ? this.stop() : this.send()),
        SEND_EVERY,
      );
      this.send();
    } else if (!idle) {
      this.send();
    }
  }

  private send(): void {
    this.sentAt = Date.now();
    const about = this.app.about.value;
    if (about === null || !this.canDrive) return;
    const [forward, left] = this.stick.value;
    const share = this.share.value;
    this.app.send({
      type: "drive",
      linear: forward * share * about.linear_limit,
      angular: left * share * about.angular_limit,
    });
  }
}
