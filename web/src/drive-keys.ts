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
/** Milliseconds between two commands. */
const SEND_EVERY = 50;
/** A longer gap in ms between two commands means that the computer slept. Keys may have been released meanwhile. */
const ASLEEP = 5000;

/** The stick position (forward, left), each from -1 to 1, of a pad and the held keys. Opposite keys cancel out. */
export function stickOf(pad: readonly [number, number], held: Iterable<string>): [number, number] {
  let [forward, left] = pad;
  for (const key of held) {
    forward += KEYS[key]![0];
    left += KEYS[key]![1];
  }
  const clamp = (value: number): number => Math.min(1, Math.max(-1, value));
  return [clamp(forward), clamp(left)];
}

/** Sends drive commands for the held keys and the pad: twenty a second while held, zero on release. After a stop or a
 * lost connection, a held key drives only once it is pressed again. */
export class Driver {
  /** The stick position (forward, left) as a fraction of the limits. */
  readonly stick = new Signal<readonly [number, number]>([0, 0]);
  /** The fraction of the limits at full deflection. */
  readonly share = new Signal(0.6);
  private readonly held = new Set<string>();
  private pad: readonly [number, number] = [0, 0];
  /** Whether the pad must return to its centre before it drives again. */
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

  /** Sets the pad's knob (forward, left), each from -1 to 1. */
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
    if (event.shiftKey && event.code.startsWith("Arrow")) return; // rotates the view
    if (this.app.travel.isPast && (event.code === "ArrowLeft" || event.code === "ArrowRight")) return; // moves through time
    event.preventDefault();
    // after a stop, the auto-repeat of a key that is still held must not drive
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

  /** The program that drives, empty if none does. */
  private get program(): string {
    const program = this.app.program.value;
    return program?.phase === "running" ? program.name : "";
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
    } else if (!idle && this.timer === null && this.program !== "") {
      this.app.refused.set({ reason: `${this.program} drives the robot. Press Space to stop it first.` });
    } else if (!idle && this.timer === null) {
      if (this.app.state.value?.paused)
        this.app.refused.set({ reason: "The simulation is paused. Press P to continue." });
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
