import { Matrix4, Quaternion, Vector3 } from "three";

import type { App } from "../app";
import type { Scene, State } from "../protocol";

/** Seconds of past states that are kept at least. */
const KEPT_SECONDS = 2;
const ONE = new Vector3(1, 1, 1);

/** The poses of all frames, now and in the last seconds: the robot's links and other frames of tf. */
export class Transforms {
  private readonly links = new Map<string, number>();
  private past: State[] = [];
  private scene: Scene | null = null;

  constructor(app: App) {
    app.scene.watch((scene) => scene && this.begin(scene));
    app.state.watch((state) => state && this.add(state));
  }

  /** Name of the world frame. */
  get world(): string {
    return this.scene?.world ?? "";
  }

  /** Names of all frames, first the links in the scene's order. */
  get names(): readonly string[] {
    return [...this.links.keys(), ...(this.past.at(-1)?.frames ?? []).map(([name]) => name!)];
  }

  /** The parent of a frame, empty for the root. */
  parent(frame: string): string {
    const external = this.past.at(-1)?.frames.find(([name]) => name === frame);
    if (external !== undefined) return external[1] ?? "";
    return this.scene?.links[this.links.get(frame) ?? -1]?.parent ?? "";
  }

  /** `world_from_frame`, now or at a simulated time in s, interpolated. Null if the frame does not exist. */
  lookup(frame: string, time: number | null, into = new Matrix4()): Matrix4 | null {
    const name = frame.replace(/^\//, "");
    if (name === this.world) return into.identity();
    const after = time === null ? this.past.length - 1 : this.firstFrom(time);
    const late = this.pose(name, this.past[after]);
    if (late === null) return null;
    const before = this.past[after - 1];
    const early = time === null || before === undefined ? null : this.pose(name, before);
    const [place, turn] = read(late);
    if (early !== null && before !== undefined) {
      const span = this.past[after]!.time - before.time;
      const part = Math.min(1, Math.max(0, span > 0 ? (time! - before.time) / span : 1));
      const [from, turnFrom] = read(early);
      place.lerpVectors(from, place.clone(), part);
      turn.slerpQuaternions(turnFrom, turn.clone(), part);
    }
    return into.compose(place, turn, ONE);
  }

  private begin(scene: Scene): void {
    this.scene = scene;
    this.past = [];
    this.links.clear();
    scene.links.forEach((link, index) => this.links.set(link.name, index));
  }

  private add(state: State): void {
    const last = this.past.at(-1);
    if (last !== undefined && (state.time <= last.time || state.resets !== last.resets)) this.past = [];
    this.past.push(state);
    if (state.time - this.past[0]!.time > 2 * KEPT_SECONDS)
      this.past = this.past.filter((kept) => state.time - kept.time <= KEPT_SECONDS);
  }

  /** Index of the first state that is not before a time, or of the last state. */
  private firstFrom(time: number): number {
    let at = this.past.length - 1;
    while (at > 0 && this.past[at - 1]!.time >= time) at -= 1;
    return at;
  }

  private pose(name: string, state: State | undefined): readonly [readonly number[], number] | null {
    if (state === undefined) return null;
    const link = this.links.get(name);
    if (link !== undefined) return [state.poses, link * 7];
    const external = state.frames.findIndex(([frame]) => frame === name);
    return external < 0 ? null : [state.frame_poses, external * 7];
  }
}

function read([numbers, at]: readonly [readonly number[], number]): [Vector3, Quaternion] {
  return [new Vector3().fromArray(numbers, at), new Quaternion().fromArray(numbers, at + 3)];
}
