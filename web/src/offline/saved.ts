import type { FromServer, JointView, SourceText, State } from "../protocol";
import type { Kinematics } from "./kinematics";

/** What a page that was saved as one file carries along in place of a server. */
export interface Saved {
  /** What a server tells a page first. */
  greeting: readonly FromServer[];
  sources: readonly SourceText[];
  /** Packed meshes by id, in base64. */
  meshes: Readonly<Record<string, string>>;
  kinematics: Kinematics;
  /** Moments that were recorded, in order of time; empty where the joints are set by hand. */
  states: readonly State[];
}

/** Reads what the page was saved with. */
export function readSaved(): Saved {
  return JSON.parse(document.getElementById("saved")?.textContent ?? "null") as Saved;
}

/** A position within a joint's range; a continuous one turns without end. */
export function held(joint: JointView, position: number): number {
  return joint.kind === "continuous" ? position : Math.min(Math.max(position, joint.lower), joint.upper);
}
