import type { FallenView } from "../protocol";
import type { Status } from "./set";

/** The status for objects that fell out of the world, null if there are none. */
export function fallenStatus(fallen: readonly FallenView[]): Status | null {
  return fallen.length === 0
    ? null
    : {
        level: "warn",
        reason: fallen.map((view) => `${fallenText(view)}, z=${view.z.toFixed(0)} m now`).join("; "),
      };
}

/** A sentence such as `box_1 fell out of the world at t=12.3 s`. */
export function fallenText({ name, time }: FallenView): string {
  return `${name || "the robot"} fell out of the world at t=${time.toFixed(1)} s`;
}
