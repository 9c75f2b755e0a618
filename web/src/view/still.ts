import type { State } from "../protocol";

/** Whether two states look the same, regardless of their time. */
export function looksTheSame(a: State, b: State): boolean {
  return (
    a.resets === b.resets &&
    isSame(a.poses, b.poses) &&
    isSame(a.bodies, b.bodies) &&
    isSame(a.frame_poses, b.frame_poses) &&
    isSame(a.frames.flat(), b.frames.flat())
  );
}

function isSame<T>(a: readonly T[], b: readonly T[]): boolean {
  return a.length === b.length && a.every((value, index) => value === b[index]);
}
