import type { State } from "../protocol";

/** Whether two states look the same, regardless of their time. */
export function looksTheSame(one: State, other: State): boolean {
  return (
    one.resets === other.resets &&
    isSame(one.poses, other.poses) &&
    isSame(one.bodies, other.bodies) &&
    isSame(one.frame_poses, other.frame_poses) &&
    isSame(one.frames.flat(), other.frames.flat())
  );
}

function isSame<T>(a: readonly T[], b: readonly T[]): boolean {
  return a.length === b.length && a.every((value, index) => value === b[index]);
}
