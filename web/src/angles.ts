/** The same angle in rad, above -π and at most π, as in `kinematics/angles.py`. */
export function wrap(angle: number): number {
  return angle - 2 * Math.PI * Math.ceil(angle / (2 * Math.PI) - 0.5);
}

/** The yaw in rad of a quaternion x, y, z, w. */
export function yawOf([x = 0, y = 0, z = 0, w = 1]: readonly number[]): number {
  return Math.atan2(2 * (w * z + x * y), w * w + x * x - y * y - z * z);
}
