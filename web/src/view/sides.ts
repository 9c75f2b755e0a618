import { Vector3 } from "three";

export type Side = "top" | "front" | "side";

/** Tilt from straight down in rad, so that the up direction of the view is defined. */
export const TILT = 1e-3;
/** Azimuth and elevation of each side in degrees. */
export const SIDES: Readonly<Record<Side, readonly [number, number]>> = {
  front: [0, 0],
  side: [270, 0],
  top: [270, 90 - (TILT * 180) / Math.PI],
};
const DIRECTIONS: readonly [Side, Vector3][] = [
  ["top", new Vector3(0, 0, 1)],
  ["front", new Vector3(1, 0, 0)],
  ["side", new Vector3(0, -1, 0)],
];

/** The side that a camera at `eye` looks from, both in m. Empty for other directions. */
export function sideOf(eye: readonly number[], target: readonly number[]): Side | "" {
  const away = new Vector3().fromArray(eye).sub(new Vector3().fromArray(target));
  return DIRECTIONS.find(([, direction]) => away.angleTo(direction) < 2 * TILT)?.[0] ?? "";
}
