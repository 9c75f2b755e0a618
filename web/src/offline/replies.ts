import type { Channel, Link } from "../connection";
import type { FromPage, FromServer, JointView, State } from "../protocol";
import { Signal } from "../signal";
import { poses, applyMimics } from "./kinematics";
import { clampToLimits, type Saved } from "./saved";

/** Limit of states that are replayed on a jump, so that the trail is complete. */
const MOST_AT_ONCE = 300;

/** Replaces the server in a page that was saved as one file. */
export class Replies implements Channel {
  readonly link = new Signal<Link>("live");
  readonly hasEnded = false;
  readonly writes = false;
  private readonly joints: readonly JointView[];
  private state: State | null = null;
  private shown = -1;
  private resets = 0;

  constructor(
    private readonly receive: (message: FromServer) => void,
    private readonly saved: Saved,
  ) {
    const scene = saved.greeting.find((message) => message.type === "scene");
    this.joints = scene?.type === "scene" ? scene.joints : [];
    queueMicrotask(() => {
      for (const message of saved.greeting)
        if (message.type !== "state" || saved.states.length === 0) this.emit(message);
      this.show(saved.states.length - 1);
    });
  }

  /** Shows a recorded state, and the trail up to it. */
  show(index: number): void {
    if (index < this.shown) {
      this.shown = -1;
      this.resets += 1;
    }
    const stride = Math.ceil((index - this.shown) / MOST_AT_ONCE);
    for (let at = this.shown + 1; at < index; at += stride)
      this.emit({ ...this.saved.states[at]!, resets: this.resets });
    const state = this.saved.states[index];
    if (state !== undefined) this.emit({ ...state, resets: this.resets });
    this.shown = index;
  }

  send(message: FromPage): void {
    switch (message.type) {
      case "set_joint":
        this.setPositions((joint, now) => (joint.name === message.name ? message.position : now));
        break;
      case "set_joints": {
        const target = { zero: () => 0, centre: middle, random: anywhere }[message.preset];
        this.setPositions(target);
        break;
      }
      case "open_source": {
        const source = this.saved.sources.find(({ file }) => file === message.file);
        if (source !== undefined) this.receive(source);
        break;
      }
    }
  }

  private emit(message: FromServer): void {
    if (message.type === "state") this.state = message;
    this.receive(message);
  }

  private setPositions(target: (joint: JointView, now: number) => number): void {
    if (this.state === null) return;
    const now = this.state.positions;
    const positions = applyMimics(
      this.saved.kinematics,
      this.joints.map((joint, index) => clampToLimits(joint, target(joint, now[index] ?? 0))),
    );
    this.emit({ ...this.state, positions, poses: poses(this.saved.kinematics, positions) });
  }
}

function middle(joint: JointView): number {
  return (joint.lower + joint.upper) / 2;
}

function anywhere(joint: JointView): number {
  return joint.lower + Math.random() * (joint.upper - joint.lower);
}
