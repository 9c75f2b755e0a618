import type { Line, Link } from "../connection";
import type { FromPage, FromServer, JointView, State } from "../protocol";
import { Signal } from "../signal";
import { poses, settled } from "./kinematics";
import { held, type Saved } from "./saved";

/** Limit of states that are replayed on a jump, so that the trail is complete. */
const MOST_AT_ONCE = 300;

/** Replaces the server in a page that was saved as one file. */
export class Replies implements Line {
  readonly link = new Signal<Link>("live");
  readonly writes = false;
  private readonly joints: readonly JointView[];
  private state: State | null = null;
  private shown = -1;
  private resets = 0;

  constructor(
    private readonly hear: (message: FromServer) => void,
    private readonly saved: Saved,
  ) {
    const scene = saved.greeting.find((message) => message.type === "scene");
    this.joints = scene?.type === "scene" ? scene.joints : [];
    queueMicrotask(() => {
      for (const message of saved.greeting)
        if (message.type !== "state" || saved.states.length === 0) this.tell(message);
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
      this.tell({ ...this.saved.states[at]!, resets: this.resets });
    const state = this.saved.states[index];
    if (state !== undefined) this.tell({ ...state, resets: this.resets });
    this.shown = index;
  }

  send(message: FromPage): void {
    switch (message.type) {
      case "set_joint":
        this.put((joint, now) => (joint.name === message.name ? message.position : now));
        break;
      case "set_joints": {
        const wanted = { zero: () => 0, centre: middle, random: anywhere }[message.preset];
        this.put(wanted);
        break;
      }
      case "open_source": {
        const source = this.saved.sources.find((one) => one.file === message.file);
        if (source !== undefined) this.hear(source);
        break;
      }
    }
  }

  private tell(message: FromServer): void {
    if (message.type === "state") this.state = message;
    this.hear(message);
  }

  private put(wanted: (joint: JointView, now: number) => number): void {
    if (this.state === null) return;
    const now = this.state.positions;
    const positions = settled(
      this.saved.kinematics,
      this.joints.map((joint, index) => held(joint, wanted(joint, now[index] ?? 0))),
    );
    this.tell({ ...this.state, positions, poses: poses(this.saved.kinematics, positions) });
  }
}

function middle(joint: JointView): number {
  return (joint.lower + joint.upper) / 2;
}

function anywhere(joint: JointView): number {
  return joint.lower + Math.random() * (joint.upper - joint.lower);
}
