import { Quaternion, Vector3 } from "three";

/** The joint of a link to its parent, in the order of the scene's links. */
export interface Hinge {
  /** Index of the parent link, -1 for the root. */
  parent: number;
  /** x, y, z, qx, qy, qz, qw of the joint's frame in the parent link. */
  origin: readonly number[];
  /** Index of the joint in the scene, -1 for a fixed joint. */
  joint: number;
  /** Unit vector in the joint's frame. */
  axis: readonly number[];
  slides: boolean;
}

/** A joint that mimics another: multiplier * position of `leader` + offset. */
export interface Follow {
  joint: number;
  leader: number;
  multiplier: number;
  offset: number;
}

export interface Kinematics {
  hinges: readonly Hinge[];
  follows: readonly Follow[];
  /** Indices of the links, each after its parent. */
  order: readonly number[];
}

/** The positions of all joints, with mimic joints set from their leaders. */
export function applyMimics(kinematics: Kinematics, positions: readonly number[]): number[] {
  const all = [...positions];
  for (const { joint, leader, multiplier, offset } of kinematics.follows)
    all[joint] = multiplier * (positions[leader] ?? 0) + offset;
  return all;
}

/** Flat x, y, z, qx, qy, qz, qw of every link in the root's frame, for joint positions in rad and m. */
export function poses(kinematics: Kinematics, positions: readonly number[]): number[] {
  const flat = new Array<number>(kinematics.hinges.length * 7).fill(0);
  const [place, turn, motion] = [new Vector3(), new Quaternion(), new Quaternion()];
  const [above, axis] = [new Quaternion(), new Vector3()];
  for (const index of kinematics.order) {
    const hinge = kinematics.hinges[index]!;
    place.set(0, 0, 0);
    turn.identity();
    if (hinge.parent >= 0) {
      const position = hinge.joint < 0 ? 0 : (positions[hinge.joint] ?? 0);
      place.fromArray(hinge.origin);
      turn.fromArray(hinge.origin, 3);
      axis.fromArray(hinge.axis);
      if (hinge.slides) place.addScaledVector(axis.applyQuaternion(turn), position);
      else turn.multiply(motion.setFromAxisAngle(axis, position));
      above.fromArray(flat, hinge.parent * 7 + 3);
      place.applyQuaternion(above);
      place.x += flat[hinge.parent * 7]!;
      place.y += flat[hinge.parent * 7 + 1]!;
      place.z += flat[hinge.parent * 7 + 2]!;
      turn.premultiply(above);
    }
    place.toArray(flat, index * 7);
    turn.toArray(flat, index * 7 + 3);
  }
  return flat;
}
