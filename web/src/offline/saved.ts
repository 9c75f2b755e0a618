import type { FromServer, JointView, SourceText, State } from "../protocol";
import type { Kinematics } from "./kinematics";

/** The data of a page that was saved as one file. It replaces the server. */
export interface Saved {
  /** The first messages of the server. */
  greeting: readonly FromServer[];
  sources: readonly SourceText[];
  /** Packed meshes by id, in base64. */
  meshes: Readonly<Record<string, string>>;
  kinematics: Kinematics;
  /** The licences of the packages in the page. */
  licences: string;
  /** Recorded states in order of time. Empty if the user sets the joints. */
  states: readonly State[];
}

/** Reads the saved data from the page. */
export function readSaved(): Saved {
  return JSON.parse(document.getElementById("saved")?.textContent ?? "null") as Saved;
}

/** Clamps a position to the joint's limits. A continuous joint has none. */
export function clampToLimits(joint: JointView, position: number): number {
  return joint.kind === "continuous" ? position : Math.min(Math.max(position, joint.lower), joint.upper);
}
